//! Small seeded scenes. Every number is an f32, so that the f32 engine and the f64 reference start with equal values.

use crate::reference::densify::Population;
use crate::reference::loss::{ObjectPixel, Photo};
use crate::reference::step::Target;
use crate::reference::{Model, Row};
use crate::scene::{Camera, Gaussians};
use glam::{DMat3, DVec3};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg32;

/// Size and contents of a random scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shape {
    /// Gaussians.
    pub gaussians: usize,
    /// Image width, px.
    pub width: u32,
    /// Image height, px.
    pub height: u32,
    /// Objects; Gaussians carry the labels 0 to `objects`.
    pub objects: u32,
    /// Degree of the spherical harmonics.
    pub sh_degree: u32,
    /// Standard deviations, smallest and largest, world units (the camera looks from about 4).
    pub scales: (f64, f64),
    /// Opacity logits, smallest and largest.
    pub opacities: (f64, f64),
}

impl Default for Shape {
    fn default() -> Self {
        Self {
            gaussians: 40,
            width: 48,
            height: 40,
            objects: 3,
            sh_degree: 3,
            scales: (0.05, 0.5),
            opacities: (-3.0, 5.0),
        }
    }
}

/// A camera, Gaussians and a training target.
#[derive(Clone, Debug)]
pub struct Scene {
    /// The camera.
    pub camera: Camera,
    /// The Gaussians in f32.
    pub gaussians: Gaussians,
    /// Photo, masks and sampled objects.
    pub target: Target,
    /// Number of Gaussians at the end that are not trained.
    pub frozen: u32,
}

impl Scene {
    /// The Gaussians as the reference's model.
    pub fn model(&self) -> Model {
        Model::from_gaussians(&self.gaussians)
    }
}

/// Rounds to the nearest f32.
pub fn round(value: f64) -> f64 {
    f64::from(value as f32)
}

/// Draws a number from [low, high), rounded to f32.
pub fn uniform(random: &mut Pcg32, low: f64, high: f64) -> f64 {
    round(random.random_range(low..high))
}

/// Random number generator for a seed.
pub fn generator(seed: u64) -> Pcg32 {
    Pcg32::seed_from_u64(seed)
}

/// A camera about 4 units from the origin that looks at it, with an off-centre principal point.
pub fn camera(random: &mut Pcg32, width: u32, height: u32) -> Camera {
    let mut near = |spread: f64| uniform(random, -spread, spread);
    let eye = DVec3::new(near(0.6), near(0.6), -4.0 + near(0.3));
    let forward = (DVec3::new(near(0.1), near(0.1), near(0.1)) - eye).normalize();
    let right = DVec3::new(near(0.1), 1.0, near(0.1)).cross(forward).normalize();
    let rotation = DMat3::from_cols(right, forward.cross(right), forward).transpose();
    let translation = -(rotation * eye);
    let focal = f64::from(width) * (1.1 + near(0.2));
    Camera {
        rotation: DMat3::from_cols_array(&rotation.to_cols_array().map(round)),
        translation: DVec3::from_array(translation.to_array().map(round)),
        fx: round(focal),
        fy: round(focal * (1.0 + near(0.05))),
        cx: round(f64::from(width) * (0.5 + near(0.06))),
        cy: round(f64::from(height) * (0.5 + near(0.06))),
        width,
        height,
    }
}

/// Gaussians in a ball of radius about 1.5 around the origin.
pub fn gaussians(random: &mut Pcg32, shape: &Shape) -> Gaussians {
    let mut out = Gaussians { sh_degree: shape.sh_degree, ..Gaussians::default() };
    let mut labels = Vec::new();
    let (small, large) = (shape.scales.0.ln(), shape.scales.1.ln());
    for _ in 0..shape.gaussians {
        let mut draw = |low: f64, high: f64| random.random_range(low..high) as f32;
        out.means.push([draw(-1.5, 1.5), draw(-1.3, 1.3), draw(-1.3, 1.3)]);
        let turn = [draw(-1.0, 1.0), draw(-1.0, 1.0), draw(-1.0, 1.0), draw(-1.0, 1.0)];
        out.quats.push(if turn.iter().map(|v| v * v).sum::<f32>() > 0.01 { turn } else { [1.0, 0.0, 0.0, 0.0] });
        out.scales.push([0; 3].map(|_| draw(small, large)));
        out.opacities.push(draw(shape.opacities.0, shape.opacities.1));
        out.sh0.push([0; 3].map(|_| draw(-0.8, 1.6)));
        (0..out.rest_per_gaussian()).for_each(|_| out.sh_rest.push([0; 3].map(|_| draw(-0.25, 0.25))));
        labels.push(random.random_range(0..=shape.objects));
    }
    out.labels = Some(labels);
    out
}

/// A photo of smooth noise with a strip of invalid pixels, rectangular masks, and occluders.
pub fn target(random: &mut Pcg32, shape: &Shape) -> Target {
    let (width, height) = (shape.width as usize, shape.height as usize);
    let waves = [0; 9].map(|_| uniform(random, 0.1, 0.6));
    let mut colours = Vec::new();
    for index in 0..width * height {
        let (x, y) = ((index % width) as f64, (index / width) as f64);
        let channel = |c: usize| 0.5 + 0.35 * (waves[3 * c] * x + waves[3 * c + 1] * y + 6.0 * waves[3 * c + 2]).sin();
        let noise = uniform(random, -0.1, 0.1);
        // Similar to an 8-bit photo, but never exactly the value that f32 division gives in a flat area.
        colours.push([0, 1, 2].map(|c| round(((channel(c) + noise).clamp(0.0, 1.0) * 255.0).round() / 255.0)));
    }
    let mut label_map = vec![0_u32; width * height];
    for label in 1..=shape.objects {
        // From a quarter to half of the picture, at least one pixel.
        let mut start = |size: usize| random.random_range(0..(size / 2).max(1));
        let (x0, y0) = (start(width), start(height));
        let mut length = |size: usize| random.random_range(size / 4..(size / 2).max(size / 4 + 1)).max(1);
        let (w, h) = (length(width), length(height));
        (y0..y0 + h).for_each(|y| label_map[y * width + x0..y * width + x0 + w].fill(label));
    }
    let valid = (0..width * height).map(|index| index % width >= width / 12 || index / width >= height / 3).collect();
    let slots = (1..=shape.objects)
        .map(|label| ObjectPixel {
            label,
            occluders: match label % 4 {
                1 => Vec::new(),
                // Unlabelled areas hide the object.
                3 => vec![0],
                _ => vec![label - 1],
            },
            weight: 1.0,
        })
        .collect();
    let background = [0; 3].map(|_| uniform(random, 0.0, 1.0));
    Target { photo: Photo { size: (width, height), colours, valid }, label_map, slots, background }
}

/// Makes the scene of a seed.
pub fn scene(seed: u64, shape: &Shape) -> Scene {
    let mut random = generator(seed);
    let camera = camera(&mut random, shape.width, shape.height);
    let gaussians = gaussians(&mut random, shape);
    let target = target(&mut random, shape);
    Scene { camera, gaussians, target, frozen: 0 }
}

/// A camera at the origin that looks along z: focal length 100 px, principal point at the centre.
pub fn plain_camera(width: u32, height: u32) -> Camera {
    Camera {
        rotation: DMat3::IDENTITY,
        translation: DVec3::ZERO,
        fx: 100.0,
        fy: 100.0,
        cx: f64::from(width) / 2.0,
        cy: f64::from(height) / 2.0,
        width,
        height,
    }
}

/// A round grey Gaussian for `plain_camera`, given its centre in px, depth, deviation in px, and opacity.
pub fn dot(camera: &Camera, at: [f64; 2], depth: f64, deviation: f64, opacity: f64) -> Row {
    let scale = (deviation * depth / camera.fx).ln();
    Row {
        mean: [(at[0] - camera.cx) * depth / camera.fx, (at[1] - camera.cy) * depth / camera.fy, depth],
        quat: [1.0, 0.0, 0.0, 0.0],
        scale: [scale; 3],
        opacity: (opacity / (1.0 - opacity)).ln(),
        sh: [[0.0; 3]; 16],
    }
}

/// Rows for densification in a scene of extent 1: some below and some above each threshold, all labelled; the last
/// tenth is frozen.
pub fn population(seed: u64, count: usize) -> Population {
    let mut random = generator(seed);
    let shape = Shape { gaussians: count, scales: (0.002, 0.4), opacities: (-7.0, 3.0), ..Shape::default() };
    let mut moments = |low: f64, high: f64| -> Vec<Row> {
        (0..count).map(|_| Row::from_floats(&std::array::from_fn(|_| uniform(&mut random, low, high)))).collect()
    };
    let (m, u) = (moments(-1.0, 1.0), moments(0.0, 1.0));
    let gradient_count: Vec<f64> = (0..count).map(|_| f64::from(random.random_range(0..6))).collect();
    let mut sum = |views: &f64| round(views * uniform(&mut random, 5e-5_f64.ln(), 1e-3_f64.ln()).exp());
    let gradient_sum = gradient_count.iter().map(&mut sum).collect();
    // Some Gaussians are marked for removal.
    let gradient_count =
        gradient_count.iter().enumerate().map(|(row, &n)| if row % 23 == 7 { 1e9 } else { n }).collect();
    let model = Model::from_gaussians(&gaussians(&mut random, &shape));
    Population { model, m, u, gradient_sum, gradient_count, frozen: count / 10 }
}

/// A scene for a population; its picture does not matter.
pub fn scene_of(population: &Population) -> Scene {
    let template = scene(1, &Shape { gaussians: 1, ..Shape::default() });
    Scene { gaussians: population.model.gaussians(), frozen: population.frozen as u32, ..template }
}
