//! Checkpoints of a trainer. A resumed training gives the same bits as an uninterrupted one.

use super::Trainer;
use crate::engine::state::StateCopy;
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::scene::Dataset;
use crate::train::input::sampler::ViewOrder;
use crate::train::input::step_input::TrainView;
use crate::train::setup::region::Region;
use crate::train::setup::{TrainerOptions, engine_size};
use crate::train::state::{TrainState, ViewFingerprint};
use crate::train::strategy::StrategyState;
use glam::DVec3;
use std::path::PathBuf;
use std::sync::Arc;

/// A copy of the training state that any thread can read.
pub struct PendingState {
    /// Everything except the planes.
    pub state: TrainState,
    planes: StateCopy,
}

impl PendingState {
    /// Returns the complete state, read from the device if necessary.
    pub fn whole(self) -> Result<TrainState> {
        Ok(TrainState { planes: self.planes.planes()?, ..self.state })
    }
}

impl Trainer {
    /// Waits for the steps in flight and returns the state of the training.
    pub fn state(&mut self) -> Result<TrainState> {
        self.copied_state()?.whole()
    }

    /// Waits for the steps in flight and copies the training state. On a GPU, the copy stays in device memory, so that
    /// steps continue before it is read.
    pub fn copied_state(&mut self) -> Result<PendingState> {
        self.drain()?;
        self.check_finite()?;
        let print =
            |view: &TrainView| ViewFingerprint::new(&view.name, &view.camera, Some(&view.photo), view.mask.as_ref());
        if self.fingerprints.is_empty() {
            self.fingerprints = self.context.views.iter().map(print).collect();
        }
        let state = TrainState {
            labelgs: env!("CARGO_PKG_VERSION").to_owned(),
            device: device(self.context.engine.gpu()),
            step: self.step,
            updates: self.updates,
            gaussians: self.gaussian_count(),
            frozen: self.context.engine.size().frozen,
            origin: self.context.engine.origin().to_array(),
            labelled_once: self.jobs.votes.have_labelled,
            memory_bounds: self.jobs.growth.bound.by_memory,
            first_count: self.jobs.growth.first_count,
            sizes: self.context.engine.sizes(),
            config: self.context.config.clone(),
            near_planes: self.context.views.iter().map(|view| view.near).collect(),
            views: self.fingerprints.clone(),
            occluders: self.occluders(),
            run: serde_json::Value::Null,
            strategy: StrategyState::from_strategy(&*self.context.strategy),
            shared: self.context.shared.saved_state(),
            planes: Vec::new(),
            path: PathBuf::new(),
        };
        Ok(PendingState { state, planes: self.context.engine.copy_state(self.context.strategy.planes())? })
    }

    /// Searches the state for NaN and infinity, which would make the checkpoint useless. No pass has checked the result
    /// of the last step yet.
    fn check_finite(&mut self) -> Result<()> {
        let found = self.context.engine.nonfinite(self.context.strategy.planes())?;
        let Some((name, row, is_shared)) = found else { return Ok(()) };
        let of = if is_shared { "row" } else { "Gaussian" };
        Err(Error::Numeric {
            quantity: format!("{name} of {of} {row} is not finite, so there is no checkpoint"),
            step: u64::from(self.step),
            view: "of this step or an earlier one".to_owned(),
        })
    }

    /// Resumes a training from `state`, with the same bits on the same device as without the interruption. `dataset`
    /// must be the state's data set.
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
                tracing::warn!(
                    "{} was made with {then}, but this is {now}; results may not be bit-identical",
                    state.path.display()
                );
            }
        }
        let options = options.into();
        let frozen = Region::frozen(options.region.as_ref());
        if frozen != state.frozen {
            let problem = format!("{frozen} frozen Gaussians, but {} are in {}", state.frozen, state.path.display());
            return Err(Error::data(&dataset.root, "", format!("the region has {problem}; start a new run")));
        }
        let size = engine_size(dataset, &state.config, u64::from(state.gaussians))?.with_frozen(frozen);
        if let Some(labels) = size.labels
            && let Some(plane) = state.planes.iter().find(|plane| plane.name == "labels")
            && let Some(label) = plane.data.iter().find(|&&label| label > labels.max_label)
        {
            let problem = format!("is {label}, but the masks have ids up to {}", labels.max_label);
            return Err(Error::data(&state.path, "a label", problem));
        }
        let mut trainer = Self::without_model(gpu, state.config.clone(), dataset, size, options)?;
        trainer.fingerprints = fingerprints;
        trainer.put(&state)?;
        Ok(trainer)
    }

    /// Restores an earlier state of the same training.
    pub fn restore(&mut self, state: &TrainState) -> Result<()> {
        self.context.engine.abandon()?;
        self.in_flight.clear();
        self.put(state)
    }

    fn put(&mut self, state: &TrainState) -> Result<()> {
        self.context.views.set_near_planes(&state.near_planes);
        let odd = |problem| Error::data(&state.path, "strategy", problem);
        state.strategy.restore(&mut *self.context.strategy).map_err(odd)?;
        self.context
            .shared
            .check(state.shared.as_ref())
            .map_err(|problem| Error::data(&state.path, "shared parameters", problem))?;
        match self.context.engine.grow_to(state.sizes) {
            // A smaller device has less room to grow.
            Err(Error::OutOfMemory { .. }) => {}
            other => other?,
        }
        self.context.engine.upload_state(state.gaussians, DVec3::from_array(state.origin), &state.planes)?;
        self.set_occluders(&state.occluders);
        self.order = ViewOrder::after(self.context.config.seed, self.context.views.parts().len(), state.step);
        (self.step, self.updates) = (state.step, state.updates);
        self.jobs.votes.have_labelled = state.labelled_once;
        (self.jobs.growth.bound.by_memory, self.jobs.growth.first_count) = (state.memory_bounds, state.first_count);
        self.sentinel = Default::default();
        Ok(())
    }
}

/// Returns the description of the device: equal descriptions give equal bits.
fn device(gpu: &Gpu) -> String {
    let found = gpu.capabilities();
    let driver = format!("{} {}", found.driver_name, found.driver_info);
    format!("{} ({driver}, {})", found.name, found.subgroup)
}
