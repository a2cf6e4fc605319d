//! The total blending weight of each Gaussian.

use crate::engine::{Engine, ListKey};
use crate::error::Result;
use crate::scene::Camera;

/// Returns the blending weight of each trained Gaussian over all pixels of views, given with their near planes, px.
/// Overwrites the densification statistic with it. Nothing may be in flight.
pub fn weights<'a>(engine: &mut Engine, views: impl Iterator<Item = (&'a Camera, f32)>) -> Result<Vec<f32>> {
    engine.set_densify_stats(&vec![[0.0; 2]; engine.trained_count() as usize])?;
    for (camera, near) in views {
        for band in engine.bands(camera) {
            let uniforms = engine.band_uniforms(camera, band, near, [0.0; 3]);
            engine.run(ListKey::Weigh, &uniforms)?;
        }
    }
    Ok(engine.densify_stats()?.into_iter().map(|[weight, _]| weight).collect())
}
