//! An object that turns in front of a fixed camera, wall and stand: the poses follow the object only.

use super::cameras::looking;
use super::material::Pattern;
use super::object::Row;
use super::shape::Shape;
use super::world::World;
use super::{Preset, SynthOptions};
use glam::{DMat3, DVec3};
use labelgs_scene::Camera;
use std::borrow::Cow;
use std::f64::consts::{PI, TAU};

/// Name of the object.
pub(super) const OBJECT_NAME: &str = "loaf";
/// Half sizes of the object.
const OBJECT_HALF_SIZES: DVec3 = DVec3::new(0.34, 0.2, 0.26);
const OBJECT_ROUNDING: f64 = 0.1;
/// Its two colours, as bright as the wall.
pub(super) const OBJECT_COLOURS: [DVec3; 2] = [DVec3::new(0.96, 0.93, 0.84), DVec3::new(0.84, 0.74, 0.58)];
/// Radius of the stand, world units.
pub(super) const STAND_RADIUS: f64 = 0.95;
/// Distance of the camera from the object, world units, and its elevations, alternating, degrees.
const CAMERA_DISTANCE: f64 = 2.2;
const CAMERA_ELEVATIONS: [f64; 3] = [14.0, 30.0, 48.0];

/// Returns the object, as bright as the wall behind it.
pub(super) fn rows() -> Vec<Row> {
    vec![(OBJECT_NAME, Shape::RoundBlock(OBJECT_HALF_SIZES, OBJECT_ROUNDING), [0.0; 3], 0.0, Pattern::Checks(0.19))]
}

/// Returns true if a preset turns its objects.
pub(super) fn is_turned(preset: Preset) -> bool {
    matches!(preset, Preset::Turntable | Preset::TurnedOver)
}

/// Returns the pose of the object in the room in a view: room from object.
fn stance(options: &SynthOptions, view: u32) -> (DMat3, DVec3) {
    let turn = DMat3::from_rotation_z(TAU * f64::from(view) * 2.0 / f64::from(options.views) + 0.2);
    let lies_over = options.preset == Preset::TurnedOver && 2 * view >= options.views;
    let own = if lies_over { DMat3::from_rotation_x(PI) } else { DMat3::IDENTITY };
    (turn * own, DVec3::Z * (OBJECT_HALF_SIZES.z + OBJECT_ROUNDING))
}

/// Returns the camera in the room.
fn stands(options: &SynthOptions, view: u32) -> Camera {
    let elevation = CAMERA_ELEVATIONS[(view % 3) as usize].to_radians();
    let outward = DVec3::new(elevation.cos(), 0.0, elevation.sin());
    looking(options, (DVec3::Z * (OBJECT_HALF_SIZES.z + OBJECT_ROUNDING) + outward * CAMERA_DISTANCE, -outward))
}

/// Returns the camera of a view in the frame of the object.
pub(super) fn camera(options: &SynthOptions, view: u32) -> Camera {
    let (turn, shift) = stance(options, view);
    let camera = stands(options, view);
    Camera { rotation: camera.rotation * turn, translation: camera.to_camera(shift), ..camera }
}

/// Returns the world of a view and its camera: the room, if objects are turned.
pub(super) fn staged<'a>(
    options: &SynthOptions,
    world: &'a World,
    camera: &'a Camera,
    view: u32,
) -> (Cow<'a, World>, Cow<'a, Camera>) {
    if !is_turned(options.preset) {
        return (Cow::Borrowed(world), Cow::Borrowed(camera));
    }
    let (turn, shift) = stance(options, view);
    // Size and lens of the image are those of the camera.
    let room = Camera {
        rotation: camera.rotation * turn.transpose(),
        translation: camera.translation - camera.rotation * (turn.transpose() * shift),
        ..camera.clone()
    };
    (Cow::Owned(world.in_room(turn, shift)), Cow::Owned(room))
}
