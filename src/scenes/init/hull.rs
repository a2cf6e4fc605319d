//! First points for isolated objects: the volume that no photo shows as clear.
//!
//! A photo of isolated objects (`matte`) shows for each position inside its image whether something is there. Outside
//! its image, its nearest pixel counts, because it was cropped to the objects. The volume that few photos show as clear
//! is the visual hull, in which [`sweep`](super::sweep) finds surfaces.

use super::sweep::Sweep;
use glam::{DMat3, DVec2, DVec3};
use labelgs_scene::median::median;
use labelgs_scene::view::ALPHA_CLEAR;
use labelgs_scene::{Camera, Dataset, Error, Photo, Pixels, Point, Result, View};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;

/// Share of the photos that may show a position of the hull as clear: masks are off by pixels, and may miss a part.
const CLEAR_SHARE_MAX: f64 = 0.1;
/// Share of the points anywhere in the hull; the others are placed by photos.
const ANYWHERE_SHARE: f64 = 0.2;
/// Most batches of candidates.
const CANDIDATE_BATCHES_MAX: usize = 32;

/// What photos show at a position.
#[derive(Clone, Copy, Default)]
struct PositionEvidence {
    clear: u32,
    /// Number of photos that show something, and the sum of their colours.
    solid: u32,
    sum: [u32; 3],
}

impl PositionEvidence {
    fn look(&mut self, place: DVec3, camera: &Camera, photo: &Photo) {
        let at = camera.to_camera(place);
        if at.z <= 0.0 {
            return;
        }
        let side = |value: f64, size: u32| value.clamp(0.0, f64::from(size - 1)) as usize;
        let pixel = camera.project(at);
        let index = side(pixel.y, photo.height) * photo.width as usize + side(pixel.x, photo.width);
        match photo.rgba[index] {
            [.., 0..ALPHA_CLEAR] => {}
            [.., ALPHA_CLEAR] => self.clear += 1,
            [r, g, b, _] => {
                self.solid += 1;
                self.sum.iter_mut().zip([r, g, b]).for_each(|(sum, value)| *sum += u32::from(value));
            }
        }
    }

    fn is_inside(&self) -> bool {
        self.solid > 0 && f64::from(self.clear) <= CLEAR_SHARE_MAX * f64::from(self.clear + self.solid)
    }

    fn colour(&self) -> [u8; 3] {
        self.sum.map(|value| ((value + self.solid / 2) / self.solid.max(1)) as u8)
    }
}

/// Projects positions into all photos, one photo at a time, because not all may be in memory.
fn gather_evidence(views: &[View], places: &[DVec3]) -> Result<Vec<PositionEvidence>> {
    let mut found = vec![PositionEvidence::default(); places.len()];
    for view in views {
        if let Some(photo) = view.photo.as_ref().map(Pixels::get).transpose()? {
            found.par_iter_mut().zip(places).for_each(|(shown, place)| shown.look(*place, &view.camera, &photo));
        }
    }
    Ok(found)
}

/// Returns for each position whether it is inside the objects of the training photos.
pub fn inside(dataset: &Dataset, places: &[DVec3]) -> Result<Vec<bool>> {
    Ok(gather_evidence(&dataset.train, places)?.iter().map(PositionEvidence::is_inside).collect())
}

/// Returns at most `count` points of the objects, determined by seed and scene.
pub(super) fn points(dataset: &Dataset, seed: u64, count: usize) -> Result<Vec<Point>> {
    let views = &dataset.train;
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let ball = Ball::around_objects(views, dataset.extent());
    let passing = |drawn: Vec<Point>| -> Result<Vec<Point>> {
        let places: Vec<DVec3> = drawn.iter().map(|point| point.position).collect();
        let found = drawn.into_iter().zip(gather_evidence(views, &places)?).filter(|(_, shown)| shown.is_inside());
        Ok(found.map(|(point, shown)| Point { colour: shown.colour(), ..point }).collect())
    };
    let swept = Sweep::for_objects(views, ball.depths())?.points(&mut random, count);
    let places: Vec<DVec3> = swept.iter().map(|point| point.position).collect();
    let inside = inside(dataset, &places)?;
    let swept = swept.into_iter().zip(inside).filter(|(_, inside)| *inside).map(|(point, _)| point);
    let mut points: Vec<Point> = swept.take(((1.0 - ANYWHERE_SHARE) * count as f64) as usize).collect();
    for _ in 0..CANDIDATE_BATCHES_MAX {
        if points.len() >= count {
            break;
        }
        let mut draw = || {
            let view = random.random_range(0..views.len());
            ball.candidate(&mut random, &views[view].camera)
        };
        points.extend(passing((0..count.max(1024)).map(|_| draw()).collect())?);
    }
    points.truncate(count);
    if points.is_empty() {
        let problem = "the masks of the photos leave no space for an object: no position is inside most of them. Poses \
                       and masks do not belong together, or the masks are inverted";
        return Err(Error::data(&dataset.root, "masks", problem));
    }
    Ok(points)
}

/// A ball around the objects.
struct Ball {
    centre: DVec3,
    radius: f64,
    /// Typical distance of the cameras from the centre, world units.
    distance: f64,
}

impl Ball {
    /// Returns a ball around the point nearest to the rays through the image centres, where the objects are.
    fn around_objects(views: &[View], extent: f64) -> Self {
        let (mut matrix, mut right) = (DMat3::ZERO, DVec3::ZERO);
        for camera in views.iter().map(|view| &view.camera) {
            let ray = camera.unproject(middle(camera), 1.0) - camera.centre();
            let ray = ray.normalize_or_zero();
            let across = DMat3::IDENTITY - DMat3::from_cols(ray * ray.x, ray * ray.y, ray * ray.z);
            matrix += across;
            right += across * camera.centre();
        }
        let count = views.len().max(1) as f64;
        let (matrix, right) = (matrix * (1.0 / count), right / count);
        // Parallel rays leave the distance undetermined.
        let held = 1e-6;
        let mean = views.iter().map(|view| view.camera.centre() + view.camera.axis() * extent).sum::<DVec3>() / count;
        let centre = (matrix + DMat3::IDENTITY * held).inverse() * (right + mean * held);
        let cameras = || views.iter().map(|view| &view.camera);
        let distance = median(cameras().map(|camera| camera.centre().distance(centre))).unwrap_or(extent);
        let half = |camera: &Camera| {
            DVec2::new(f64::from(camera.width) / camera.fx, f64::from(camera.height) / camera.fy).length() / 2.0
        };
        let radius = median(cameras().map(|camera| half(camera) * camera.centre().distance(centre))).unwrap_or(extent);
        Self { centre, radius: radius.min(0.9 * distance), distance }
    }

    fn depths(&self) -> (f64, f64) {
        (self.distance - self.radius, self.distance + self.radius)
    }

    /// Draws a point in a random pixel of a camera, within the depths of the ball.
    fn candidate(&self, random: &mut Pcg64Mcg, camera: &Camera) -> Point {
        let x = random.random_range(0.0..f64::from(camera.width));
        let y = random.random_range(0.0..f64::from(camera.height));
        let depth = camera.to_camera(self.centre).z + random.random_range(-self.radius..=self.radius);
        Point { position: camera.unproject(DVec2::new(x, y), depth), colour: [0; 3] }
    }
}

fn middle(camera: &Camera) -> DVec2 {
    DVec2::new(f64::from(camera.width), f64::from(camera.height)) / 2.0
}
