//! The complete state of a training, and its checkpoint file.
//!
//! The file omits derived values: learning rates and degrees depend on the step, view order and sampled objects on seed
//! and step, and gradients and votes are recomputed.

use super::shared::SharedState;
use super::strategy::StrategyState;
use super::{Moments, TrainConfig};
use crate::engine::GrownSizes;
use crate::engine::state::{self, Counts};
use crate::error::{Error, Result, Setting};
use crate::pass::buffers::TABLE;
use crate::records::checkpoint::{Checkpoint, Plane};
use crate::scene::{Camera, LabelMap, Occluders, Photo, Pixels};
use crate::scheduler::plan::Buf;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The state of a training between two steps.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrainState {
    /// Version of labelgs that wrote it.
    pub labelgs: String,
    /// Device, driver and subgroups, which affect rounding.
    pub device: String,
    /// Number of finished steps.
    pub step: u32,
    /// Number of updates of the parameters, for the bias correction of the moments.
    pub updates: u32,
    /// Number of Gaussians.
    pub gaussians: u32,
    /// Number of Gaussians at the end that are not trained.
    pub frozen: u32,
    /// World position of the origin of the positions.
    pub origin: [f64; 3],
    /// True if votes were counted at least once.
    pub labelled_once: bool,
    /// True if memory has limited the number of Gaussians.
    pub memory_bounds: bool,
    /// Number of Gaussians before the strategy's first change.
    pub first_count: Option<u32>,
    /// Sizes that the buffers had grown to.
    pub sizes: GrownSizes,
    /// The configuration.
    pub config: TrainConfig,
    /// Near planes of the training views, world units, in their order.
    pub near_planes: Vec<f32>,
    /// Fingerprints of the training views, in their order.
    pub views: Vec<ViewFingerprint>,
    /// Occluders of the objects of each view, by name of the view.
    pub occluders: BTreeMap<String, Occluders>,
    /// Data of the caller, or null.
    pub run: serde_json::Value,
    /// State of the strategy.
    pub strategy: StrategyState,
    /// Entry of the shared parameters, if there are any.
    pub shared: Option<SharedState>,
    /// Parameters, moments, statistics and labels.
    #[serde(skip)]
    pub planes: Vec<Plane>,
    /// File that the state was read from, for messages.
    #[serde(skip)]
    pub path: PathBuf,
}

/// The fingerprint of a view.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ViewFingerprint {
    /// Name.
    pub name: String,
    /// Width and height, px.
    pub size: [u32; 2],
    /// CRC-32 of pose and intrinsics.
    pub camera: u32,
    /// CRC-32 of the photo's pixels.
    pub photo: u32,
    /// CRC-32 of the mask's ids.
    pub mask: Option<u32>,
}

impl ViewFingerprint {
    pub(super) fn new(
        name: &str,
        camera: &Camera,
        photo: Option<&Pixels<Photo>>,
        mask: Option<&Pixels<LabelMap>>,
    ) -> Self {
        let intrinsics = [camera.fx, camera.fy, camera.cx, camera.cy];
        let pose = camera.rotation.to_cols_array().into_iter().chain(camera.translation.to_array());
        let numbers: Vec<u8> = pose.chain(intrinsics).flat_map(f64::to_le_bytes).collect();
        Self {
            name: name.to_owned(),
            size: [camera.width, camera.height],
            camera: crc32fast::hash(&numbers),
            photo: photo.map_or(0, Pixels::crc),
            mask: mask.map(Pixels::crc),
        }
    }
}

impl TrainState {
    /// Writes the checkpoint, atomically.
    pub fn write(self, path: &Path) -> Result<()> {
        let meta = serde_json::to_value(&self).map_err(|error| Error::Bug(format!("checkpoint: {error}")))?;
        Checkpoint { meta, planes: self.planes }.write(path)
    }

    /// Reads a checkpoint. A damaged file, another version or inconsistent content is an error that gives the reason.
    pub fn read(path: &Path) -> Result<Self> {
        let file = Checkpoint::read(path)?;
        let odd = |problem: String| Error::data(path, "contents", problem);
        let state: Self = serde_json::from_value(file.meta).map_err(|error| odd(error.to_string()))?;
        let state = Self { planes: file.planes, path: path.to_owned(), ..state };
        state.config.check().map_err(|error| odd(error.to_string()))?;
        if state.updates > state.step {
            return Err(odd(format!("{} updates in {} steps", state.updates, state.step)));
        }
        if state.near_planes.len() != state.views.len() {
            return Err(odd(format!("{} near planes of {} views", state.near_planes.len(), state.views.len())));
        }
        // Masks may be given without showing any object.
        let labels = state.planes.iter().any(|plane| plane.name == TABLE[Buf::LABELS.index()].name);
        let shared = state.shared.as_ref().map_or(0, |kept| kept.layout.count(state.views.len()));
        let half_moments = state.config.moments == Moments::Half;
        let counts = Counts { gaussians: state.gaussians, frozen: state.frozen, shared, half_moments };
        state::check(&state.planes, counts, state.config.sh_degree, labels, &state.strategy.planes).map_err(odd)?;
        Ok(state)
    }

    /// Refuses a scene that differs from the checkpoint's; the error names the first difference.
    pub(super) fn check_scene(&self, scene: &Path, views: &[ViewFingerprint]) -> Result<()> {
        let masks = |views: &[ViewFingerprint]| views.iter().any(|view| view.mask.is_some());
        let (then, now) = (masks(&self.views), masks(views));
        if then != now {
            let had = |masks| if masks { "masks" } else { "no masks" };
            let problem =
                format!("{} was made with {}, but now there are {}", self.path.display(), had(then), had(now));
            return Err(Error::usage(Setting("masks"), problem));
        }
        let refuse = |view: &str, what: &str| {
            let cure = "resume with the original scene, or start a new run";
            Err(Error::data(scene, view, format!("{what} {}; {cure}", self.path.display())))
        };
        if self.views.len() != views.len() {
            return refuse("", &format!("has {} training views, but {} are in", views.len(), self.views.len()));
        }
        for (then, now) in self.views.iter().zip(views) {
            let what = match () {
                () if then.name != now.name => &format!("replaces {} of", then.name),
                () if then.size != now.size || then.camera != now.camera => "has another camera than in",
                () if then.photo != now.photo => "has another photo than in",
                () if then.mask != now.mask => "has another mask than in",
                () => continue,
            };
            return refuse(&now.name, what);
        }
        Ok(())
    }
}
