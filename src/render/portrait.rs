//! Small pictures of single labels: each alone, from the view that shows it best.

use super::{Parts, RenderOptions, render};
use crate::edit::select::{MIN_LABEL_CONFIDENCE, extract};
use crate::engine::Engine;
use crate::error::Result;
use crate::scene::colour::to_byte;
use crate::scene::spread::quantiles;
use crate::scene::{Camera, Gaussians};
use glam::{DVec2, DVec3};

/// Shares of an object's Gaussians, in each direction, between which it is in the picture: single ones may be anywhere.
const BOX_QUANTILES: [f64; 2] = [0.02, 0.98];
/// Width of the picture around an object, in widths of the object.
const FRAME_FACTOR: f64 = 1.25;
/// Focal length where no camera gives a view, in widths of the picture.
const FOCAL_WIDTHS: f64 = 1.4;

/// Renders a label alone into a square of `side` px, as r, g, b and opacity, from the camera that shows it largest and whole;
/// `up` is the way up where there is no camera. The model of `engine` is replaced. A label that does not occur is an error.
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

/// Returns the camera that shows a model largest and whole, if one has it before it.
pub(crate) fn best_camera<'a>(model: &Gaussians, cameras: &[&'a Camera]) -> Option<&'a Camera> {
    best(cameras, &corners(model), 1).map(|(camera, _)| camera)
}

/// Returns the camera that shows what is between corners largest and whole, and the camera of a square around it.
fn best<'a>(cameras: &[&'a Camera], corners: &[DVec3; 8], side: u32) -> Option<(&'a Camera, Camera)> {
    let seen = cameras.iter().filter_map(|&camera| Some((camera, closer(camera, corners, side)?)));
    let best = seen.max_by(|a, b| a.1.0.total_cmp(&b.1.0));
    best.map(|(camera, (_, close))| (camera, close))
}

/// The corners of a box around most Gaussians, in the world.
fn corners(part: &Gaussians) -> [DVec3; 8] {
    let ends = quantiles((0..part.len()).map(|row| part.world(row)), BOX_QUANTILES);
    std::array::from_fn(|corner| DVec3::from_array([0, 1, 2].map(|axis| ends[corner >> axis & 1][axis])))
}

/// Returns how large a camera shows what is between corners, px squared, and the camera of a square around it. `None` for what is
/// behind it.
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
    // Half in the picture counts a quarter.
    let share = seen.element_product() / whole.element_product();
    let width = FRAME_FACTOR * whole.max_element().max(1.0);
    let corner = 0.5 * (low + high) - 0.5 * width;
    let scale = f64::from(side) / width;
    let [fx, fy] = [camera.fx, camera.fy].map(|focal| focal * scale);
    let [cx, cy] = [(camera.cx - corner.x) * scale, (camera.cy - corner.y) * scale];
    let close = Camera { fx, fy, cx, cy, width: side, height: side, ..camera.clone() };
    Some((share * seen.element_product(), close))
}

/// The camera that looks at a box a little from above.
fn beside(corners: &[DVec3; 8], up: DVec3, side: u32) -> Camera {
    let middle = corners.iter().sum::<DVec3>() / 8.0;
    let radius = middle.distance(corners[7]).max(1e-6);
    let away = (up.any_orthonormal_vector() + 0.35 * up).normalize();
    let focal = FOCAL_WIDTHS * f64::from(side);
    let half = f64::from(side) / 2.0;
    let camera = Camera::at_origin([focal, focal, half, half], (side, side));
    camera.placed(middle + away * radius * FRAME_FACTOR * FOCAL_WIDTHS * 2.0, -away, up)
}

/// Half the depth of the nearest corner: an object that stands alone is not cut by the near plane of its scene.
fn nearest(camera: &Camera, corners: &[DVec3; 8]) -> f32 {
    let depth = corners.iter().map(|&corner| camera.to_camera(corner).z).fold(f64::INFINITY, f64::min);
    (0.5 * depth).max(1e-3) as f32
}
