//! Synthesises posed test scenes with complete ground truth, ray-traced from analytic shapes.
//!
//! [`write()`] writes photos, masks of visible and of whole objects, isolated objects, depth and points to files.
//! [`dataset`] keeps photos and masks in memory, and [`spoil()`] adds tracker faults to masks. The scenes do not
//! consist of Gaussians, so scoring on them does not compare the engine with itself.

pub mod cameras;
mod city;
mod exposure;
mod flight;
mod hard;
mod land;
mod lens;
mod material;
mod object;
mod points;
mod presets;
mod shape;
pub mod spoil;
pub mod trace;
mod turntable;
pub mod world;
mod write;

pub use cameras::{cameras, ring_of_cameras};
pub use lens::SynthLens;
pub use spoil::{Fault, spoil};
pub use trace::{TracedView, trace_isolated, trace_photo, trace_view};
pub use world::World;
pub use write::{Summary, write};

use labelgs_scene::{Dataset, LabelMap, Photo, View};
use labelgs_scenes::lens::{Lens, Optics};
use serde::{Deserialize, Serialize};

/// A set of objects.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[serde(rename_all = "lowercase")]
pub enum Preset {
    /// Eight objects that touch and occlude each other.
    #[default]
    Default,
    /// Three objects, for quick tests.
    Simple,
    /// Objects that are hard to label: thin, black, coloured like the ground, nested, touching, or cut by the image
    /// border.
    Hard,
    /// A city of sixty houses, trees, vehicles and lamps on 24 x 16 world units, seen from above and from its streets,
    /// for training in blocks.
    City,
    /// A bright object on a turntable in front of a white wall and a fixed camera: the surroundings do not match the
    /// poses.
    Turntable,
    /// The same object, turned upside down between two series of photos.
    #[serde(rename = "turned-over")]
    TurnedOver,
}

/// Options of a synthetic scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SynthOptions {
    /// The objects in the scene.
    pub preset: Preset,
    /// Image width, px.
    pub width: u32,
    /// Image height, px.
    pub height: u32,
    /// Number of views.
    pub views: u32,
    /// Number of 3-D points.
    pub points: u32,
    /// Seed of colours, texture offsets, camera jitter and points.
    pub seed: u64,
    /// Lens of all cameras.
    pub lens: SynthLens,
    /// Horizontal field of view, degrees; by default 50 degrees for a 4 : 3 image. A panorama ignores it.
    pub fov: Option<u32>,
    /// Whether exposure and white balance vary between photos, as with a camera in automatic mode.
    pub vary_exposure: bool,
}

impl Default for SynthOptions {
    fn default() -> Self {
        Self::for_preset(Preset::Default)
    }
}

impl SynthOptions {
    /// Returns the options of a preset, with its default numbers of views and points.
    pub fn for_preset(preset: Preset) -> Self {
        let (views, points) = if preset == Preset::City { (200, 20_000) } else { (40, 4000) };
        Self {
            preset,
            width: 320,
            height: 240,
            views,
            points,
            seed: 0,
            lens: SynthLens::default(),
            fov: None,
            vary_exposure: false,
        }
    }
}

/// Creates the scene in memory, with photos and masks of pinhole cameras. Holds out every `test_every`-th view; 0 holds
/// out none.
pub fn dataset(options: &SynthOptions, test_every: u32) -> Dataset {
    let world = World::new(options.preset, options.seed);
    let cameras = cameras(options);
    let optics: Vec<Optics> = cameras.iter().map(|camera| Optics::new(camera.clone(), Lens::Pinhole)).collect();
    let mut dataset = Dataset {
        points: points::sample(&world, &optics, options).into_iter().map(|seen| seen.point).collect(),
        ..Dataset::default()
    };
    for (index, camera) in cameras.iter().enumerate() {
        let (world, camera) = turntable::staged(options, &world, camera, index as u32);
        let made = trace_view(&world, &camera, index as u32);
        let camera = &cameras[index];
        let (width, height) = (camera.width, camera.height);
        let rgb = exposure::exposed(options, index as u32, made.rgb);
        let rgba = rgb.iter().map(|&[r, g, b]| [r, g, b, 255]).collect();
        let ids = made.ids.iter().map(|&id| u16::from(id)).collect();
        let view = View {
            name: view_name(index),
            camera: camera.clone(),
            photo: Some(Photo { width, height, rgba }.into()),
            mask: Some(LabelMap { width, height, ids }.into()),
        };
        let held_out = test_every > 0 && (index as u32).is_multiple_of(test_every);
        if held_out { dataset.test.push(view) } else { dataset.train.push(view) }
    }
    dataset
}

/// Returns the file name of a view.
fn view_name(index: usize) -> String {
    format!("{index:03}.png")
}

/// Returns a pseudo-random number in 0 to 1 that depends on every bit of the four words and is the same on every
/// machine.
fn hash01(a: u64, b: u64, c: u64, d: u64) -> f64 {
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    for word in [a, b, c, d] {
        state = (state ^ word).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        state = (state ^ (state >> 29)).wrapping_mul(0x94d0_49bb_1331_11eb);
        state ^= state >> 32;
    }
    (state >> 11) as f64 / (1_u64 << 53) as f64
}
