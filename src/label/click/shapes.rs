//! Compares an object's masks in single views: agreement between views, overlap, and the thickest point.

use super::OBJECT_ID;
use super::photos::Masks;
use crate::label::masks::nested::{NestedMasks, sight::ViewSight};
use crate::render::Render;
use crate::scene::LabelMap;
use crate::segment::{PhotoPoint, Prompt};

/// Smallest overlap of two views' masks at which both show the object.
const AGREEING_MIN: f64 = 0.5;
/// A smaller mask is preferred if its agreement is at least this share of the best: missing parts are easily added by a
/// click.
const CLOSE_MIN: f64 = 0.9;
/// Most positions sampled from a mask.
const PLACES_MAX: usize = 64;

/// The network's masks of a view.
pub(super) struct ViewMasks {
    view: usize,
    /// Masks at the size of the view.
    masks: Vec<LabelMap>,
    qualities: Vec<f64>,
    sight: ViewSight,
}

impl ViewMasks {
    pub(super) fn new(view: usize, (masks, qualities): Masks, shown: Option<&Render>) -> Self {
        let layer = |(mask, number): (&LabelMap, u16)| LabelMap {
            ids: mask.ids.iter().map(|id| id * number).collect(),
            ..mask.clone()
        };
        let nested = NestedMasks { layers: masks.iter().zip(1..).map(layer).collect(), qualities };
        let sight = shown.map_or_else(ViewSight::default, |shown| ViewSight::new(&shown.top_id, &nested));
        Self { view, masks, qualities: nested.qualities, sight }
    }
}

/// Chooses the mask of the first view (a part, the object, or more) that other views agree with most, and returns it
/// with their masks. Among masks with almost the same agreement, it takes the smallest.
pub(super) fn agreeing(asked: &[ViewMasks]) -> Vec<(usize, LabelMap)> {
    let Some((first, others)) = asked.split_first() else { return Vec::new() };
    let overlaps: Vec<_> = others.iter().map(|other| first.sight.overlaps(&other.sight)).collect();
    let mut levels = Vec::new();
    for (level, mask) in first.masks.iter().enumerate() {
        let (mut found, mut sum) = (vec![(first.view, mask.clone())], 0.0);
        for (other, overlaps) in others.iter().zip(&overlaps) {
            let own = overlaps.iter().filter(|(ours, ..)| usize::from(*ours) == level);
            let Some((_, theirs, overlap)) = own.max_by(|a, b| a.2.ratio().total_cmp(&b.2.ratio())) else { continue };
            if overlap.ratio() >= AGREEING_MIN {
                sum += overlap.ratio();
                found.push((other.view, other.masks[usize::from(*theirs)].clone()));
            }
        }
        levels.push((first.qualities[level] * (1.0 + sum), found));
    }
    let most = levels.iter().map(|(agreement, _)| *agreement).fold(0.0, f64::max);
    let close = levels.into_iter().filter(|(agreement, _)| *agreement >= CLOSE_MIN * most);
    let area = |(_, found): &(f64, Vec<(usize, LabelMap)>)| found[0].1.ids.iter().filter(|id| **id != 0).count();
    close.min_by_key(area).map(|(_, found)| found).unwrap_or_default()
}

/// Returns the masks that contain none of these positions.
pub(super) fn without((masks, qualities): Masks, off: &[PhotoPoint]) -> Masks {
    let has = |mask: &LabelMap, [x, y]: PhotoPoint| mask.ids[y as usize * mask.width as usize + x as usize] != 0;
    let kept = masks.into_iter().zip(qualities).filter(|(mask, _)| !off.iter().any(|place| has(mask, *place)));
    kept.unzip()
}

/// Returns the intersection over union of two masks.
pub(super) fn iou(a: &LabelMap, b: &LabelMap) -> f64 {
    let count =
        |of: &dyn Fn(bool, bool) -> bool| a.ids.iter().zip(&b.ids).filter(|(a, b)| of(**a != 0, **b != 0)).count();
    count(&|a, b| a && b) as f64 / count(&|a, b| a || b).max(1) as f64
}

/// Returns the bounding box of the object's pixels, and the pixel farthest from their border.
pub(super) fn prompt_of(map: &LabelMap) -> Option<Prompt> {
    let depths = map.depths(OBJECT_ID);
    let deepest = (0..).zip(&depths).max_by_key(|(at, depth)| (**depth, *at));
    let (at, _) = deepest.filter(|(_, depth)| **depth > 1)?;
    let [left, top, right, bottom] = map.bounds()?.map(|side| side as f32);
    Some(Prompt { on: vec![place(map, at)], off: Vec::new(), area: Some([[left, top], [right, bottom]]) })
}

/// Returns positions spread over a mask, starting with the one farthest from its border.
pub(super) fn places(map: &LabelMap) -> Vec<PhotoPoint> {
    let depths = map.depths(OBJECT_ID);
    let mut inside: Vec<usize> = (0..depths.len()).filter(|&at| depths[at] > 0).collect();
    inside.sort_by_key(|&at| std::cmp::Reverse(depths[at]));
    inside.iter().step_by(inside.len().div_ceil(PLACES_MAX).max(1)).map(|&at| place(map, at)).collect()
}

/// Returns the centre of a pixel.
fn place(map: &LabelMap, at: usize) -> PhotoPoint {
    let width = map.width as usize;
    [(at % width) as f32 + 0.5, (at / width) as f32 + 0.5]
}
