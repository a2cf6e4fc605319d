//! Pictures of an object from all around, with depth and slant of its surface.

use crate::render::{NEAR_DEFAULT, Render};
use crate::scene::gaussians::{ALPHA_MAX, axes_of};
use crate::scene::{Camera, Gaussians};
use glam::{DMat3, DVec2, DVec3};
use rayon::prelude::*;
use std::f64::consts::PI;

/// Distance of cameras from the bounding ball so that they see all of it, in radii.
const CAMERA_DISTANCE_RADII: f64 = 3.0;
/// Smallest distance of a model camera from the ball's centre for it to be used, in radii.
const CAMERA_DISTANCE_MIN_RADII: f64 = 1.1;
/// Near plane as a share of the distance, if the usual near plane is farther.
const NEAR_DISTANCE_SHARE: f64 = 0.05;
/// Smallest opacity of Gaussians that count for the ball.
const OPACITY_MIN: f64 = 0.1;
/// Smallest radius, world units.
const RADIUS_MIN: f64 = 1e-6;
/// Smallest share of a Gaussian's density in front of its surface.
const FOG_SHARE_MIN: f64 = 0.02;

/// A ball around an object.
#[derive(Clone, Copy, Debug)]
pub(super) struct BoundingBall {
    pub(super) centre: DVec3,
    pub(super) radius: f64,
}

impl BoundingBall {
    /// Makes the ball around the box of the visible Gaussians.
    pub(super) fn around(part: &Gaussians) -> Self {
        let seen = |row: &usize| part.opacity(*row) >= OPACITY_MIN;
        let reach =
            |row: usize| 2.0 * part.scales[row].into_iter().map(|scale| f64::from(scale).exp()).fold(0.0, f64::max);
        let (mut low, mut high) = (DVec3::MAX, DVec3::MIN);
        for row in (0..part.len()).filter(seen) {
            let (place, reach) = (part.world(row), reach(row));
            (low, high) = (low.min(place - reach), high.max(place + reach));
        }
        if low.cmpgt(high).any() {
            return Self { centre: part.origin, radius: RADIUS_MIN };
        }
        Self { centre: (low + high) / 2.0, radius: (high - low).length().max(RADIUS_MIN) / 2.0 }
    }

    /// Returns true for a position outside of the ball, with all of the ball in front.
    pub(super) fn is_seen_from(self, place: DVec3) -> bool {
        place.distance(self.centre) > CAMERA_DISTANCE_MIN_RADII * self.radius
    }

    /// Returns positions evenly distributed around the ball, on a golden-angle spiral.
    pub(super) fn all_round(self, count: usize) -> Vec<DVec3> {
        let golden = PI * (3.0 - 5.0_f64.sqrt());
        let direction = |index: usize| {
            let z = 1.0 - (2 * index + 1) as f64 / count as f64;
            let (sin, cos) = (golden * index as f64).sin_cos();
            DVec3::new(cos, sin, 0.0) * (1.0 - z * z).sqrt() + DVec3::Z * z
        };
        (0..count).map(|index| self.centre + CAMERA_DISTANCE_RADII * self.radius * direction(index)).collect()
    }

    /// Returns a camera at a position that sees the whole ball in a square picture, and its near plane.
    pub(super) fn camera(self, place: DVec3, side: u32) -> (Camera, f32) {
        let distance = place.distance(self.centre);
        let forward = (self.centre - place).normalize_or(DVec3::Z);
        // Any up direction works.
        let right = forward.any_orthonormal_vector();
        let rotation = DMat3::from_cols(right, forward.cross(right), forward).transpose();
        let half = f64::from(side) / 2.0;
        // The tangent of the angle between the axis and the edge of the ball.
        let edge = self.radius
            / (distance * distance - self.radius * self.radius).max(self.radius * self.radius * 0.01).sqrt();
        let camera = Camera::at_origin([half / edge, half / edge, half, half], (side, side));
        (
            Camera { rotation, translation: -(rotation * place), ..camera },
            NEAR_DEFAULT.min((NEAR_DISTANCE_SHARE * distance) as f32),
        )
    }
}

/// Returns up to `most` positions around a centre, preferring directions that are far apart.
pub(super) fn apart(places: &[DVec3], centre: DVec3, most: usize) -> Vec<DVec3> {
    let directions: Vec<DVec3> = places.iter().map(|place| (*place - centre).normalize_or(DVec3::Z)).collect();
    let mut apart = vec![f64::MAX; places.len()];
    let (mut chosen, mut next) = (Vec::new(), 0);
    while chosen.len() < most.min(places.len()) {
        chosen.push(places[next]);
        let last = directions[next];
        apart.iter_mut().zip(&directions).for_each(|(apart, own)| *apart = apart.min(own.distance(last)));
        next = (0..apart.len()).fold(0, |best, at| if apart[at] > apart[best] { at } else { best });
    }
    chosen
}

/// A picture of the object.
#[derive(Debug)]
pub(super) struct DepthPicture {
    pub(super) camera: Camera,
    pixels: Vec<Pixel>,
}

/// Surface at a pixel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pixel {
    /// Depth of the surface, world units; not finite without a surface.
    pub(super) depth: f32,
    /// Cosine between ray and surface normal; 0 if unknown or at another object's surface.
    pub(super) cosine: f32,
    /// True if the surface belongs to the object.
    pub(super) is_own: bool,
    pub(super) colour: [f32; 3],
}

impl DepthPicture {
    /// Makes a picture. The surface is where half of the light is absorbed within a pixel's main Gaussian. The mean
    /// depth would be biased towards the background by light that passes through.
    pub(super) fn new(camera: Camera, rendered: &Render, shown: &Gaussians, label: u32) -> Self {
        let main = |pixel: usize| usize::try_from(rendered.top_id[pixel]).ok();
        let depth = |pixel: usize| {
            let mean = rendered.depth_at(pixel)?;
            let weight = f64::from(rendered.top_weight[pixel]);
            let own = main(pixel).and_then(|row| half_light(shown, row, weight, &camera, camera.pixel_centre(pixel)));
            Some(own.unwrap_or(mean))
        };
        let depths: Vec<f32> =
            (0..rendered.alpha.len()).into_par_iter().map(|pixel| depth(pixel).unwrap_or(f32::INFINITY)).collect();
        let is_own =
            |pixel: usize| depths[pixel].is_finite() && main(pixel).is_some_and(|row| shown.label(row) == label);
        let width = camera.width as usize;
        let place = |pixel: usize| {
            let depth = f64::from(*depths.get(pixel)?);
            is_own(pixel).then(|| camera.ray(camera.pixel_centre(pixel)) * depth)
        };
        let cosine = |pixel: usize| {
            let own = place(pixel)?;
            let across = place(pixel + 1)? - place(pixel.checked_sub(1)?)?;
            let down = place(pixel + width)? - place(pixel.checked_sub(width)?)?;
            Some(across.cross(down).normalize().dot(own.normalize()).abs() as f32)
        };
        let pixels = (0..depths.len())
            .map(|pixel| Pixel {
                depth: depths[pixel],
                is_own: is_own(pixel),
                cosine: cosine(pixel).filter(|cosine| cosine.is_finite()).unwrap_or(0.0),
                colour: rendered.rgb[pixel].map(|value| value / rendered.alpha[pixel].max(f32::MIN_POSITIVE)),
            })
            .collect();
        Self { camera, pixels }
    }

    /// Returns the pixel in the direction of a world point, and the point's distance behind the visible surface along
    /// the ray: negative in front of it, minus infinity without a surface.
    pub(super) fn pixel_at(&self, world: DVec3) -> Option<(&Pixel, f64)> {
        let place = self.camera.to_camera(world);
        let DVec2 { x, y } = self.camera.project(place);
        let inside = place.z > 0.0
            && (0.0..f64::from(self.camera.width)).contains(&x)
            && (0.0..f64::from(self.camera.height)).contains(&y);
        if !inside {
            return None;
        }
        let pixel = &self.pixels[y as usize * self.camera.width as usize + x as usize];
        Some((pixel, (place.z - f64::from(pixel.depth)) * place.length() / place.z))
    }
}

/// Returns the depth along a ray at which half of the light is absorbed, if this happens within this Gaussian, given
/// its blending weight. The Gaussian is treated as fog with a normal density along the ray.
fn half_light(shown: &Gaussians, row: usize, weight: f64, camera: &Camera, pixel: DVec2) -> Option<f32> {
    let axes = axes_of(shown.quats[row]).transpose();
    let inverse = DVec3::from_array(shown.scales[row].map(|scale| (-f64::from(scale)).exp()));
    let ray = inverse * (axes * (camera.rotation.transpose() * camera.ray(pixel)));
    let to = inverse * (axes * (shown.world(row) - camera.centre()));
    let peak = ray.dot(to) / ray.length_squared();
    let off = (to.length_squared() - peak * ray.dot(to)).max(0.0);
    let alpha = (shown.opacity(row) * (-0.5 * off).exp()).max(weight).min(ALPHA_MAX);
    // Light before the Gaussian, and the share of its density after which half of the light is left.
    let before = (weight / alpha).min(1.0);
    let share = ((2.0 * before).ln() / -(-alpha).ln_1p()).clamp(FOG_SHARE_MIN, 0.5);
    // Quantile of a normal distribution, approximated by the logistic distribution.
    let depth = peak + (share / (1.0 - share)).ln() / 1.702 / ray.length();
    (depth > 0.0 && depth.is_finite()).then_some(depth as f32)
}

/// Returns the bounding box of the surface in all pictures, ignoring a share of its pixels at each end of an axis;
/// `None` without a surface.
pub(super) fn bounds(sights: &[DepthPicture], share: f64) -> Option<(DVec3, DVec3)> {
    let places: Vec<DVec3> = sights
        .iter()
        .flat_map(|sight| sight.pixels.iter().enumerate().map(move |pixel| (sight, pixel)))
        .filter(|(_, (_, pixel))| pixel.is_own)
        .map(|(sight, (index, pixel))| sight.camera.unproject(sight.camera.pixel_centre(index), pixel.depth.into()))
        .collect();
    let last = places.len().checked_sub(1)?;
    let ends = [0, 1, 2].map(|axis| {
        let mut along: Vec<f64> = places.iter().map(|place| place[axis]).collect();
        along.sort_by(f64::total_cmp);
        let cut = (share * last as f64) as usize;
        (along[cut], along[last - cut])
    });
    Some((DVec3::from_array(ends.map(|end| end.0)), DVec3::from_array(ends.map(|end| end.1))))
}
