//! Points, boxes and masks in a view, and the labels that they mean.

use super::catalogue::Catalogue;
use super::choose::{candidates, require_labels};
use crate::scene::{LabelMap, UNLABELLED};
use crate::{Error, Result};
use std::collections::BTreeSet;

/// A place in a view. Pixels count from 0 at the top left, in the size in which the label map is rendered.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Place {
    /// The label of this pixel: column, row.
    Point(u32, u32),
    /// Labels with more than half of their pixels in here: first column and row, and the ones behind the last.
    Box([u32; 4]),
    /// Labels with more than half of their pixels in here, row-major.
    Mask(Vec<bool>),
}

/// A place with what it is for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Prompt {
    /// The flag that it came with, for messages.
    pub argument: &'static str,
    /// Name of the view.
    pub view: String,
    /// Size of the label map, px; otherwise the view's.
    pub size: Option<(u32, u32)>,
    /// Where.
    pub place: Place,
    /// True if the labels there are taken away from the choice instead of added.
    pub away: bool,
}

/// Adds to `start` what the prompts mean, then takes away what they take away. An empty choice is an error.
pub fn choose(
    start: BTreeSet<u32>,
    prompts: &[Prompt],
    known: &Catalogue,
    map_of: &mut dyn FnMut(&Prompt) -> Result<LabelMap>,
) -> Result<BTreeSet<u32>> {
    let (mut chosen, mut away) = (start, BTreeSet::new());
    for prompt in prompts {
        let map = map_of(prompt)?;
        match prompt.place {
            // Nothing is no label to take away.
            Place::Point(x, y) if prompt.away && map.get(x, y) == Some(0) => {}
            _ if prompt.away => away.extend(labels_at(prompt.argument, &prompt.place, &map, known)?),
            _ => chosen.extend(labels_at(prompt.argument, &prompt.place, &map, known)?),
        }
    }
    let rest: BTreeSet<u32> = chosen.difference(&away).copied().collect();
    if rest.is_empty() {
        let lost: Vec<String> = chosen.iter().map(|&id| known.title(id)).collect();
        let lost = if lost.is_empty() { "nothing was chosen".into() } else { format!("it takes {}", lost.join(", ")) };
        return Err(Error::usage("not_at", format!("leaves no label: {lost}; {}", known.there_is())));
    }
    Ok(rest)
}

/// The labels that a place means in the label map of its view; an error names `argument` and lists candidates.
fn labels_at(argument: &str, place: &Place, map: &LabelMap, known: &Catalogue) -> Result<BTreeSet<u32>> {
    let outside = |what: String| {
        Error::usage(argument, format!("{what} is outside of the view, which has {} x {} px", map.width, map.height))
    };
    match place {
        &Place::Point(x, y) => match map.get(x, y).map(u32::from) {
            None => Err(outside(format!("{x},{y}"))),
            Some(UNLABELLED) => {
                Err(Error::usage(argument, format!("no label is at {x},{y}; the view shows {}", shown(map, known))))
            }
            Some(label) => Ok(BTreeSet::from([label])),
        },
        &Place::Box([x0, y0, x1, y1]) => {
            if x0 >= x1.min(map.width) || y0 >= y1.min(map.height) {
                return Err(outside(format!("{x0},{y0},{x1},{y1}")));
            }
            let inside = (0..map.height).flat_map(|y| (0..map.width).map(move |x| (x, y)));
            let inside: Vec<bool> = inside.map(|(x, y)| (x0..x1).contains(&x) && (y0..y1).contains(&y)).collect();
            require_labels(argument, map, &inside, known).map(BTreeSet::from_iter)
        }
        Place::Mask(inside) => require_labels(argument, map, inside, known).map(BTreeSet::from_iter),
    }
}

/// Labels of a view with their pixels, most first.
fn shown(map: &LabelMap, known: &Catalogue) -> String {
    let found = candidates(map, &vec![true; map.ids.len()]);
    let texts: Vec<String> =
        found.iter().take(12).map(|c| format!("{} ({} px)", known.title(c.label), c.pixels)).collect();
    if texts.is_empty() { "no label at all".to_owned() } else { texts.join(", ") }
}
