//! Scores by position in the world, such as per block of a scene and at the seams between blocks.

use super::metrics::{clamped, colour_of, psnr_of, square};
use super::regions::world_points;
use crate::error::Result;
use crate::render::{Parts, Render, RenderOptions};
use crate::scene::{Camera, View};
use glam::DVec3;
use serde::Serialize;
use std::collections::BTreeMap;

/// Groups of world positions, by which pixels are scored.
pub trait PlaceGroups: Sync {
    /// Returns the names of the groups.
    fn names(&self) -> Vec<String>;

    /// Returns the groups of a world point, by index.
    fn groups_at(&self, world: DVec3) -> Vec<usize>;
}

/// The score of a group.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PlaceScore {
    /// Number of pixels of all views.
    pub pixels: u64,
    /// PSNR over these pixels, dB.
    pub psnr: f64,
}

/// Scores the pixels of each group over views with photos. The model's depth gives the position of a pixel. `draw`
/// renders the model. Groups without pixels are absent.
pub fn score_by_place(
    draw: &mut dyn FnMut(&Camera, &RenderOptions) -> Result<Render>,
    views: &[&View],
    options: RenderOptions,
    places: &dyn PlaceGroups,
) -> Result<BTreeMap<String, PlaceScore>> {
    let names = places.names();
    let mut sums = vec![(0.0, 0_u64); names.len()];
    for view in views {
        let rendered = draw(&view.camera, &RenderOptions { parts: Parts::DEPTH, ..options })?;
        let (photo, world) = (view.photo()?, world_points(&view.camera, &rendered.mean_depth()?));
        let pixels = world.iter().zip(&rendered.rgb).zip(&photo.rgba).filter(|(_, pixel)| pixel[3] > 0);
        for ((&world, &render), &pixel) in pixels {
            let squared = square(clamped(render), colour_of(pixel));
            for group in places.groups_at(world) {
                sums[group].0 += squared;
                sums[group].1 += 1;
            }
        }
    }
    let scored = names.into_iter().zip(sums).filter(|(_, (_, pixels))| *pixels > 0);
    Ok(scored.map(|(name, (sum, pixels))| (name, PlaceScore { pixels, psnr: psnr_of(sum / pixels as f64) })).collect())
}
