//! Scores held-out views by region: seen and unseen in training; objects, their contours, and the rest.
//!
//! A score over whole views mixes pixels that training views show with pixels that training must invent.

use super::corrected::psnr_corrected;
use super::subject::Subject;
use crate::Result;
use crate::eval::metrics::{psnr_over, scores};
use crate::render::{Parts, Render, RenderOptions};
use crate::scene::{Camera, LabelMap, Photo, Pixels, View};
use crate::scenes::array_store::ArrayStore;
use glam::DVec3;
use rayon::prelude::*;

/// Fewest training views that must see a pixel for it to count as seen.
const SEEING_VIEWS_MIN: usize = 3;
/// A training view sees a point if its depth there is at least this share of the point's depth.
const DEPTH_SHARE_MIN: f64 = 0.95;
/// Distance of pixels without depth, such as sky, as a multiple of the largest depth.
const BACKGROUND_DEPTH_FACTOR: f64 = 1e3;
/// Width of the contour region on each side of a mask contour, px.
const CONTOUR_WIDTH_PX: u32 = 2;

scores! {
    /// PSNR by region, dB; `None` for a region without pixels.
    RegionScores {
        /// Share of the pixels that at least three training views see, by the depth of the model.
        seen_share,
        /// PSNR over these pixels.
        psnr_seen,
        /// The same after colour correction, so that exposure does not count.
        psnr_seen_corrected,
        /// PSNR over all other pixels.
        psnr_unseen,
        /// PSNR over the mask's objects, without contours.
        psnr_objects,
        /// PSNR within 2 px of mask contours.
        psnr_contours,
        /// PSNR over the unlabelled rest.
        psnr_rest,
    }
}

impl RegionScores {
    /// Scores a picture.
    pub(super) fn new(rgb: &[[f32; 3]], photo: &Photo, mask: Option<&LabelMap>, seen: &[bool]) -> Self {
        let over = |counts: &dyn Fn(usize) -> bool| psnr_over(rgb, photo, counts);
        let near = mask.map(|mask| mask.near_contour(CONTOUR_WIDTH_PX));
        let labelled = |counts: &dyn Fn(bool, bool) -> bool| {
            let (mask, near) = (mask?, near.as_ref()?);
            over(&|index| counts(mask.ids[index] != 0, near[index]))
        };
        Self {
            seen_share: Some(seen.iter().filter(|&&seen| seen).count() as f64 / seen.len().max(1) as f64),
            psnr_seen: over(&|index| seen[index]),
            psnr_seen_corrected: psnr_corrected(rgb, photo, |index| seen[index]),
            psnr_unseen: over(&|index| !seen[index]),
            psnr_objects: labelled(&|object, near| object && !near),
            psnr_contours: labelled(&|_, near| near),
            psnr_rest: labelled(&|object, near| !object && !near),
        }
    }
}

/// Model depths in all training views, to decide what these views see.
pub(super) struct TrainingDepths {
    cameras: Vec<(Camera, Pixels<Vec<f32>>)>,
}

impl TrainingDepths {
    /// Renders the depth of every training view.
    pub(super) fn new(subject: &mut dyn Subject, train: &[View], options: RenderOptions) -> Result<Self> {
        let mut shelf = ArrayStore::default();
        let depth = |view: &View| {
            let of_depth = RenderOptions { parts: Parts::DEPTH, sh_degree: Some(0), ..options };
            let depth = subject.render(&view.camera, &of_depth)?.mean_depth()?;
            Ok((view.camera.clone(), shelf.put(depth)))
        };
        Ok(Self { cameras: train.iter().map(depth).collect::<Result<_>>()? })
    }

    /// Returns the pixels of a rendered view that enough training views see.
    pub(super) fn see(&self, camera: &Camera, rendered: &Render) -> Result<Vec<bool>> {
        // One training view at a time, because the world points of all may not fit into memory.
        let world = world_points(camera, &rendered.mean_depth()?);
        let mut open: Vec<(DVec3, usize)> = world.into_iter().map(|world| (world, 0)).collect();
        for (other, depths) in &self.cameras {
            let depths = depths.get()?;
            let is_open = |(world, seen): &mut (DVec3, usize)| {
                *seen += usize::from(*seen < SEEING_VIEWS_MIN && sees(other, &depths, *world));
                *seen < SEEING_VIEWS_MIN
            };
            if open.par_iter_mut().filter_map(|pixel| is_open(pixel).then_some(())).count() == 0 {
                break;
            }
        }
        Ok(open.into_iter().map(|(_, seen)| seen == SEEING_VIEWS_MIN).collect())
    }
}

/// Returns the world point of each pixel, by its mean depth; pixels without depth are far away.
pub(super) fn world_points(camera: &Camera, depths: &[f32]) -> Vec<DVec3> {
    let far = BACKGROUND_DEPTH_FACTOR * f64::from(depths.iter().copied().fold(1e-6_f32, f32::max));
    let place = |(index, &depth): (usize, &f32)| {
        let depth = if depth > 0.0 { f64::from(depth) } else { far };
        camera.unproject(camera.pixel_centre(index), depth)
    };
    depths.par_iter().enumerate().map(place).collect()
}

/// Returns true if the point is in the picture and the model does not occlude it.
fn sees(camera: &Camera, depths: &[f32], world: DVec3) -> bool {
    let Some(pixel) = camera.sees(world) else { return false };
    let depth = f64::from(depths[pixel.y as usize * camera.width as usize + pixel.x as usize]);
    depth <= 0.0 || depth >= DEPTH_SHARE_MIN * camera.to_camera(world).z
}
