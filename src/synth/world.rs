//! The world: objects on a textured ground under a sky.

use super::material::ground_albedo;
use super::object::Object;
use super::{Preset, hash01, presets};
use glam::DVec3;

/// Radius of the sky, a real surface around the scene, so that its distance can be learnt.
const SKY_RADIUS: f64 = 9.0;
/// Radii between which the ground fades to the colour of the horizon.
const HAZE: (f64, f64) = (2.2, 6.5);

/// The surface that a ray hits first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Surface {
    /// The object with this index.
    Object(usize),
    /// The ground, z = 0.
    Ground,
    /// The sky.
    Sky,
}

/// The point where a ray ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance along the ray.
    pub distance: f64,
    /// World position.
    pub place: DVec3,
    /// Unit normal, world.
    pub normal: DVec3,
    /// Surface at the point.
    pub surface: Surface,
}

/// The world of a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct World {
    /// Objects, with ids 1, 2, ... in order.
    pub objects: Vec<Object>,
    /// Objects of which only the shadow is there.
    shadows: Vec<Object>,
    /// Unit vector to the light.
    light: DVec3,
    /// Two unit vectors across the light's direction.
    light_sides: [DVec3; 2],
    seed: u64,
}

impl World {
    /// Makes the world of a preset. The seed decides colours, offsets and the direction of the light.
    pub fn new(preset: Preset, seed: u64) -> Self {
        let turn = 0.6 + hash01(seed, 2, 0, 0);
        let light = DVec3::new(turn.cos() * 0.5, turn.sin() * 0.5, 0.87).normalize();
        let side = light.cross(DVec3::Y).normalize();
        Self {
            objects: presets::objects(preset, seed),
            shadows: Vec::new(),
            light,
            light_sides: [side, light.cross(side)],
            seed,
        }
    }

    /// Returns the world without one object, or with nothing but its shadow. Other objects stay where they are, also those
    /// that stand on it.
    pub fn without(&self, id: u8, shadow: bool) -> Self {
        let (gone, objects): (Vec<Object>, _) = self.objects.iter().cloned().partition(|object| object.id == id);
        Self { objects, shadows: if shadow { gone } else { Vec::new() }, ..self.clone() }
    }

    /// Returns the id at a hit: 0 for ground and sky.
    pub fn id(&self, hit: &Hit) -> u8 {
        match hit.surface {
            Surface::Object(index) => self.objects[index].id,
            Surface::Ground | Surface::Sky => 0,
        }
    }

    /// Returns the first hit of a ray. `origin` is above the ground and inside the sky.
    pub fn hit(&self, origin: DVec3, direction: DVec3) -> Hit {
        let mut best = ground_or_sky(origin, direction);
        best.place = origin + direction * best.distance;
        for index in 0..self.objects.len() {
            if let Some(hit) = self.hit_object(index, origin, direction)
                && hit.distance < best.distance
            {
                best = hit;
            }
        }
        best
    }

    /// Returns the hit of a ray with the object of this index, ignoring all others.
    pub fn hit_object(&self, index: usize, origin: DVec3, direction: DVec3) -> Option<Hit> {
        let object = &self.objects[index];
        let (own_origin, own_direction) = object.to_own(origin, direction);
        let entry = object.shape.enter(own_origin, own_direction)?;
        let (distance, normal) = (entry.distance, object.rotation * entry.normal);
        Some(Hit { distance, place: origin + direction * distance, normal, surface: Surface::Object(index) })
    }

    /// Returns the colour of a surface point, the same in every direction, 0 to 1. `spot` (-1 to 1) picks a position on
    /// the light; a mean over spots gives soft shadows.
    pub fn colour(&self, hit: &Hit, spot: [f64; 2]) -> DVec3 {
        let albedo = match hit.surface {
            Surface::Sky => return sky_colour(hit.place),
            Surface::Ground => ground_albedo(hit.place, self.seed),
            Surface::Object(index) => {
                let object = &self.objects[index];
                object.material.albedo(object.to_own(hit.place, hit.normal).0)
            }
        };
        let to_light =
            (self.light + (self.light_sides[0] * spot[0] + self.light_sides[1] * spot[1]) * 0.09).normalize();
        let facing = hit.normal.dot(to_light).max(0.0);
        let start = hit.place + hit.normal * 1e-4;
        let is_lit = || {
            // What only throws a shadow may have the point inside, where a ray meets nothing on its way out. So this one
            // comes from the light.
            let outside = start + to_light * (2.0 * SKY_RADIUS);
            let before = |object: &Object| object.distance(outside, -to_light).is_some_and(|at| at < 2.0 * SKY_RADIUS);
            !self.objects.iter().any(|object| object.distance(start, to_light).is_some())
                && !self.shadows.iter().any(before)
        };
        let lit = facing > 0.0 && is_lit();
        let ambient = 0.42 * (0.8 + 0.2 * hit.normal.z);
        let shaded = albedo * (ambient + if lit { 0.62 * facing } else { 0.0 });
        let haze = match hit.surface {
            Surface::Ground => smooth(HAZE.0, HAZE.1, hit.place.truncate().length()),
            _ => 0.0,
        };
        shaded.lerp(sky_colour(DVec3::X), haze).clamp(DVec3::ZERO, DVec3::ONE)
    }
}

fn ground_or_sky(origin: DVec3, direction: DVec3) -> Hit {
    let b = origin.dot(direction);
    let sky = -b + (b * b - origin.length_squared() + SKY_RADIUS * SKY_RADIUS).max(0.0).sqrt();
    let ground = -origin.z / direction.z;
    if direction.z < 0.0 && ground < sky {
        return Hit { distance: ground, place: DVec3::ZERO, normal: DVec3::Z, surface: Surface::Ground };
    }
    Hit { distance: sky, place: DVec3::ZERO, normal: -direction, surface: Surface::Sky }
}

/// Returns the sky colour, from haze at the horizon to a blue zenith.
fn sky_colour(place: DVec3) -> DVec3 {
    let height = (place.z / SKY_RADIUS).clamp(0.0, 1.0);
    DVec3::new(0.78, 0.82, 0.86).lerp(DVec3::new(0.36, 0.55, 0.82), height.powf(0.6))
}

fn smooth(low: f64, high: f64, value: f64) -> f64 {
    let t = ((value - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
