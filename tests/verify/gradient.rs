//! The analytic gradients of the mirrors against central differences in f64.
//!
//! A difference is meaningful only if every decision is farther from its threshold than the step can move it. Seeds are
//! chosen so that this holds, and the tests refuse other scenes.

use crate::reference::blend::{Upstream, blend_backward, blend_forward, centre, trace};
use crate::reference::disagreement::{depth_error, disagreement};
use crate::reference::loss::{label_loss, photo_loss};
use crate::reference::model::ROW_FLOATS;
use crate::reference::project::{project_backward, project_forward};
use crate::reference::splat::{Splat, SplatGradient};
use crate::reference::step::{splats_of, step};
use crate::reference::{Model, Row, Rules, project, sh};
use crate::support::compare::{Tolerance, check, close};
use crate::support::scenes::{Scene, Shape, generator, scene, uniform};
use glam::DVec3;

/// Step of the differences.
const STEP: f64 = 2e-6;
/// Decisions nearer than this (relative) could flip within a step.
const SAFE: f64 = 5e-5;

/// Central difference of `value` by each of `parameters`.
pub fn differences(parameters: &[f64], mut value: impl FnMut(&[f64]) -> f64) -> Vec<f64> {
    let mut moved = parameters.to_vec();
    (0..parameters.len())
        .map(|i| {
            let mut at = |offset: f64| {
                moved[i] = parameters[i] + offset;
                value(&moved)
            };
            let slope = (at(STEP) - at(-STEP)) / (2.0 * STEP);
            moved[i] = parameters[i];
            slope
        })
        .collect()
}

/// 1e-6 of the largest element, and of each element.
pub fn agree(name: &str, analytic: &[f64], numeric: &[f64]) {
    let largest = numeric.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
    assert!(largest > 0.0, "{name}: nothing to compare");
    check(name, close(analytic, numeric, Tolerance { absolute: 1e-6 * largest, relative: 1e-6 }));
}

fn small() -> Shape {
    Shape { gaussians: 9, width: 22, height: 18, objects: 2, sh_degree: 3, scales: (0.08, 0.5), ..Shape::default() }
}

/// The first scene of a seed range in which no decision is near its threshold.
fn safe_scene(rules: &Rules, first: u64, shape: &Shape) -> Scene {
    (first..first + 400)
        .map(|seed| scene(seed, shape))
        .find(|s| step(rules, &s.camera, &s.model(), &s.target).margin > SAFE)
        .expect("one seed in 400 keeps clear of all thresholds")
}

#[test]
fn sh_colour_gradient_equals_central_differences() {
    let rules = Rules::default();
    let model = scene(1, &Shape { gaussians: 6, ..small() }).model();
    let (centre, weights) = (DVec3::new(0.3, -0.2, -4.0), [0.7, -1.1, 0.4]);
    for row in &model.rows {
        let mean = DVec3::from(row.mean);
        let (v_sh, v_mean) = sh::sh_backward(&rules, 3, &row.sh, (mean, centre), weights);
        let analytic: Vec<f64> = v_sh.as_flattened().iter().copied().chain(v_mean.to_array()).collect();
        let mut parameters = row.sh.as_flattened().to_vec();
        parameters.extend(row.mean);
        let numeric = differences(&parameters, |p| {
            let mut sh = [[0.0; 3]; 16];
            sh.as_flattened_mut().copy_from_slice(&p[..48]);
            let rgb = sh::sh_forward(&rules, 3, &sh, DVec3::from_slice(&p[48..]), centre).rgb;
            rgb.iter().zip(weights).map(|(c, w)| c * w).sum()
        });
        agree("sh", &analytic, &numeric);
    }
}

fn splat_floats(s: &Splat) -> [f64; 9] {
    let ([x, y], [a, b, c], [r, g, l]) = (s.mean2d, s.conic, s.colour);
    [x, y, a, b, c, s.opacity, r, g, l]
}

fn gradient_floats(v: &SplatGradient) -> [f64; 9] {
    let s = Splat { mean2d: v.mean2d, conic: v.conic, opacity: v.opacity, colour: v.colour, ..Splat::default() };
    splat_floats(&s)
}

/// Wide scenes put some centres far outside the image, where the Jacobian is clamped.
fn project_case(rules: &Rules, row: &Row, camera: &labelgs::scene::Camera) {
    let model = |row: Row| Model { rows: vec![row], labels: vec![0], sh_degree: 3 };
    let weights =
        SplatGradient { mean2d: [0.3, -0.8], conic: [0.9, -1.7, 0.6], opacity: 1.3, colour: [0.2, -0.5, 0.9] };
    let analytic = project_backward(rules, camera, &model(*row), 0, &weights).floats();
    let numeric = differences(&row.floats(), |p| {
        let row = Row::from_floats(p.try_into().expect("a row has 59 floats"));
        let splat = project_forward(rules, camera, &model(row), 0).expect("in front of the camera").splat;
        splat_floats(&splat).iter().zip(gradient_floats(&weights)).map(|(s, w)| s * w).sum()
    });
    agree("project", &analytic, &numeric);
    let along: f64 = row.quat.iter().zip(&analytic[3..7]).map(|(q, v)| q * v).sum();
    assert!(along.abs() < 1e-10, "the quaternion's gradient is orthogonal to it, not {along}");
}

#[test]
fn projection_gradient_equals_central_differences() {
    projection_cases(&Rules::default(), small());
}

/// Some Gaussians are smaller than the dilation.
#[test]
fn antialiased_projection_gradient_equals_central_differences() {
    let rules = Rules { antialiased: true, ..Rules::default() };
    projection_cases(&rules, Shape { scales: (0.01, 0.3), ..small() });
}

fn projection_cases(rules: &Rules, shape: Shape) {
    let s = scene(2, &Shape { gaussians: 30, ..shape });
    let mut clamped = 0;
    for mut row in s.model().rows {
        project_case(rules, &row, &s.camera);
        row.mean[0] *= 3.0;
        row.mean[1] *= 3.0;
        let p = s.camera.to_camera(DVec3::from(row.mean));
        let model = Model { rows: vec![row], labels: vec![0], sh_degree: 3 };
        let margin = project_forward(rules, &s.camera, &model, 0).map_or(0.0, |p| p.clamp_margin);
        if p.z > 0.5 && margin > SAFE {
            clamped += usize::from((p.x / p.z).abs() > 0.8 || (p.y / p.z).abs() > 0.8);
            project_case(rules, &row, &s.camera);
        }
    }
    assert!(clamped > 5, "only {clamped} rows reach the clamp");
}

/// Opaque splats: alpha is clamped and rays end early.
fn opaque() -> Shape {
    Shape { scales: (0.6, 2.0), opacities: (7.0, 12.0), ..small() }
}

/// Two clamped splats leave a transmittance of 1e-4 up to rounding, exactly the default threshold, so use another one.
fn opaque_rules() -> Rules {
    Rules { transmittance_min: 3e-4, ..Rules::default() }
}

#[test]
fn blend_gradient_equals_central_differences() {
    let rules = Rules::default();
    blend_case(&rules, &safe_scene(&rules, 100, &small()));
}

#[test]
fn disagreement_gradient_equals_central_differences() {
    let rules = Rules::default();
    let s = safe_scene(&rules, 200, &small());
    let (size, labels) = ((s.camera.width as usize, s.camera.height as usize), s.model().labels);
    let splats = splats_of(&project::project_all(&rules, &s.camera, &s.model()));
    let pixels: Vec<Option<(u32, f64)>> = (s.target.label_map.iter().enumerate())
        .map(|(at, &label)| (at % 7 != 0).then_some((label, 1.0 + (at % 3) as f64)))
        .collect();
    let of = |splats: &[Splat]| disagreement(&rules, splats, &labels, size, &pixels);
    let opacities: Vec<f64> = splats.iter().map(|splat| splat.opacity).collect();
    let numeric = differences(&opacities, |moved| {
        let moved: Vec<Splat> = splats.iter().zip(moved).map(|(s, &opacity)| Splat { opacity, ..*s }).collect();
        of(&moved).value
    });
    agree("disagreement", &of(&splats).v_opacities, &numeric);
}

#[test]
fn gradient_of_depth_errors_equals_central_differences() {
    let rules = Rules::default();
    let s = safe_scene(&rules, 200, &small());
    let size = (s.camera.width as usize, s.camera.height as usize);
    let splats = splats_of(&project::project_all(&rules, &s.camera, &s.model()));
    // Before and behind, and some unknown.
    let inverse: Vec<f64> = (0..size.0 * size.1).map(|at| [0.0, 0.2, 0.3, 1.0][at % 4]).collect();
    let of = |splats: &[Splat]| depth_error(&rules, splats, size, &inverse, 1.7);
    let opacities: Vec<f64> = splats.iter().map(|splat| splat.opacity).collect();
    let numeric = differences(&opacities, |moved| {
        let moved: Vec<Splat> = splats.iter().zip(moved).map(|(s, &opacity)| Splat { opacity, ..*s }).collect();
        of(&moved).value
    });
    agree("depth errors", &of(&splats).v_opacities, &numeric);
}

#[test]
fn blend_gradient_is_right_where_alpha_clamps_and_rays_stop() {
    let rules = opaque_rules();
    let s = safe_scene(&rules, 5000, &opaque());
    let splats = splats_of(&project::project_all(&rules, &s.camera, &s.model()));
    let at = |index: usize| centre(index, s.camera.width as usize);
    let rays: Vec<_> = (0..22 * 18).map(|i| trace(&rules, splats.iter().enumerate(), at(i))).collect();
    let clamped = rays.iter().flat_map(|ray| &ray.contributions).filter(|c| c.clamped).count();
    let stopped = rays.iter().filter(|ray| ray.stopped).count();
    assert!(clamped > 10 && stopped > 30, "{clamped} clamped pairs, {stopped} stopped rays");
    blend_case(&rules, &s);
}

fn blend_case(rules: &Rules, s: &Scene) {
    let splats = splats_of(&project::project_all(rules, &s.camera, &s.model()));
    let size = (s.camera.width as usize, s.camera.height as usize);
    let mut random = generator(7);
    let mut pixels = |_| [0; 3].map(|_| uniform(&mut random, -1.0, 1.0));
    let colours: Vec<[f64; 3]> = (0..size.0 * size.1).map(&mut pixels).collect();
    let alphas: Vec<f64> = (0..size.0 * size.1).map(|i| pixels(i)[0]).collect();
    let v_image = Upstream { colours, alphas };
    let v = blend_backward(rules, &splats, size, s.target.background, &v_image);
    let analytic: Vec<f64> = v.values.iter().flat_map(gradient_floats).collect();
    let parameters: Vec<f64> = splats.iter().flat_map(splat_floats).collect();
    let numeric = differences(&parameters, |p| {
        let moved: Vec<Splat> = (splats.iter().zip(p.chunks_exact(9)))
            .map(|(s, p)| Splat {
                mean2d: [p[0], p[1]],
                conic: [p[2], p[3], p[4]],
                opacity: p[5],
                colour: [p[6], p[7], p[8]],
                ..*s
            })
            .collect();
        let image = blend_forward(rules, &moved, size, s.target.background);
        let (colours, alphas) = (image.colours(), image.alphas());
        let of_colours = colours.as_flattened().iter().zip(v_image.colours.as_flattened()).map(|(c, w)| c * w);
        of_colours.chain(alphas.iter().zip(&v_image.alphas).map(|(a, w)| a * w)).sum()
    });
    agree("blend", &analytic, &numeric);
}

#[test]
fn loss_gradients_equal_central_differences() {
    let (rules, s) = (Rules::default(), scene(4, &small()));
    let mut random = generator(8);
    let image: Vec<[f64; 3]> =
        s.target.photo.colours.iter().map(|c| c.map(|v| v + uniform(&mut random, 0.01, 0.3))).collect();
    let colours = |p: &[f64]| -> Vec<[f64; 3]> { p.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect() };
    let photo = photo_loss(&rules, &image, &s.target.photo);
    let numeric = differences(image.as_flattened(), |p| photo_loss(&rules, &colours(p), &s.target.photo).value);
    agree("photo loss", photo.v_image.as_flattened(), &numeric);
    for slot in &s.target.slots {
        let alphas: Vec<f64> = image.iter().map(|_| uniform(&mut random, 0.1, 0.9)).collect();
        let loss = |image: &[[f64; 3]], alphas: &[f64]| {
            label_loss(&rules, (image, alphas), &s.target.photo, &s.target.label_map, slot)
        };
        let numeric = differences(image.as_flattened(), |p| loss(&colours(p), &alphas).value);
        agree("label loss", loss(&image, &alphas).v_image.as_flattened(), &numeric);
        let numeric = differences(&alphas, |p| loss(&image, p).value);
        agree("label loss by alpha", &loss(&image, &alphas).v_alpha, &numeric);
    }
}

fn step_case(rules: &Rules, first: u64, shape: &Shape) {
    let s = safe_scene(rules, first, shape);
    let model = s.model();
    let analytic: Vec<f64> = step(rules, &s.camera, &model, &s.target).rows.iter().flat_map(Row::floats).collect();
    let parameters: Vec<f64> = model.rows.iter().flat_map(Row::floats).collect();
    let numeric = differences(&parameters, |p| {
        let rows = p.as_chunks::<ROW_FLOATS>().0.iter().map(Row::from_floats).collect();
        step(rules, &s.camera, &Model { rows, ..model.clone() }, &s.target).value
    });
    agree("step", &analytic, &numeric);
}

#[test]
fn step_gradient_equals_central_differences() {
    step_case(&Rules::default(), 1000, &small());
}

#[test]
fn step_gradient_of_degree_0_equals_central_differences() {
    step_case(&Rules::default(), 2000, &Shape { sh_degree: 0, ..small() });
}

#[test]
fn step_gradient_of_opaque_gaussians_equals_central_differences() {
    step_case(&opaque_rules(), 3000, &Shape { gaussians: 6, ..opaque() });
}
