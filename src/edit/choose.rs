//! Chooses labels by a mask in one view.

use super::catalogue::Catalogue;
use labelgs_scene::{Error, LabelMap, Result, UNLABELLED};

/// A label with pixels in a mask.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Candidate {
    /// The label.
    pub label: u32,
    /// Number of its pixels inside the mask.
    pub inside: u64,
    /// Number of its pixels in the whole view.
    pub pixels: u64,
}

/// Returns the labels with a pixel inside the mask, by decreasing number of pixels inside.
pub fn candidates(map: &LabelMap, mask: &[bool]) -> Vec<Candidate> {
    let mut counts = vec![(0_u64, 0_u64); 65_536];
    for (&id, &inside) in map.ids.iter().zip(mask) {
        let (within, all) = &mut counts[usize::from(id)];
        *all += 1;
        *within += u64::from(inside);
    }
    let mut found: Vec<Candidate> = (0_u32..)
        .zip(counts)
        .filter(|&(label, (inside, _))| label != UNLABELLED && inside > 0)
        .map(|(label, (inside, pixels))| Candidate { label, inside, pixels })
        .collect();
    found.sort_by_key(|candidate| (std::cmp::Reverse(candidate.inside), candidate.label));
    found
}

/// Returns the labels with more than half of their pixels of the view inside the mask (the paper's rule), sorted;
/// possibly none.
pub fn choose_labels(map: &LabelMap, mask: &[bool]) -> Vec<u32> {
    let mut labels: Vec<u32> = candidates(map, mask)
        .iter()
        .filter(|candidate| 2 * candidate.inside > candidate.pixels)
        .map(|candidate| candidate.label)
        .collect();
    labels.sort_unstable();
    labels
}

/// Like [`choose_labels`], but an empty choice is an error that names `argument` and lists the closest labels.
pub fn require_labels(argument: &str, map: &LabelMap, mask: &[bool], known: &Catalogue) -> Result<Vec<u32>> {
    if mask.len() != map.ids.len() {
        let problem = format!("has {} pixels, the view has {} x {}", mask.len(), map.width, map.height);
        return Err(Error::usage(argument, problem));
    }
    let labels = choose_labels(map, mask);
    if !labels.is_empty() {
        return Ok(labels);
    }
    let near: Vec<String> = candidates(map, mask)
        .iter()
        .take(8)
        .map(|c| format!("{} ({} of its {} pixels are inside)", known.title(c.label), c.inside, c.pixels))
        .collect();
    let problem = if near.is_empty() {
        format!("covers no pixel of any label in this view; draw it over an object; {}", known.describe())
    } else {
        format!(
            "selects nothing, because no label has more than half of its pixels inside; it touches {}; \
             widen it or name one of them",
            near.join(", ")
        )
    };
    Err(Error::usage(argument, problem))
}
