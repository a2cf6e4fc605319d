//! Blending forward and backward, of the scene and of the object layers.

use super::fixture::{BLENDS, Fixture, prove};
use crate::reference::blend::{self, Upstream, blend_backward, blend_forward, blend_layers_forward};
use crate::reference::loss::label_loss;
use crate::reference::splat::Splat;
use crate::reference::{Rules, tile};
use crate::support::compare::{Band, GradientBounds, Tolerance, close, exact};
use crate::support::device;
use crate::support::scenes::{Scene, Shape, scene};
use labelgs::pass::GroupBlend;
use labelgs::scheduler::plan::Buf;
use labelgs::verify::selftest::judge;
use labelgs::verify::selftest::order::DepthOrder;

/// Faint to opaque, so that pixels stop and alphas are clamped.
pub fn opaque_scene(seed: u64) -> Scene {
    scene(seed, &Shape { gaussians: 400, width: 61, height: 45, opacities: (-4.0, 9.0), ..Shape::default() })
}

/// A flip at the alpha cut changes a colour by 1/255; a flip at the stop of a ray changes it by 1e-4.
const CUT: Band = Band { width: 2e-5, flip: 0.01, ratio: 0.001 };
/// Sums of some 50 f32 products; 4.1e-7 seen.
const COLOUR: Tolerance = Tolerance { absolute: 6.5e-7, relative: 0.0 };

/// The splat at `last` of each pixel's tile list, +1; 0 for none.
fn last_splats(fixture: &mut Fixture) -> Vec<usize> {
    let (shape, (width, _), pixels) = (*fixture.engine.shape(), fixture.size(), fixture.pixels());
    let counters = fixture.engine.report(0).expect("a report").counters;
    let last = fixture.get::<u32>(Buf::LAST, pixels);
    let sorted = fixture.sorted_splats(counters.instance_count as usize);
    let uniforms = fixture.uniforms();
    let starts = fixture.get::<u32>(Buf::TILE_STARTS, uniforms.tile_count as usize);
    let tile_of = |pixel: usize| {
        let (x, y) = ((pixel % width) as u32, (pixel / width) as u32);
        (y / shape.tile_height * uniforms.tiles_x + x / shape.tile_width) as usize
    };
    (last.iter().enumerate())
        .map(|(pixel, &last)| match last {
            0 => 0,
            _ => sorted[(starts[tile_of(pixel)] + last - 1) as usize] as usize + 1,
        })
        .collect()
}

#[test]
fn blend_forward_of_the_scene_equals_its_mirror() {
    BLENDS.into_iter().for_each(blend_forward_of_the_scene_equals_its_mirror_of);
}

fn blend_forward_of_the_scene_equals_its_mirror_of(form: Option<GroupBlend>) {
    let Some(turn) = device() else { return };
    let mut fixture = Fixture::blending(turn, opaque_scene(51), false, form);
    fixture.train();
    let (splats, size, background) = (fixture.splats(), fixture.size(), fixture.scene.target.background);
    let image = fixture.get::<[f32; 4]>(Buf::IMAGE, size.0 * size.1);
    let last = last_splats(&mut fixture);
    let stopped = image.iter().filter(|pixel| pixel[3] < 1e-3).count();
    assert!(stopped > 100, "only {stopped} pixels are opaque");
    prove("blend_forward", &["alpha_min", "alpha_max", "transmittance_min"], |rules| {
        let expected = blend_forward(rules, &splats, size, background);
        let sure: Vec<usize> = (0..image.len()).filter(|&i| expected.pixels[i].margins.image() > CUT.width).collect();
        let (a, e): (Vec<usize>, Vec<usize>) = sure.iter().map(|&i| (last[i], expected.pixels[i].last)).unzip();
        exact(&a, &e)?;
        judge::picture(&image, &expected, (COLOUR, CUT))
    });
    // The list of a render blends the same picture.
    fixture.render();
    let rendered = fixture.get::<[f32; 4]>(Buf::IMAGE, size.0 * size.1);
    assert!(
        bytemuck::cast_slice::<_, u32>(&rendered) == bytemuck::cast_slice::<_, u32>(&image),
        "render and training agree"
    );
}

#[test]
fn main_gaussians_of_a_render_equal_the_mirror() {
    BLENDS.into_iter().for_each(main_gaussians_of_a_render_equal_the_mirror_of);
}

fn main_gaussians_of_a_render_equal_the_mirror_of(form: Option<GroupBlend>) {
    let Some(turn) = device() else { return };
    let mut fixture = Fixture::blending(turn, opaque_scene(52), false, form);
    fixture.render();
    let (splats, size, background) = (fixture.splats(), fixture.size(), fixture.scene.target.background);
    let pixels = size.0 * size.1;
    let image = fixture.get::<[f32; 4]>(Buf::IMAGE, pixels);
    let main = fixture.get::<i32>(Buf::MAIN_GAUSSIAN, pixels);
    let weight_depth = fixture.get::<[f32; 2]>(Buf::MAIN_WEIGHT_DEPTH, pixels);
    prove("blend_forward_main", &["alpha_min", "alpha_max", "transmittance_min"], |rules| {
        let expected = blend_forward(rules, &splats, size, background);
        judge::picture(&image, &expected, (COLOUR, CUT))?;
        let sure = |i: &usize| expected.pixels[*i].margins.image().min(expected.pixels[*i].margins.main) > CUT.width;
        let sure: Vec<usize> = (0..pixels).filter(sure).collect();
        assert!(sure.len() * 100 > pixels * 99, "{} of {pixels} pixels are sure", sure.len());
        let (a, e): (Vec<i32>, Vec<i32>) = sure.iter().map(|&i| (main[i], expected.pixels[i].main)).unzip();
        exact(&a, &e)?;
        let pairs = |i: &usize| [f64::from(weight_depth[*i][0]), f64::from(weight_depth[*i][1]) / 4.0];
        let mirrored = |i: &usize| [expected.pixels[*i].main_weight, expected.pixels[*i].depth / 4.0];
        let actual: Vec<f64> = sure.iter().flat_map(pairs).collect();
        close(&actual, &sure.iter().flat_map(mirrored).collect::<Vec<_>>(), COLOUR)
    });
}

/// Splats whose decisions are all farther than this from their thresholds are compared.
const MARGIN: f64 = 1e-5;

/// Sums over pixels in f32, transmittance by division; 0.27 of (1e-6, 1e-5) seen by element, 0.25 of 1e-6 as a whole.
const BOUNDS: GradientBounds = GradientBounds {
    element: Tolerance { absolute: 4e-7, relative: 4e-6 },
    outliers: 0.0,
    norm: 4e-7,
    angle: 4e-13,
    bias: 4e-7,
};

#[test]
fn blend_backward_and_gather_equal_their_mirrors() {
    BLENDS.into_iter().for_each(blend_backward_and_gather_equal_their_mirrors_of);
}

fn blend_backward_and_gather_equal_their_mirrors_of(form: Option<GroupBlend>) {
    let Some(turn) = device() else { return };
    let mut fixture = Fixture::blending(turn, opaque_scene(53), false, form);
    fixture.train();
    let (splats, size, background) = (fixture.splats(), fixture.size(), fixture.scene.target.background);
    let v_image = v_image(&mut fixture);
    let actual = fixture.splat_gradients(&splats);
    prove("blend_backward", &["alpha_min", "alpha_max", "transmittance_min"], |rules| {
        let expected = blend_backward(rules, &splats, size, background, &v_image);
        judge::splat_gradients(&actual, &expected.values, (&expected.margins, MARGIN), BOUNDS)
    });
}

/// Gradient of the photo loss by the image, as the device's loss passes left it.
fn v_image(fixture: &mut Fixture) -> Upstream {
    let pixels = fixture.pixels();
    let rows = fixture.get::<[f32; 4]>(Buf::V_IMAGE, pixels);
    Upstream::from_colours(&rows.iter().map(|&[r, g, b, _]| [r, g, b].map(f64::from)).collect::<Vec<_>>())
}

/// Gradient of every layer: the scene's from the device, the objects' from their mirror (a sign of each difference),
/// and the distance of each splat to a kink of a label loss.
fn v_layers(rules: &Rules, fixture: &Fixture, splats: &[Splat], v_scene: &Upstream) -> (Vec<Upstream>, Vec<f64>) {
    let (target, labels, size) = (&fixture.scene.target, fixture.model().labels, fixture.size());
    let layers = blend_layers_forward(rules, splats, &labels, &fixture.slots(), size, target.background);
    let mut v_layers = vec![v_scene.clone()];
    let mut kinks = vec![f64::INFINITY; size.0 * size.1];
    for (slot, layer) in target.slots.iter().zip(&layers[1..]) {
        let picture = (&layer.colours()[..], &layer.alphas()[..]);
        let loss = label_loss(rules, picture, &target.photo, &target.label_map, slot);
        kinks.iter_mut().zip(&loss.margins).for_each(|(least, margin)| *least = least.min(*margin));
        v_layers.push(loss.upstream());
    }
    (v_layers, blend::smallest_over_pixels(rules, splats, size, &kinks))
}

/// method.md check 10: one walk over all layers, and its gradient, equal the separate renders of the filtered models.
#[test]
fn object_layers_equal_filtered_renders() {
    BLENDS.into_iter().for_each(object_layers_equal_filtered_renders_of);
}

fn object_layers_equal_filtered_renders_of(form: Option<GroupBlend>) {
    let Some(turn) = device() else { return };
    let mut fixture = Fixture::blending(turn, opaque_scene(54), true, form);
    let report = fixture.train();
    assert!(report.counters.layer_tile_count > 10);
    let splats = fixture.splats();
    let v_scene = v_image(&mut fixture);
    let actual = fixture.splat_gradients(&splats);
    let (labels, slots, size, target) =
        (fixture.model().labels, fixture.slots(), fixture.size(), fixture.scene.target.clone());
    prove("object layers", &["alpha_min", "alpha_max", "label_weight", "label_alpha", "alpha_slack"], |rules| {
        let (v_layers, kinks) = v_layers(rules, &fixture, &splats, &v_scene);
        // Separate renders: each object's splats alone, over black.
        let mut expected = blend_backward(rules, &splats, size, target.background, &v_scene);
        for (slot, v_image) in slots.iter().zip(&v_layers[1..]) {
            let members: Vec<usize> = (0..splats.len()).filter(|&i| labels[splats[i].gaussian] == *slot).collect();
            let alone: Vec<Splat> = members.iter().map(|&i| splats[i]).collect();
            let layer = blend_backward(rules, &alone, size, [0.0; 3], v_image);
            for (place, &i) in members.iter().enumerate() {
                expected.values[i] = expected.values[i].plus(&layer.values[place]);
                expected.margins[i] = expected.margins[i].min(layer.margins[place]);
            }
        }
        let margins: Vec<f64> = expected.margins.iter().zip(&kinks).map(|(a, b)| a.min(*b)).collect();
        judge::splat_gradients(&actual, &expected.values, (&margins, MARGIN), BOUNDS)
    });
}

/// Boxes and tile test of the device drop no visible splat: a pixel outside of a splat's tiles has alpha below the cut.
#[test]
fn no_tile_misses_a_visible_splat() {
    let Some(turn) = device() else { return };
    let mut fixture = Fixture::new(turn, opaque_scene(55), false);
    fixture.train();
    let (splats, (width, height), shape) = (fixture.splats(), fixture.size(), *fixture.engine.shape());
    let touched = fixture.get::<u32>(Buf::TILES_TOUCHED, splats.len());
    let touched = DepthOrder::read(&mut fixture).expect("an order").sorted(&touched);
    let grid = tile::TileGrid { size: (width, height), tile: (shape.tile_width as usize, shape.tile_height as usize) };
    let rules = Rules::default();
    for (splat, &touched) in splats.iter().zip(&touched) {
        let least = tile::counted_tiles(&rules, splat, &grid).len() as u32;
        assert!(touched >= least, "{touched} tiles for a splat that counts in {least}");
    }
}
