//! Finds photos that share too few points with others.

use super::{CaptureProblem, Finding, ViewReport};

/// Fewest points that a photo must share with two others.
const SHARED_MIN: usize = 20;
/// The same, relative to the median over photos.
const SHARED_RATIO_MIN: f64 = 0.05;
/// Fewest points of a scene for this test.
const POINTS_MIN: usize = 200;

/// Finds photos that share hardly any points with others.
pub(super) fn findings(views: &[ViewReport], points: usize) -> Vec<Finding> {
    if points < POINTS_MIN {
        return Vec::new();
    }
    let mut sorted: Vec<usize> = views.iter().map(|view| view.shared).collect();
    sorted.sort_unstable();
    let usual = sorted[sorted.len() / 2];
    let least = SHARED_MIN.max((SHARED_RATIO_MIN * usual as f64) as usize);
    let odd = |view: &ViewReport| {
        let usual = if usual > least { format!(", {usual} is usual") } else { String::new() };
        let text = format!("shares {} points with two others{usual}: its pose is unconfirmed", view.shared);
        (view.shared < least).then(|| Finding::new(CaptureProblem::Alone, Some(&view.name), text))
    };
    views.iter().filter_map(odd).collect()
}
