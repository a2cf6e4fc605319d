//! Occluders: which objects hide which in one view. They are the paper's O_k; U_k excludes the pixels of k's occluders.
//!
//! [`occluders_by_mean`] is the paper's rule, for a network's monocular depth. [`occluders_by_contour`] needs
//! consistent depth, such as that of the model. Both use the contours between objects: a pixel is on the contour of k
//! with k' if its label is k and one of its 8 neighbours is k'. Unlabelled pixels (0) are not hidden;
//! [`occluders_by_contour`] lets them hide objects, because masks rarely cover everything in front of an object.

mod contour;
mod depths;
pub mod draw;
mod hull;
pub mod mean;

pub use contour::{Rule, occluders_by_contour};
pub use depths::from_depths;
pub use draw::picture;
pub(crate) use mean::distances;
pub use mean::occluders_by_mean;

use crate::scene::LabelMap;
use std::collections::BTreeMap;

/// Calls `visit(own label, other label, pixel, neighbours)` for each pixel on a contour and each label on the other
/// side, sorted, the background included. `neighbours` are those of the 8 neighbours with the other label.
fn walk(labels: &LabelMap, mut visit: impl FnMut(u16, u16, usize, &[usize])) {
    let (width, height) = (i64::from(labels.width), i64::from(labels.height));
    let mut others: BTreeMap<u16, Vec<usize>> = BTreeMap::new();
    for (index, &own) in labels.ids.iter().enumerate() {
        let (x, y) = (index as i64 % width, index as i64 / width);
        others.clear();
        for row in (y - 1).max(0)..=(y + 1).min(height - 1) {
            for column in (x - 1).max(0)..=(x + 1).min(width - 1) {
                let at = (row * width + column) as usize;
                let other = labels.ids[at];
                if other != own {
                    others.entry(other).or_default().push(at);
                }
            }
        }
        others.iter().for_each(|(&other, neighbours)| visit(own, other, index, neighbours));
    }
}
