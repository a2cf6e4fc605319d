//! Extracts a closed surface mesh of an object from rendered depths.
//!
//! The model is drawn from its cameras. A grid collects the signed distance of each cell to the object's surface, as
//! the mean over the pictures (Curless and Levoy, *A Volumetric Method for Building Complex Models from Range Images*,
//! SIGGRAPH 1996). Cells that no picture shows as free are inside, so that the surface is closed where the object
//! touches something. Surface nets convert the grid to triangles.

mod sights;
mod volume;

use crate::edit::MIN_LABEL_CONFIDENCE;
use crate::engine::Engine;
use crate::error::{Error, Result};
use crate::formats::Mesh;
use crate::gpu::Gpu;
use crate::render::{Parts, RenderOptions, render};
use crate::scene::Gaussians;
use crate::stage::Stage;
use glam::DVec3;
use sights::{BoundingBall, DepthPicture};
use std::sync::Arc;
use volume::Volume;

/// Default number of cells along the longest side of an object.
pub const CELLS_DEFAULT: u32 = 128;
/// Most cells along a side: the values of all cells and pictures then take 2 GB.
pub const CELLS_MAX: u32 = 512;
/// Fewest cells along a side.
pub const CELLS_MIN: u32 = 8;

/// Most directions from which an object is drawn.
const DIRECTIONS_MAX: usize = 64;
/// Directions from which the bounding box of the object is found.
const BOX_DIRECTIONS: usize = 16;
/// Size of these pictures, px.
const BOX_PICTURE_SIDE_PX: u32 = 128;
/// Parts of a render that are read back.
const MESH_PARTS: Parts = Parts { depth: true, main: true, labels: false };
/// Pixels per cell along a side.
const PIXELS_PER_CELL: u32 = 2;
/// Largest side of a picture, px.
const SIDE_MAX_PX: u32 = 1024;
/// Share of the surface pixels at each end of an axis that is ignored as specks.
const SPECK_SHARE: f64 = 0.001;

/// Makes the mesh of the Gaussians with a label, with `cells` cells along its longest side. `cameras` are the world
/// positions of the model's cameras. If none is outside of the object, the object is drawn alone, from all sides.
///
/// # Errors
///
/// The device cannot draw the model, or the object has no surface because no pixel shows it.
pub fn object_mesh(gpu: &Arc<Gpu>, model: &Gaussians, label: u32, cameras: &[DVec3], cells: u32) -> Result<Mesh> {
    let cells = cells.clamp(CELLS_MIN, CELLS_MAX);
    let side = (PIXELS_PER_CELL * cells).clamp(BOX_PICTURE_SIDE_PX, SIDE_MAX_PX);
    let sure = |row: usize| model.label_confidence.as_ref().is_none_or(|shares| shares[row] >= MIN_LABEL_CONFIDENCE);
    let part = model.filtered(|row| model.label(row) == label && sure(row));
    let around = BoundingBall::around(&part);
    let outside: Vec<DVec3> = cameras.iter().copied().filter(|&camera| around.is_seen_from(camera)).collect();
    let is_alone = outside.is_empty();
    let shown = if is_alone { &part } else { model };
    let places = |ball: BoundingBall| {
        let all = if is_alone { ball.all_round(DIRECTIONS_MAX) } else { outside.clone() };
        sights::apart(&all, ball.centre, DIRECTIONS_MAX)
    };
    let mut engine = Engine::for_model(gpu.clone(), shown, [(side, side)])?;
    let mut draw = |ball: BoundingBall, places: &[DVec3], side: u32| {
        let stage = Stage::new("drawing depths", places.len());
        let mut sights = Vec::with_capacity(places.len());
        for &place in places {
            let (camera, near) = ball.camera(place, side);
            let rendered = render(&mut engine, &camera, &RenderOptions::new(near, MESH_PARTS))?;
            sights.push(DepthPicture::new(camera, &rendered, shown, label));
            stage.count();
        }
        Ok::<_, Error>(sights)
    };
    let first = places(around);
    let first = draw(around, &first[..first.len().min(BOX_DIRECTIONS)], BOX_PICTURE_SIDE_PX)?;
    let Some((low, high)) = sights::bounds(&first, SPECK_SHARE) else {
        let problem = "has no surface: its opacity is below one half in every pixel, so it has no mesh";
        return Err(Error::usage("the object", problem));
    };
    let volume = Volume::around(low, high, cells);
    let sights = draw(volume.ball(), &places(volume.ball()), side)?;
    let _stage = Stage::new("fusing depths", 0);
    Ok(volume.mesh(&sights))
}
