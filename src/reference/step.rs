//! A complete training step: losses of a view and their gradients with respect to every parameter.

use super::blend::{self, BlendedImage, Upstream};
use super::loss::{self, Loss, ObjectPixel, Photo};
use super::project::{self, Projection};
use super::splat::{Splat, SplatGradient};
use super::{Model, Row, Rules};
use labelgs_scene::Camera;

/// Training target of a view.
#[derive(Clone, Debug, PartialEq)]
pub struct Target {
    /// The photo.
    pub photo: Photo,
    /// Object id per pixel, `[height, width]`.
    pub label_map: Vec<u32>,
    /// Sampled objects, each label at most once.
    pub slots: Vec<ObjectPixel>,
    /// Colour behind the scene.
    pub background: [f64; 3],
}

/// Result of a step before the optimiser.
#[derive(Clone, Debug, PartialEq)]
pub struct StepGradient {
    /// Photo loss plus label losses.
    pub value: f64,
    /// Photo loss.
    pub photo: Loss,
    /// Label loss of each slot.
    pub objects: Vec<Loss>,
    /// Gradient of `value`, `[N]`.
    pub rows: Vec<Row>,
    /// Norm of the scene's 2-D gradient, NDC units, `[N]`; 0 if not visible.
    pub gradient2d: Vec<f64>,
    /// True if the Gaussian counts somewhere in the image, `[N]`.
    pub visible: Vec<bool>,
    /// Splats, nearest first.
    pub splats: Vec<Projection>,
    /// The scene, then each slot over black.
    pub layers: Vec<BlendedImage>,
    /// Smallest margin of the decisions of all passes (without the main Gaussian, which affects no gradient).
    pub margin: f64,
    /// Smallest margin of the decisions that affect each Gaussian's gradient, `[N]`, without the order of depths.
    pub margins: Vec<f64>,
}

/// Splats of projections.
pub fn splats_of(projections: &[Projection]) -> Vec<Splat> {
    projections.iter().map(|projection| projection.splat).collect()
}

/// Forward and backward of one view.
pub fn step(rules: &Rules, camera: &Camera, model: &Model, target: &Target) -> StepGradient {
    let size = (camera.width as usize, camera.height as usize);
    let projections = project::project_all(rules, camera, model);
    let splats = splats_of(&projections);
    let labels: Vec<u32> = target.slots.iter().map(|slot| slot.label).collect();
    let layers = blend::blend_layers_forward(rules, &splats, &model.labels, &labels, size, target.background);
    let photo = loss::photo_loss(rules, &layers[0].colours(), &target.photo);
    let objects: Vec<Loss> = (target.slots.iter().zip(&layers[1..]))
        .map(|(slot, layer)| {
            let picture = (&layer.colours()[..], &layer.alphas()[..]);
            loss::label_loss(rules, picture, &target.photo, &target.label_map, slot)
        })
        .collect();
    let v_layers: Vec<Upstream> = std::iter::once(&photo).chain(&objects).map(Loss::upstream).collect();
    let (scene, of_objects) =
        blend::blend_layers_backward(rules, &splats, &model.labels, &labels, size, target.background, &v_layers);

    let mut out = StepGradient {
        value: photo.value + objects.iter().map(|loss| loss.value).sum::<f64>(),
        margin: smallest_margin(rules, camera, model, &projections, &layers).min(photo.margin()),
        margins: vec![f64::INFINITY; model.rows.len()],
        photo,
        objects,
        rows: vec![Row::default(); model.rows.len()],
        gradient2d: vec![0.0; model.rows.len()],
        visible: vec![false; model.rows.len()],
        splats: projections,
        layers,
    };
    out.margin = out.objects.iter().fold(out.margin, |least, loss| least.min(loss.margin()));
    let kinks = kinks(rules, &splats, size, &out);
    for (place, splat) in splats.iter().enumerate() {
        let total = scene.values[place].plus(&of_objects.values[place]);
        out.rows[splat.gaussian] = project::project_backward(rules, camera, model, splat.gaussian, &total);
        out.gradient2d[splat.gaussian] = ndc_norm(&scene.values[place], size);
        out.visible[splat.gaussian] = true;
        let of_projection = out.splats[place].clamp_margin.min(out.splats[place].colour_margin);
        let of_blend = scene.margins[place].min(of_objects.margins[place]);
        out.margins[splat.gaussian] = kinks[place].min(of_projection).min(of_blend);
    }
    out
}

/// For each splat, the distance of the pixels under it to the kink of a loss.
fn kinks(rules: &Rules, splats: &[Splat], size: (usize, usize), out: &StepGradient) -> Vec<f64> {
    let mut margins = out.photo.margins.clone();
    for loss in &out.objects {
        margins.iter_mut().zip(&loss.margins).for_each(|(least, margin)| *least = least.min(*margin));
    }
    blend::smallest_over_pixels(rules, splats, size, &margins)
}

/// Norm of a 2-D mean gradient in NDC units (the image has width 2 and height 2).
pub fn ndc_norm(v: &SplatGradient, size: (usize, usize)) -> f64 {
    (v.mean2d[0] * 0.5 * size.0 as f64).hypot(v.mean2d[1] * 0.5 * size.1 as f64)
}

fn smallest_margin(
    rules: &Rules,
    camera: &Camera,
    model: &Model,
    projections: &[Projection],
    layers: &[BlendedImage],
) -> f64 {
    let near = model.rows.iter().map(|row| project::near_margin(rules, camera, row).abs());
    let clamps = projections.iter().map(|p| p.clamp_margin.min(p.colour_margin));
    let pixels = layers.iter().flat_map(|layer| layer.pixels.iter().map(|pixel| pixel.margins.gradient()));
    let depths: Vec<f64> = projections.iter().map(|p| p.splat.depth).collect();
    let order = super::sort::depth_margin(&depths);
    near.chain(clamps).chain(pixels).fold(order, f64::min)
}
