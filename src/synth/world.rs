//! The world: objects on a textured ground under a sky.

use super::land::{Land, WALL_COLOUR};
use super::object::Object;
use super::{Preset, hash01, presets};
use glam::{DMat3, DQuat, DVec3};

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
    /// Objects that are invisible but cast a shadow.
    shadows: Vec<Object>,
    land: Land,
    /// Unit vector to the light.
    light: DVec3,
    /// Two unit vectors across the light's direction.
    light_sides: [DVec3; 2],
    seed: u64,
}

impl World {
    /// Creates the world of a preset. The seed determines colours, offsets and the direction of the light.
    pub fn new(preset: Preset, seed: u64) -> Self {
        let turn = 0.6 + hash01(seed, 2, 0, 0);
        let light = DVec3::new(turn.cos() * 0.5, turn.sin() * 0.5, 0.87).normalize();
        let side = light.cross(DVec3::Y).normalize();
        Self {
            objects: presets::objects(preset, seed),
            shadows: Vec::new(),
            land: Land::new(preset),
            light,
            light_sides: [side, light.cross(side)],
            seed,
        }
    }

    /// Returns the world without an object, or with only its shadow. Other objects stay where they are, even those that
    /// stand on it.
    pub fn without(&self, id: u8, shadow: bool) -> Self {
        let (gone, objects): (Vec<Object>, _) = self.objects.iter().cloned().partition(|object| object.id == id);
        Self { objects, shadows: if shadow { gone } else { Vec::new() }, ..self.clone() }
    }

    /// Returns a room with all objects turned and moved together.
    pub(super) fn in_room(&self, turn: DMat3, shift: DVec3) -> Self {
        let rotation = DQuat::from_mat3(&turn);
        let placed = |object: &Object| Object {
            position: rotation * object.position + shift,
            rotation: rotation * object.rotation,
            ..object.clone()
        };
        let objects = self.objects.iter().map(placed).collect();
        Self { objects, land: Land { has_ground: true, ..self.land }, ..self.clone() }
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
        let mut best = self.ground_or_sky(origin, direction);
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
        if !object.may_meet(origin, direction) {
            return None;
        }
        let (own_origin, own_direction) = object.to_own(origin, direction);
        let entry = object.shape.enter(own_origin, own_direction)?;
        let (distance, normal) = (entry.distance, object.rotation * entry.normal);
        Some(Hit { distance, place: origin + direction * distance, normal, surface: Surface::Object(index) })
    }

    /// Returns the colour of a surface point, 0 to 1, the same in all directions. `spot` (-1 to 1) selects a position
    /// on the light; the mean over spots gives soft shadows.
    pub fn colour(&self, hit: &Hit, spot: [f64; 2]) -> DVec3 {
        self.colour_by(hit, spot, &mut |_| ())
    }

    /// Like [`Self::colour`]. `note` receives the indices of the objects on which the colour may depend.
    pub(super) fn colour_by(&self, hit: &Hit, spot: [f64; 2], note: &mut impl FnMut(usize)) -> DVec3 {
        let albedo = match hit.surface {
            Surface::Sky => return self.sky_colour(hit.place),
            Surface::Ground => self.land.albedo(hit.place, self.seed),
            Surface::Object(index) => {
                note(index);
                let object = &self.objects[index];
                object.material.albedo(object.to_own(hit.place, hit.normal).0)
            }
        };
        let to_light =
            (self.light + (self.light_sides[0] * spot[0] + self.light_sides[1] * spot[1]) * 0.09).normalize();
        let facing = hit.normal.dot(to_light).max(0.0);
        let lit = facing > 0.0 && self.is_lit(hit.place + hit.normal * 1e-4, to_light, note);
        // A studio is lit from all sides.
        let (around, direct) = if self.land.is_studio { (0.88, 0.12) } else { (0.42, 0.62) };
        let ambient = around * (0.8 + 0.2 * hit.normal.z);
        let shaded = albedo * (ambient + if lit { direct * facing } else { 0.0 });
        let haze = match hit.surface {
            Surface::Ground => smooth(self.land.haze.0, self.land.haze.1, hit.place.truncate().length()),
            _ => 0.0,
        };
        shaded.lerp(self.sky_colour(DVec3::X), haze).clamp(DVec3::ZERO, DVec3::ONE)
    }

    /// Returns whether the light reaches a point. `note` receives the first object in between.
    fn is_lit(&self, start: DVec3, to_light: DVec3, note: &mut impl FnMut(usize)) -> bool {
        if let Some(index) = self.objects.iter().position(|object| object.distance(start, to_light).is_some()) {
            note(index);
            return false;
        }
        // The point may be inside an object that only casts a shadow, where a ray hits nothing on its way out. So trace
        // this ray from the light.
        let far = 2.0 * self.land.sky;
        let outside = start + to_light * far;
        !self.shadows.iter().any(|object| object.distance(outside, -to_light).is_some_and(|at| at < far))
    }

    fn ground_or_sky(&self, origin: DVec3, direction: DVec3) -> Hit {
        let b = origin.dot(direction);
        let sky = -b + (b * b - origin.length_squared() + self.land.sky * self.land.sky).max(0.0).sqrt();
        let ground = -origin.z / direction.z;
        if self.land.has_ground && direction.z < 0.0 && ground < sky {
            return Hit { distance: ground, place: DVec3::ZERO, normal: DVec3::Z, surface: Surface::Ground };
        }
        Hit { distance: sky, place: DVec3::ZERO, normal: -direction, surface: Surface::Sky }
    }

    /// Returns the sky colour, from haze at the horizon to a blue zenith.
    fn sky_colour(&self, place: DVec3) -> DVec3 {
        if self.land.is_studio {
            return WALL_COLOUR;
        }
        let height = (place.z / self.land.sky).clamp(0.0, 1.0);
        DVec3::new(0.78, 0.82, 0.86).lerp(DVec3::new(0.36, 0.55, 0.82), height.powf(0.6))
    }
}

fn smooth(low: f64, high: f64, value: f64) -> f64 {
    let t = ((value - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
