//! Small portraits of single labels, each from the view that shows it best.

use super::{Parts, RenderOptions, render};
use crate::edit::select::{MIN_LABEL_CONFIDENCE, extract};
use crate::engine::Engine;
use crate::error::Result;
use crate::scene::colour::to_byte;
use crate::scene::spread::quantiles;
use crate::scene::{Camera, Gaussians};
use glam::{DVec2, DVec3};

/// Quantiles of the Gaussian positions along each axis that span the object's box, so that outliers are ignored.
const BOX_QUANTILES: [f64; 2] = [0.02, 0.98];
/// Width of the picture around an object, in widths of the object.
const FRAME_FACTOR: f64 = 1.25;
/// Focal length if no camera is suitable, in picture widths.
const FOCAL_WIDTHS: f64 = 1.4;

/// Renders a label alone into a square of `side` px, as r, g, b and opacity, from the camera that shows it largest and
/// completely. `up` is used if no camera is suitable. Replaces the engine's model. Fails if the label does not occur.
pub(crate) fn portrait(
    engine: &mut Engine,
    (model, label): (&Gaussians, u32),
    (cameras, up): (&[&Camera], DVec3),
    (side, near): (u32, f32),
) -> Result<Vec<[u8; 4]>> {
    let sure = extract(model, &[label], MIN_LABEL_CONFIDENCE)?;
    let part = if sure.is_empty() { extract(model, &[label], 0.0)? } else { sure };
    let corners = corners(&part);
    let camera = best(cameras, &corners, side).map_or_else(|| beside(&corners, up, side), |(_, camera)| camera);
    engine.upload_model(&part)?;
    engine.grow_image(side, side)?;
    let rendered = render(engine, &camera, &RenderOptions::new(near.min(nearest(&camera, &corners)), Parts::COLOUR))?;
    let pixel = |(colour, &alpha): (&[f32; 3], &f32)| {
        let [r, g, b] = colour.map(|value| to_byte(value / alpha.max(1e-3)));
        [r, g, b, to_byte(alpha)]
    };
    Ok(rendered.rgb.iter().zip(&rendered.alpha).map(pixel).collect())
}

/// Returns the camera that shows a model largest and completely, if the model is in front of any camera.
pub(crate) fn best_camera<'a>(model: &Gaussians, cameras: &[&'a Camera]) -> Option<&'a Camera> {
    best(cameras, &corners(model), 1).map(|(camera, _)| camera)
}

/// Returns the camera that shows a box largest and completely, cropped to a square around the box.
fn best<'a>(cameras: &[&'a Camera], corners: &[DVec3; 8], side: u32) -> Option<(&'a Camera, Camera)> {
    let seen = cameras.iter().filter_map(|&camera| Some((camera, closer(camera, corners, side)?)));
    let best = seen.max_by(|a, b| a.1.0.total_cmp(&b.1.0));
    best.map(|(camera, (_, close))| (camera, close))
}

/// Returns the corners of a box around most Gaussians, world units.
fn corners(part: &Gaussians) -> [DVec3; 8] {
    let ends = quantiles((0..part.len()).map(|row| part.world(row)), BOX_QUANTILES);
    std::array::from_fn(|corner| DVec3::from_array([0, 1, 2].map(|axis| ends[corner >> axis & 1][axis])))
}

/// Returns the area at which a camera shows a box, px squared, and the camera cropped to a square around it. `None` if
/// the box is behind the camera.
fn closer(camera: &Camera, corners: &[DVec3; 8], side: u32) -> Option<(f64, Camera)> {
    let mut low = DVec2::INFINITY;
    let mut high = DVec2::NEG_INFINITY;
    for &corner in corners {
        let at = camera.to_camera(corner);
        if at.z <= 0.0 {
            return None;
        }
        let pixel = camera.project(at);
        (low, high) = (low.min(pixel), high.max(pixel));
    }
    let picture = DVec2::new(f64::from(camera.width), f64::from(camera.height));
    let seen = (high.min(picture) - low.max(DVec2::ZERO)).max(DVec2::ZERO);
    let whole = (high - low).max(DVec2::splat(1e-6));
    // A box that is half in the picture counts a quarter.
    let share = seen.element_product() / whole.element_product();
    let width = FRAME_FACTOR * whole.max_element().max(1.0);
    let corner = 0.5 * (low + high) - 0.5 * width;
    let scale = f64::from(side) / width;
    let [fx, fy] = [camera.fx, camera.fy].map(|focal| focal * scale);
    let [cx, cy] = [(camera.cx - corner.x) * scale, (camera.cy - corner.y) * scale];
    let close = Camera { fx, fy, cx, cy, width: side, height: side, ..camera.clone() };
    Some((share * seen.element_product(), close))
}

/// Returns a camera that looks at a box slightly from above.
fn beside(corners: &[DVec3; 8], up: DVec3, side: u32) -> Camera {
    let middle = corners.iter().sum::<DVec3>() / 8.0;
    let radius = middle.distance(corners[7]).max(1e-6);
    let away = (up.any_orthonormal_vector() + 0.35 * up).normalize();
    let focal = FOCAL_WIDTHS * f64::from(side);
    let half = f64::from(side) / 2.0;
    let camera = Camera::at_origin([focal, focal, half, half], (side, side));
    camera.placed(middle + away * radius * FRAME_FACTOR * FOCAL_WIDTHS * 2.0, -away, up)
}

/// Half the depth of the nearest corner, because the scene's near plane must not cut a separate object.
fn nearest(camera: &Camera, corners: &[DVec3; 8]) -> f32 {
    let depth = corners.iter().map(|&corner| camera.to_camera(corner).z).fold(f64::INFINITY, f64::min);
    (0.5 * depth).max(1e-3) as f32
}
