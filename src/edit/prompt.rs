//! Chooses labels by points, boxes and masks in views.

use super::catalogue::Catalogue;
use super::choose::{candidates, require_labels};
use labelgs_scene::{Error, LabelMap, Result, Setting, UNLABELLED};
use std::collections::BTreeSet;

/// A part of a view. Pixels count from 0 at the top left, at the size of the label map.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum PromptArea {
    /// The label at this pixel: column, row.
    Point(u32, u32),
    /// Labels with more than half of their pixels in this box: first column and row, then end column and row,
    /// exclusive.
    Box([u32; 4]),
    /// Labels with more than half of their pixels in this mask, row-major.
    Mask(Vec<bool>),
}

/// A part of a view and what to do with its labels.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Prompt {
    /// Flag of the prompt, for messages.
    pub argument: &'static str,
    /// Name of the view.
    pub view: String,
    /// Size of the label map, px; `None`: the size of the view.
    pub size: Option<(u32, u32)>,
    /// The part of the view.
    pub place: PromptArea,
    /// Removes the labels from the choice instead of adding them.
    pub away: bool,
}

/// Adds the labels of prompts to `start`, then removes those of prompts with `away`. An empty choice is an error.
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
            // The background has no label to remove.
            PromptArea::Point(x, y) if prompt.away && map.get(x, y) == Some(0) => {}
            _ if prompt.away => away.extend(labels_at(prompt.argument, &prompt.place, &map, known)?),
            _ => chosen.extend(labels_at(prompt.argument, &prompt.place, &map, known)?),
        }
    }
    let rest: BTreeSet<u32> = chosen.difference(&away).copied().collect();
    if rest.is_empty() {
        let lost: Vec<String> = chosen.iter().map(|&id| known.title(id)).collect();
        let lost =
            if lost.is_empty() { "nothing was chosen".into() } else { format!("it removes {}", lost.join(", ")) };
        return Err(Error::usage(Setting("not_at"), format!("leaves no label: {lost}; {}", known.describe())));
    }
    Ok(rest)
}

/// Returns the labels in a part of a view's label map. Errors name `argument` and list candidates.
fn labels_at(argument: &str, place: &PromptArea, map: &LabelMap, known: &Catalogue) -> Result<BTreeSet<u32>> {
    let outside = |what: String| {
        Error::usage(argument, format!("{what} is outside the view, which has {} x {} px", map.width, map.height))
    };
    match place {
        &PromptArea::Point(x, y) => match map.get(x, y).map(u32::from) {
            None => Err(outside(format!("{x},{y}"))),
            Some(UNLABELLED) => {
                Err(Error::usage(argument, format!("no label is at {x},{y}; the view shows {}", shown(map, known))))
            }
            Some(label) => Ok(BTreeSet::from([label])),
        },
        &PromptArea::Box([x0, y0, x1, y1]) => {
            if x0 >= x1.min(map.width) || y0 >= y1.min(map.height) {
                return Err(outside(format!("{x0},{y0},{x1},{y1}")));
            }
            let inside = (0..map.height).flat_map(|y| (0..map.width).map(move |x| (x, y)));
            let inside: Vec<bool> = inside.map(|(x, y)| (x0..x1).contains(&x) && (y0..y1).contains(&y)).collect();
            require_labels(argument, map, &inside, known).map(BTreeSet::from_iter)
        }
        PromptArea::Mask(inside) => require_labels(argument, map, inside, known).map(BTreeSet::from_iter),
    }
}

/// Lists the labels of a view by decreasing number of pixels, for messages.
fn shown(map: &LabelMap, known: &Catalogue) -> String {
    let found = candidates(map, &vec![true; map.ids.len()]);
    let texts: Vec<String> =
        found.iter().take(12).map(|c| format!("{} ({} px)", known.title(c.label), c.pixels)).collect();
    if texts.is_empty() { "no label at all".to_owned() } else { texts.join(", ") }
}
