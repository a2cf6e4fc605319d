//! A sparse point cloud like one from structure from motion, with the views of each point.

use super::trace::ray;
use super::world::{Surface, World};
use super::{SynthOptions, turntable};
use glam::{DVec2, DVec3};
use labelgs_scene::Point;
use labelgs_scenes::lens::Optics;
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64;

/// Standard deviation of the position error, as a share of the distance.
const POSITION_NOISE: f64 = 0.0015;

/// A point and its observations.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct ObservedPoint {
    /// Position and colour.
    pub point: Point,
    /// Indices of views and image positions, px.
    pub track: Vec<(u32, DVec2)>,
}

/// Samples points on visible surfaces with the density of pixels. At least two views see each point.
pub(super) fn sample(world: &World, cameras: &[Optics], options: &SynthOptions) -> Vec<ObservedPoint> {
    let mut random = Pcg64::seed_from_u64(options.seed);
    let mut found = Vec::new();
    // A scene with few views may have fewer points than requested, so bound the number of attempts.
    let tries = if turntable::is_turned(options.preset) { 40 } else { 4 };
    for _ in 0..u64::from(options.points) * tries {
        if found.len() >= options.points as usize || cameras.is_empty() {
            break;
        }
        let optics = &cameras[random.random_range(0..cameras.len())];
        let camera = &optics.camera;
        let (x, y) =
            (random.random::<f64>() * f64::from(camera.width), random.random::<f64>() * f64::from(camera.height));
        let Some(ray) = ray(optics, x, y) else { continue };
        let hit = world.hit(camera.centre(), ray);
        if turntable::is_turned(options.preset) && !matches!(hit.surface, Surface::Object(_)) {
            continue;
        }
        let mut normal = || {
            // A sum of uniform numbers is approximately normal and the same on every machine.
            (0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0
        };
        let error = DVec3::new(normal(), normal(), normal()) * (POSITION_NOISE * hit.distance);
        let colour = world.colour(&hit, [0.0; 2]).to_array().map(|value| (value * 255.0).round() as u8);
        let point = Point { position: hit.place + error, colour };
        let track: Vec<_> = cameras
            .iter()
            .enumerate()
            .filter_map(|(view, optics)| sees(world, optics, hit.place).map(|place| (view as u32, place)))
            .collect();
        if track.len() >= 2 {
            found.push(ObservedPoint { point, track });
        }
    }
    found
}

/// Returns the image position of a surface point in a camera that sees it.
fn sees(world: &World, optics: &Optics, place: DVec3) -> Option<DVec2> {
    let camera = &optics.camera;
    let pixel = optics.pixel(camera.to_camera(place))?;
    let inside = pixel.cmpge(DVec2::ZERO).all()
        && pixel.cmplt(DVec2::new(f64::from(camera.width), f64::from(camera.height))).all();
    let towards = place - camera.centre();
    let distance = towards.length();
    let free = || world.hit(camera.centre(), towards / distance).distance > distance * (1.0 - 1e-6);
    (inside && free()).then_some(pixel)
}
