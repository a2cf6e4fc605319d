//! The scenes: two sizes with the statistics of a trained scene, and five that are numerically difficult.

use glam::{DMat3, DVec3};
use labelgs::reference::loss::Photo;
use labelgs::reference::step::Target;
use labelgs::scene::{Camera, Gaussians};
use labelgs::verify::selftest::scenes::{Scene, generator, round, uniform};
use rand::Rng;
use rand_pcg::Pcg32;

/// Size and repetitions of a scene.
#[derive(Clone, Copy, Debug)]
pub struct Plan {
    /// Name in tables: S1, S2, A1 to A5.
    pub name: &'static str,
    /// Description.
    pub about: &'static str,
    /// Gaussians.
    pub gaussians: usize,
    /// Image size, px.
    pub size: (u32, u32),
    /// Timed rounds over all modes.
    pub rounds: usize,
    /// Content.
    pub kind: Kind,
}

/// Content of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Four wavy sheets of mostly small splats, most of them faint.
    Trained,
    /// Axes that differ by 1e4.
    Needles,
    /// Layers of alpha 0.01 over the whole image.
    Faint,
    /// Opacities near the clamp of alpha.
    Opaque,
    /// Groups of sixteen Gaussians with equal depths.
    Ties,
    /// As trained, 1e4 units from the origin.
    Far,
}

/// The scenes of a run.
pub fn plans(small: bool) -> Vec<Plan> {
    let plan = |name, about, gaussians, size, rounds, kind| {
        let size = if small { (64, 48) } else { size };
        let rounds = if small { 2 } else { rounds };
        Plan { name, about, gaussians, size, rounds, kind }
    };
    let count = |full: usize, small_count: usize| if small { small_count } else { full };
    let small_picture = (128, 96);
    let mut plans = vec![plan("S1", "as trained, small", count(20_000, 300), (256, 192), 30, Kind::Trained)];
    if !small {
        plans.push(plan("S2", "as trained, medium", 200_000, (640, 480), 10, Kind::Trained));
    }
    plans.extend([
        plan("A1", "needles, axes 1e4 : 1", count(1_000, 100), small_picture, 5, Kind::Needles),
        plan("A2", "layers of alpha 0.01", count(2_000, 400), (64, 48), 5, Kind::Faint),
        plan("A3", "alpha near its clamp", count(1_000, 200), small_picture, 5, Kind::Opaque),
        plan("A4", "ties of depth", count(4_000, 320), small_picture, 5, Kind::Ties),
        plan("A5", "1e4 units from the origin", count(4_000, 200), small_picture, 5, Kind::Far),
    ]);
    plans
}

/// Builds the scene of a plan, without a photo.
pub fn build(plan: &Plan) -> Scene {
    let mut random = generator(1000 + plan.name.bytes().map(u64::from).sum::<u64>());
    // f32 numbers, so that engine and mirror see the same camera.
    let eye = if plan.kind == Kind::Far { DVec3::new(6000.0, -3000.0, 7000.0) } else { DVec3::ZERO };
    let camera = camera(plan.size, eye);
    let mut gaussians = Gaussians { sh_degree: 3, labels: Some(vec![0; plan.gaussians]), ..Gaussians::default() };
    for index in 0..plan.gaussians {
        let one = draw(&mut random, plan.kind, index, plan.gaussians);
        push(&mut gaussians, &mut random, &camera, eye, &one);
    }
    let (width, height) = (plan.size.0 as usize, plan.size.1 as usize);
    let photo =
        Photo { size: (width, height), colours: vec![[0.0; 3]; width * height], valid: vec![true; width * height] };
    let background = [0.2, 0.4, 0.6].map(round);
    let target = Target { photo, label_map: vec![0; width * height], slots: Vec::new(), background };
    Scene { camera, gaussians, target, frozen: 0 }
}

/// Gives a scene a photo that differs from its render by 0.3 or more in every channel, so that no kink of the L1 loss
/// is near and errors of gradients are the kernels'. Values are multiples of 1/255.
pub fn set_photo(scene: &mut Scene, picture: &[[f64; 3]]) {
    let away = |value: f64| {
        let value = if value > 0.5 { value.min(1.0) - 0.35 } else { value + 0.35 };
        round((value.clamp(0.0, 1.0) * 255.0).round() / 255.0)
    };
    scene.target.photo.colours = picture.iter().map(|colour| colour.map(away)).collect();
}

fn camera((width, height): (u32, u32), eye: DVec3) -> Camera {
    let focal = f64::from(width) * 0.9;
    Camera {
        rotation: DMat3::IDENTITY,
        translation: -eye,
        fx: round(focal),
        fy: round(focal),
        cx: f64::from(width) * 0.5,
        cy: f64::from(height) * 0.5,
        width,
        height,
    }
}

/// A Gaussian in image space.
struct ImageGaussian {
    /// Position as a share of the image's width and height, extending slightly beyond it.
    at: [f64; 2],
    /// Depth, world units.
    depth: f64,
    /// Standard deviations, px at that depth.
    deviations: [f64; 3],
    /// Opacity.
    opacity: f64,
}

fn draw(random: &mut Pcg32, kind: Kind, index: usize, count: usize) -> ImageGaussian {
    let at = [0; 2].map(|_| uniform(random, -0.05, 1.05));
    let turn = [0; 3].map(|_| uniform(random, 0.1, 1.0));
    match kind {
        Kind::Trained | Kind::Far => trained(random, at),
        Kind::Needles => {
            let long = 10.0 * normal(random).mul_add(0.5, 0.7).exp();
            ImageGaussian {
                at,
                depth: uniform(random, 2.0, 9.0),
                deviations: [long, long * 1e-4, long * 1e-4],
                opacity: 0.9,
            }
        }
        Kind::Faint => {
            // Sizes and positions differ, so that splats have different errors.
            let deviations = turn.map(|share| 60.0 + 60.0 * share);
            let depth = 2.0 + 8.0 * (index as f64 + 0.5) / count as f64;
            ImageGaussian { at: at.map(|v| 0.3 + 0.4 * v), depth, deviations, opacity: 0.0101 }
        }
        Kind::Opaque => {
            let opacity = 1.0 - 10.0_f64.powf(uniform(random, -4.0, -1.3));
            ImageGaussian { at, depth: uniform(random, 2.0, 9.0), deviations: turn.map(|share| 8.0 * share), opacity }
        }
        Kind::Ties => {
            let depths = (count / 16).max(1);
            let depth = round(2.0 + 8.0 * (index % depths) as f64 / depths as f64);
            ImageGaussian { at, depth, deviations: turn.map(|share| 5.0 * share), opacity: uniform(random, 0.1, 0.9) }
        }
    }
}

/// Median width 2.5 px with a tail to about 25 px, flattened along one axis; opacities from faint to opaque with a
/// median of 0.6, so that most pixels are opaque and hide what is behind; on one of four wavy sheets.
fn trained(random: &mut Pcg32, at: [f64; 2]) -> ImageGaussian {
    let width = 2.5 * (0.7 * normal(random)).exp();
    let flat = uniform(random, 0.05, 0.6);
    let second = uniform(random, 0.4, 1.0);
    let sheet = [0.45, 0.25, 0.2, 0.1].iter().scan(uniform(random, 0.0, 1.0), |left, share| {
        *left -= share;
        Some(*left)
    });
    let sheet = sheet.take_while(|left| *left > 0.0).count().min(3) as f64;
    let wave = (7.0 * at[0] + 1.3 * sheet).sin() * (5.0 * at[1] - 0.7 * sheet).cos();
    let depth = (2.0 + 2.5 * sheet + 0.6 * wave) * (1.0 + 0.01 * normal(random));
    let logit = (2.2 * normal(random) + 0.4).clamp(-5.3, 7.0);
    ImageGaussian {
        at,
        depth,
        deviations: [width, width * second, width * flat],
        opacity: 1.0 / (1.0 + (-logit).exp()),
    }
}

fn push(out: &mut Gaussians, random: &mut Pcg32, camera: &Camera, eye: DVec3, one: &ImageGaussian) {
    let x = (one.at[0] * f64::from(camera.width) - camera.cx) * one.depth / camera.fx;
    let y = (one.at[1] * f64::from(camera.height) - camera.cy) * one.depth / camera.fy;
    out.means.push([x + eye.x, y + eye.y, one.depth + eye.z].map(|v| v as f32));
    let turn = [0; 4].map(|_| normal(random) as f32);
    out.quats.push(if turn.iter().map(|v| v * v).sum::<f32>() > 0.01 { turn } else { [1.0, 0.0, 0.0, 0.0] });
    out.scales.push(one.deviations.map(|px| (px * one.depth / camera.fx).ln() as f32));
    out.opacities.push((one.opacity / (1.0 - one.opacity)).ln() as f32);
    out.sh0.push([0; 3].map(|_| (0.9 * normal(random)) as f32));
    (0..15).for_each(|_| out.sh_rest.push([0; 3].map(|_| (0.06 * normal(random)) as f32)));
}

/// A normally distributed number (Box and Muller).
fn normal(random: &mut Pcg32) -> f64 {
    let (radius, angle): (f64, f64) = (random.random_range(f64::EPSILON..1.0), random.random_range(0.0..1.0));
    (-2.0 * radius.ln()).sqrt() * (std::f64::consts::TAU * angle).cos()
}
