//! Depths of random pixels: the depth at which other photos show the same colour.
//!
//! A plane sweep without windows or smoothing. Most points end up near a surface, which is enough for the first
//! Gaussians: training moves or removes the others.

use super::texel::texel;
use glam::DVec2;
use labelgs_files::resize::{bounded_size, shrink_photo};
use labelgs_scene::{Camera, Photo, Pixels, Point, Result, View};
use rand::Rng;
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;

/// Longest side of the compared photos, px: neighbouring depths are about a pixel apart.
const SIDE_MAX: u32 = 160;
/// Number of depths per pixel, uniform in inverse depth.
const DEPTH_COUNT: u32 = 48;
/// Colour differences are clamped to this value, beyond which a pixel is unrelated: hidden, or on another surface.
const DIFFERENCE_MAX: u32 = 48 * 3;
/// Most photos that a pixel is compared with.
const COMPARED_MAX: usize = 24;
/// A pixel of a small photo with at most this opacity, encoded as in a photo's alpha, shows no object.
const CLEAR_ALPHA_MAX: u8 = 192;
/// Most attempts per point.
const TRIES_MAX: usize = 3;

/// Small photos with their cameras.
pub(super) struct Sweep {
    photos: Vec<(Camera, Photo)>,
    depths: (f64, f64),
    /// Whether clear pixels are empty space, which matches nothing.
    objects_only: bool,
}

impl Sweep {
    /// Creates the sweep; `depths` are the smallest and the largest depth.
    pub(super) fn new(views: &[View], depths: (f64, f64)) -> Result<Self> {
        let small = |photo: &Pixels<Photo>, camera: &Camera| {
            let photo = photo.get()?;
            let (width, height) = bounded_size((photo.width, photo.height), Some(SIDE_MAX));
            Ok((camera.resized(width, height), shrink_photo(&photo, width, height)))
        };
        let photos = views.iter().filter_map(|view| Some(small(view.photo.as_ref()?, &view.camera)));
        Ok(Self { photos: photos.collect::<Result<_>>()?, depths, objects_only: false })
    }

    /// Creates the sweep for photos of isolated objects.
    pub(super) fn for_objects(views: &[View], depths: (f64, f64)) -> Result<Self> {
        Ok(Self { objects_only: true, ..Self::new(views, depths)? })
    }

    /// Returns at most `count` points, each behind a random pixel, on which three photos agree.
    pub(super) fn points(&self, random: &mut Pcg64Mcg, count: usize) -> Vec<Point> {
        let mut points = Vec::new();
        if self.photos.len() < 2 {
            return points;
        }
        for _ in 0..TRIES_MAX {
            if points.len() < count {
                let drawn: Vec<(usize, DVec2, f64)> = (0..count).map(|_| self.pixel(random)).collect();
                let found: Vec<_> = drawn.par_iter().map(|&(at, pixel, phase)| self.point(at, pixel, phase)).collect();
                points.extend(found.into_iter().flatten());
            }
        }
        points.truncate(count);
        points
    }

    /// Draws a photo, a position in it, and the offset of the first depth.
    fn pixel(&self, random: &mut Pcg64Mcg) -> (usize, DVec2, f64) {
        let index = random.random_range(0..self.photos.len());
        let camera = &self.photos[index].0;
        let x = random.random_range(0.0..f64::from(camera.width));
        let y = random.random_range(0.0..f64::from(camera.height));
        (index, DVec2::new(x, y), random.random_range(0.0..1.0))
    }

    fn point(&self, index: usize, pixel: DVec2, phase: f64) -> Option<Point> {
        let (camera, photo) = &self.photos[index];
        let colour = texel(photo, pixel).filter(|_| !self.is_nothing(photo, pixel))?;
        let (near, far) = self.depths;
        let depth = |step: u32| {
            let part = (f64::from(step) + phase) / f64::from(DEPTH_COUNT);
            1.0 / (part / near + (1.0 - part) / far)
        };
        let others = (self.photos.len() - 2).min(1) + 1;
        let costs = (0..DEPTH_COUNT).filter_map(|step| {
            let position = camera.unproject(pixel, depth(step));
            let point = Point { position, colour };
            self.difference(index, &point, others).map(|cost| (cost, point))
        });
        costs.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, point)| point)
    }

    /// Returns the mean difference to the photos that see the point, if there are at least `others`.
    fn difference(&self, own: usize, point: &Point, others: usize) -> Option<f64> {
        let (mut sum, mut seen) = (0, 0);
        let step = self.photos.len().div_ceil(COMPARED_MAX);
        // Start at the own photo, so that the compared photos vary evenly.
        let compared = (own % step..self.photos.len()).step_by(step).filter(|&index| index != own);
        for (camera, photo) in compared.map(|index| &self.photos[index]) {
            let Some(pixel) = camera.sees(point.position) else { continue };
            let Some(texel) = texel(photo, pixel) else { continue };
            let difference: u32 = (0..3).map(|c| u32::from(texel[c].abs_diff(point.colour[c]))).sum();
            sum += if self.is_nothing(photo, pixel) { DIFFERENCE_MAX } else { difference.min(DIFFERENCE_MAX) };
            seen += 1;
        }
        (seen >= others).then(|| f64::from(sum) / seen as f64)
    }

    fn is_nothing(&self, photo: &Photo, pixel: DVec2) -> bool {
        self.objects_only
            && photo.rgba[pixel.y as usize * photo.width as usize + pixel.x as usize][3] <= CLEAR_ALPHA_MAX
    }
}
