//! The complete state of a training, and its file. A resumed training gives the same bits as an uninterrupted one.
//!
//! The file leaves out derived values: learning rates and degrees follow from the step, the order of views and the
//! sampled objects from seed and step, gradients and votes from the passes of the next step.

use super::region::Region;
use super::sampler::ViewOrder;
use super::shared::KeptShared;
use super::strategy::Kept;
use super::{TrainConfig, Trainer, TrainerOptions, engine_size};
use crate::engine::GrownSizes;
use crate::engine::state::{self, Counts};
use crate::error::{Error, Result, Setting};
use crate::gpu::Gpu;
use crate::pass::SHARED_PLANES;
use crate::records::checkpoint::{Checkpoint, Plane};
use crate::scene::{Camera, Dataset, LabelMap, Occluders, Photo, Pixels};
use crate::scheduler::plan::{Buf, TABLE};
use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The state of a training between two steps.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrainState {
    /// Version of labelgs that wrote it.
    pub labelgs: String,
    /// Device, driver and subgroups. Others round differently.
    pub device: String,
    /// Number of finished steps.
    pub step: u32,
    /// Number of updates of the parameters, for the bias correction of the moments.
    pub updates: u32,
    /// Number of Gaussians.
    pub gaussians: u32,
    /// Number of Gaussians at the end that are not trained.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub frozen: u32,
    /// World position of the origin of the positions.
    #[serde(default)]
    pub origin: [f64; 3],
    /// Votes were counted at least once.
    pub labelled_once: bool,
    /// Memory has limited the number of Gaussians.
    pub memory_bounds: bool,
    /// Sizes that the buffers had grown to.
    pub sizes: GrownSizes,
    /// The configuration.
    pub config: TrainConfig,
    /// Near planes of the training views, world units; empty if all have that of the configuration.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub near_planes: Vec<f32>,
    /// Fingerprints of the training views, in their order.
    pub views: Vec<ViewFingerprint>,
    /// Occluders of the objects of each view, by name of the view.
    pub occluders: BTreeMap<String, Occluders>,
    /// Data of the caller; null for none.
    pub run: serde_json::Value,
    /// State of the strategy; the default strategy has no entry.
    #[serde(default, skip_serializing_if = "Kept::is_default")]
    pub strategy: Kept,
    /// Entry of the shared parameters, if there are any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shared: Option<KeptShared>,
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
    fn new(name: &str, camera: &Camera, photo: Option<&Pixels<Photo>>, mask: Option<&Pixels<LabelMap>>) -> Self {
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
        let mut meta = file.meta;
        complete(&mut meta["config"]).map_err(|error| odd(error.to_string()))?;
        let state: Self = serde_json::from_value(meta).map_err(|error| odd(error.to_string()))?;
        let state = Self { planes: file.planes, path: path.to_owned(), ..state };
        state.config.check().map_err(|error| odd(error.to_string()))?;
        if state.updates > state.step {
            return Err(odd(format!("{} updates in {} steps", state.updates, state.step)));
        }
        // Masks may be given and show no object.
        let labels = state.planes.iter().any(|plane| plane.name == TABLE[Buf::LABELS.index()].name);
        let shared = state.shared.as_ref().map_or(0, |kept| kept.layout.count(state.views.len()));
        let counts = Counts { gaussians: state.gaussians, frozen: state.frozen, shared };
        state::check(&state.planes, counts, state.config.sh_degree, labels, &state.strategy.planes).map_err(odd)?;
        Ok(state)
    }

    /// Refuses a scene that differs from that of the checkpoint; the error names the first difference.
    fn check_scene(&self, scene: &Path, views: &[ViewFingerprint]) -> Result<()> {
        let masks = |views: &[ViewFingerprint]| views.iter().any(|view| view.mask.is_some());
        let (then, now) = (masks(&self.views), masks(views));
        if then != now {
            let had = |masks| if masks { "masks" } else { "no masks" };
            let problem = format!("{} was made with {}, now there are {}", self.path.display(), had(then), had(now));
            return Err(Error::usage(Setting("masks"), problem));
        }
        let refuse = |view: &str, what: &str| {
            let cure = "go on with the scene as it was, or start a new run";
            Err(Error::data(scene, view, format!("{what} {}; {cure}", self.path.display())))
        };
        if self.views.len() != views.len() {
            return refuse("", &format!("has {} training views, {} are in", views.len(), self.views.len()));
        }
        for (then, now) in self.views.iter().zip(views) {
            let what = match () {
                () if then.name != now.name => &format!("is in the place of {} in", then.name),
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

impl Trainer {
    /// Waits for the steps in flight and returns the state of the training.
    pub fn state(&mut self) -> Result<TrainState> {
        self.drain()?;
        let print = |view: &super::TrainView| {
            ViewFingerprint::new(&view.name, &view.camera, Some(&view.photo), view.mask.as_ref())
        };
        if self.fingerprints.is_empty() {
            self.fingerprints = self.views.iter().map(print).collect();
        }
        Ok(TrainState {
            labelgs: env!("CARGO_PKG_VERSION").to_owned(),
            device: device(self.engine.gpu()),
            step: self.step,
            updates: self.updates,
            gaussians: self.gaussian_count(),
            frozen: self.engine.size().frozen,
            origin: self.engine.origin().to_array(),
            labelled_once: self.labelled_once,
            memory_bounds: self.bound.by_memory,
            sizes: self.engine.sizes(),
            config: self.config.clone(),
            near_planes: self.near_planes(),
            views: self.fingerprints.clone(),
            occluders: self.occluders(),
            run: serde_json::Value::Null,
            strategy: Kept::of(&*self.strategy),
            shared: self.shared.kept(),
            planes: self.finite_planes()?,
            path: PathBuf::new(),
        })
    }

    /// Reads the planes of the state. A NaN or infinity is an error: the checkpoint would be useless. No pass has
    /// checked the result of the last step yet.
    fn finite_planes(&mut self) -> Result<Vec<Plane>> {
        let planes = self.engine.download_state(self.strategy.planes())?;
        let is_finite = |word: &u32| f32::from_bits(*word).is_finite();
        for plane in planes.iter().filter(|plane| plane.name != TABLE[Buf::LABELS.index()].name) {
            if let Some(at) = plane.data.iter().position(|word| !is_finite(word)) {
                let row = at / plane.words.max(1) as usize;
                let is_shared = SHARED_PLANES.iter().any(|buf| TABLE[buf.index()].name == plane.name);
                let of = if is_shared { "row" } else { "Gaussian" };
                return Err(Error::Numeric {
                    quantity: format!("{} of {of} {row} is not finite, so there is no checkpoint", plane.name),
                    step: u64::from(self.step),
                    view: "of this step or one before".to_owned(),
                });
            }
        }
        Ok(planes)
    }

    /// Resumes a training from `state`, with the same bits on the same device as without the interruption. `dataset`
    /// must be the data set of the state.
    pub fn resume(
        gpu: Arc<Gpu>,
        dataset: &Dataset,
        state: TrainState,
        options: impl Into<TrainerOptions>,
    ) -> Result<Self> {
        state.config.check()?;
        let views = dataset.train.iter();
        let fingerprints: Vec<ViewFingerprint> =
            views.map(|v| ViewFingerprint::new(&v.name, &v.camera, v.photo.as_ref(), v.mask.as_ref())).collect();
        state.check_scene(&dataset.root, &fingerprints)?;
        let (now, version) = (device(&gpu), env!("CARGO_PKG_VERSION"));
        for (then, now) in [(&state.device, now.as_str()), (&state.labelgs, version)] {
            if then != now {
                tracing::warn!("{} was made with {then}, this is {now}: bits may differ", state.path.display());
            }
        }
        let options = options.into();
        let frozen = Region::frozen(options.region.as_ref());
        if frozen != state.frozen {
            let problem = format!("{frozen} frozen Gaussians, {} are in {}", state.frozen, state.path.display());
            return Err(Error::data(
                &dataset.root,
                "",
                format!("the part of the scene has {problem}; start a new run"),
            ));
        }
        let size = engine_size(dataset, &state.config, u64::from(state.gaussians))?.with_frozen(frozen);
        if let Some(labels) = size.labels
            && let Some(plane) = state.planes.iter().find(|plane| plane.name == "labels")
            && let Some(label) = plane.data.iter().find(|&&label| label > labels.max_label)
        {
            let problem = format!("is {label}, the masks have ids up to {}", labels.max_label);
            return Err(Error::data(&state.path, "a label", problem));
        }
        let mut trainer = Self::without_model(gpu, state.config.clone(), dataset, size, options)?;
        trainer.fingerprints = fingerprints;
        trainer.put(&state)?;
        Ok(trainer)
    }

    /// Restores an earlier state of the same training.
    pub fn restore(&mut self, state: &TrainState) -> Result<()> {
        self.engine.abandon()?;
        self.in_flight.clear();
        self.put(state)
    }

    fn near_planes(&self) -> Vec<f32> {
        let planes: Vec<f32> = self.views.iter().map(|view| view.near).collect();
        if planes.iter().all(|&near| near == self.config.near) { Vec::new() } else { planes }
    }

    fn put(&mut self, state: &TrainState) -> Result<()> {
        let same = vec![state.config.near; self.views.len()];
        self.views.set_near_planes(if state.near_planes.is_empty() { &same } else { &state.near_planes });
        let odd = |problem| Error::data(&state.path, "strategy", problem);
        state.strategy.restore(&mut *self.strategy).map_err(odd)?;
        self.shared
            .check(state.shared.as_ref())
            .map_err(|problem| Error::data(&state.path, "shared parameters", problem))?;
        match self.engine.grow_to(state.sizes) {
            // A smaller device has less room to grow.
            Err(Error::OutOfMemory { .. }) => {}
            other => other?,
        }
        self.engine.upload_state(state.gaussians, DVec3::from_array(state.origin), &state.planes)?;
        self.set_occluders(&state.occluders);
        self.order = ViewOrder::after(self.config.seed, self.views.parts().len(), state.step);
        (self.step, self.updates) = (state.step, state.updates);
        (self.labelled_once, self.bound.by_memory) = (state.labelled_once, state.memory_bounds);
        self.seen = Default::default();
        Ok(())
    }
}

fn is_zero(number: &u32) -> bool {
    *number == 0
}

/// Settings that a checkpoint lacks were not there when it was written: its training has the schedule of 3DGS, and
/// object layers in every step with labels, and no splits at contours.
fn complete(config: &mut serde_json::Value) -> serde_json::Result<()> {
    if let Some(found) = config.as_object_mut() {
        found.entry("layer_every").or_insert(1.into());
        found.entry("contour_share").or_insert(0.into());
    }
    if let Some(found) = config.as_object_mut().filter(|found| !found.contains_key("strategy")) {
        let serde_json::Value::Object(mut earlier) = serde_json::to_value(TrainConfig::adc())? else { return Ok(()) };
        earlier.append(found);
        *found = earlier;
    }
    Ok(())
}

/// Returns the description of the device: equal descriptions give equal bits.
fn device(gpu: &Gpu) -> String {
    let found = gpu.capabilities();
    let driver = format!("{} {}", found.driver_name, found.driver_info);
    format!("{} ({driver}, {})", found.name, found.subgroup)
}

#[cfg(test)]
mod tests {
    use super::complete;
    use crate::train::TrainConfig;

    /// What came later is off in trainings that began before it.
    #[test]
    fn settings_of_older_checkpoints_are_those_they_were_written_with() {
        let set = TrainConfig { layer_every: Some(8), ..TrainConfig::default() };
        let mut config = serde_json::to_value(set).expect("json");
        let fields = config.as_object_mut().expect("an object");
        fields.remove("contour_share").expect("a setting");
        fields.remove("layer_every").expect("a setting");
        complete(&mut config).expect("completed");
        let completed: TrainConfig = serde_json::from_value(config.clone()).expect("settings");
        assert_eq!((completed.contour_share, completed.layer_every), (0.0, Some(1)));
        assert_eq!(completed.strategy, TrainConfig::default().strategy);
        config.as_object_mut().expect("an object").remove("strategy");
        complete(&mut config).expect("completed");
        let earliest: TrainConfig = serde_json::from_value(config).expect("settings");
        assert_eq!(earliest.strategy, TrainConfig::adc().strategy);
    }
}
