//! Renders a view: colours as pixel means; ids, depth and whole objects at pixel centres; and isolated objects.

use super::hash01;
use super::object::Object;
use super::world::World;
use glam::{DVec2, DVec3};
use labelgs_scene::Camera;
use labelgs_scenes::lens::{Lens, Optics};
use rayon::prelude::*;
use std::collections::BTreeSet;

/// Samples along each side of a pixel.
const SAMPLES_PER_SIDE: u32 = 3;

/// A rendered view with its ground truth, row-major.
#[derive(Clone, Debug, PartialEq)]
pub struct TracedView {
    /// Width, px.
    pub width: u32,
    /// Height, px.
    pub height: u32,
    /// Colour, mean over the pixel.
    pub rgb: Vec<[u8; 3]>,
    /// Id at the pixel centre, 0 = ground or sky.
    pub ids: Vec<u8>,
    /// Camera-space z at the pixel centre, world units.
    pub depth: Vec<f32>,
    /// For each object of the world in order: true where the object, without occluders, covers the pixel centre.
    pub whole: Vec<Vec<bool>>,
}

struct Pixel {
    rgb: [u8; 3],
    id: u8,
    depth: f32,
}

/// Renders view number `view`. The number only decides the sample positions within pixels.
pub fn trace_view(world: &World, camera: &Camera, view: u32) -> TracedView {
    let (width, height) = (camera.width, camera.height);
    let optics = pinhole(camera);
    let pixels = pixels(world, &optics, view);
    let origin = camera.centre();
    let covers = |object: &Object, index: u32| {
        let ray = middle(&optics, index % width, index / width);
        ray.is_some_and(|ray| object.distance(origin, ray).is_some())
    };
    let whole = world
        .objects
        .iter()
        .map(|object| (0..width * height).into_par_iter().map(|index| covers(object, index)).collect())
        .collect();
    TracedView {
        width,
        height,
        rgb: pixels.iter().map(|p| p.rgb).collect(),
        ids: pixels.iter().map(|p| p.id).collect(),
        depth: pixels.iter().map(|p| p.depth).collect(),
        whole,
    }
}

/// Renders the photo and ids of view number `view` through a lens. Pixels outside the lens are black, with id 0.
pub fn trace_photo(world: &World, optics: &Optics, view: u32) -> (Vec<[u8; 3]>, Vec<u8>) {
    pixels(world, optics, view).into_iter().map(|pixel| (pixel.rgb, pixel.id)).unzip()
}

fn pixels(world: &World, optics: &Optics, view: u32) -> Vec<Pixel> {
    let (width, height) = (optics.camera.width, optics.camera.height);
    (0..width * height).into_par_iter().map(|index| pixel(world, optics, view, index % width, index / width)).collect()
}

fn pinhole(camera: &Camera) -> Optics {
    Optics::new(camera.clone(), Lens::Pinhole)
}

/// Returns, for each object of the world in order, the pixels of view number `view` whose colour may depend on it:
/// those that show it or its shadow.
pub(super) fn involved(world: &World, camera: &Camera, view: u32) -> Vec<Vec<u32>> {
    let (width, optics) = (camera.width, pinhole(camera));
    let parts = |index: u32| {
        let mut found = BTreeSet::new();
        colour(world, &optics, view, (index % width, index / width), &mut |object| _ = found.insert(object));
        found
    };
    let parts: Vec<BTreeSet<usize>> = (0..width * camera.height).into_par_iter().map(parts).collect();
    let mut pixels = vec![Vec::new(); world.objects.len()];
    (0..).zip(&parts).for_each(|(index, found)| found.iter().for_each(|&object| pixels[object].push(index)));
    pixels
}

/// Renders some pixels of the photo of view number `view` again.
pub(super) fn repaint(world: &World, camera: &Camera, view: u32, photo: &mut [[u8; 3]], pixels: &[u32]) {
    let (width, optics) = (camera.width, pinhole(camera));
    let of = |&index: &u32| colour(world, &optics, view, (index % width, index / width), &mut |_| ());
    let colours: Vec<[u8; 3]> = pixels.par_iter().map(of).collect();
    pixels.iter().zip(colours).for_each(|(&index, colour)| photo[index as usize] = colour);
}

/// Returns the unit direction in the world of the ray through an image position; `None` outside the lens.
pub(super) fn ray(optics: &Optics, x: f64, y: f64) -> Option<DVec3> {
    let camera = &optics.camera;
    let pixel = DVec2::new(x, y);
    let own = match optics.lens.is_pinhole() {
        true => camera.ray(pixel),
        false => optics.direction(pixel)?,
    };
    Some((camera.rotation.transpose() * own).normalize())
}

/// Renders an object without occluders, RGBA, row-major. Alpha is 255 where the object covers the pixel centre; other
/// pixels are 0. Light and shadows are those of the photo, because photos cannot teach other colours. The colour is the
/// mean over the covered part of the pixel. It equals the photo's colour where the object fills the pixel and nothing
/// hides it.
pub fn trace_isolated(world: &World, camera: &Camera, view: u32, index: usize) -> Vec<[u8; 4]> {
    let (origin, optics) = (camera.centre(), pinhole(camera));
    let pixel = |at: u32| {
        let (x, y) = (at % camera.width, at / camera.width);
        let ray = middle(&optics, x, y);
        let Some(centre) = ray.and_then(|ray| world.hit_object(index, origin, ray)) else { return [0; 4] };
        let hits = samples(&optics, view, x, y)
            .filter_map(|(direction, spot)| Some((world.hit_object(index, origin, direction)?, spot)));
        let (mut sum, mut count) = (DVec3::ZERO, 0);
        for (hit, spot) in hits {
            sum += world.colour(&hit, spot);
            count += 1;
        }
        let [r, g, b] = bytes(if count > 0 { sum / f64::from(count) } else { world.colour(&centre, [0.0; 2]) });
        [r, g, b, 255]
    };
    (0..camera.width * camera.height).into_par_iter().map(pixel).collect()
}

/// Returns the sample directions of a pixel, each with its position on the light.
fn samples(optics: &Optics, view: u32, x: u32, y: u32) -> impl Iterator<Item = (DVec3, [f64; 2])> {
    (0..SAMPLES_PER_SIDE * SAMPLES_PER_SIDE).filter_map(move |sample| {
        let random = |what: u64| hash01(u64::from(view), u64::from(y) << 32 | u64::from(x), u64::from(sample), what);
        let (column, row) = (sample % SAMPLES_PER_SIDE, sample / SAMPLES_PER_SIDE);
        let within = |cell: u32, what: u64| (f64::from(cell) + random(what)) / f64::from(SAMPLES_PER_SIDE);
        let direction = ray(optics, f64::from(x) + within(column, 0), f64::from(y) + within(row, 1))?;
        // Every pixel uses the same positions on the light, so that shadows have no noise that differs between views.
        let spot = |cell: u32| (f64::from(cell) + 0.5) / f64::from(SAMPLES_PER_SIDE) * 2.0 - 1.0;
        Some((direction, [spot(column), spot(row)]))
    })
}

fn middle(optics: &Optics, x: u32, y: u32) -> Option<DVec3> {
    ray(optics, f64::from(x) + 0.5, f64::from(y) + 0.5)
}

fn bytes(colour: DVec3) -> [u8; 3] {
    colour.to_array().map(|value| (value * 255.0).round() as u8)
}

fn pixel(world: &World, optics: &Optics, view: u32, x: u32, y: u32) -> Pixel {
    let camera = &optics.camera;
    let centre = middle(optics, x, y).map(|ray| world.hit(camera.centre(), ray));
    Pixel {
        rgb: colour(world, optics, view, (x, y), &mut |_| ()),
        id: centre.as_ref().map_or(0, |hit| world.id(hit)),
        depth: centre.map_or(f32::NAN, |hit| camera.to_camera(hit.place).z as f32),
    }
}

/// Returns the mean colour over a pixel. `note` receives the objects on which it may depend.
fn colour(world: &World, optics: &Optics, view: u32, (x, y): (u32, u32), note: &mut impl FnMut(usize)) -> [u8; 3] {
    let origin = optics.camera.centre();
    let (sum, count) = samples(optics, view, x, y)
        .map(|(direction, spot)| world.colour_by(&world.hit(origin, direction), spot, note))
        .fold((DVec3::ZERO, 0), |(sum, count), colour| (sum + colour, count + 1));
    bytes(sum / f64::from(count.max(1)))
}
