//! Parameters that belong to no Gaussian: of the whole scene, such as a background, or of each photo, such as its
//! exposure. They are rows of four numbers. Steps train them beside the Gaussians, with the same optimiser, and
//! checkpoints store them.
//!
//! A step uses the rows of the scene and of its photo. All other rows keep their values and moments. The bias
//! correction of a row counts its own updates, so that the first update of a photo has the right length however late it
//! comes.

use super::exposure::Exposure;
use super::strategy::At;
use super::{ExposureMode, TrainConfig};
use crate::engine::SharedRow;
use crate::error::{Error, Result};
use crate::pass::{Builder, Extension, Hook};
use serde::{Deserialize, Serialize};
use std::fmt::Debug;
use std::ops::Range;
use std::sync::Arc;

/// Number of rows: first those of the scene, then those of each training view in turn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SharedLayout {
    /// Number of rows of the scene.
    pub scene: u32,
    /// Number of rows of each photo.
    pub photo: u32,
}

impl SharedLayout {
    /// Returns the total number of rows.
    pub fn count(self, views: usize) -> u32 {
        self.photo.saturating_mul(views as u32).saturating_add(self.scene)
    }

    /// Returns the rows of a view.
    pub fn of_view(self, view: usize) -> Range<u32> {
        self.count(view)..self.count(view + 1)
    }

    /// Returns the rows of a step on a view.
    fn of_step(self, view: usize) -> impl Iterator<Item = u32> {
        (0..self.scene).chain(self.of_view(view))
    }
}

/// Parameters to train besides the Gaussians. All results must be functions of the arguments: a step is repeated after
/// a buffer has grown, and a resumed training calls again.
pub trait SharedParameters: Debug + Send {
    /// Returns the name for checkpoints.
    fn name(&self) -> &'static str;

    /// Returns the number of rows.
    fn layout(&self) -> SharedLayout;

    /// Returns the initial rows of a view, or of the scene for `None`.
    fn start(&self, view: Option<usize>) -> Vec<[f32; 4]>;

    /// Returns the learning rates of the rows of a step: those of the scene, then those of its photo. A row with rates
    /// of 0 keeps its values and moments in this step.
    fn rates(&self, at: At) -> Vec<[f32; 4]>;

    /// Returns the passes of every step; called once. `Buf::STEP_ROWS` has the rows of the step and `Buf::SHARED` their
    /// values. The passes write the gradients to the same rows of `Buf::V_SHARED`, which are 0 before.
    fn extension(&self) -> Arc<dyn Extension>;
}

/// The shared parameters of a training. The default has none and costs nothing.
#[derive(Debug, Default)]
pub struct Shared(Option<Box<dyn SharedParameters>>);

impl<P: SharedParameters + 'static> From<P> for Shared {
    fn from(parameters: P) -> Self {
        Self(Some(Box::new(parameters)))
    }
}

impl Shared {
    /// Returns the parameters, or those that the configuration asks for.
    pub(super) fn or_of(self, config: &TrainConfig) -> Self {
        match (self.0, config.exposure) {
            (None, ExposureMode::On) => Exposure::default().into(),
            (given, _) => Self(given),
        }
    }

    fn layout(&self) -> SharedLayout {
        self.0.as_ref().map(|parameters| parameters.layout()).unwrap_or_default()
    }

    /// Returns the total number of rows.
    pub(super) fn rows(&self, views: usize) -> u32 {
        self.layout().count(views)
    }

    /// Returns the initial rows.
    pub(super) fn start(&self, views: usize) -> Result<Vec<[f32; 4]>> {
        let (Some(parameters), SharedLayout { scene, photo }) = (&self.0, self.layout()) else { return Ok(Vec::new()) };
        let mut rows = checked(parameters.start(None), scene, "start")?;
        for view in 0..views {
            rows.extend(checked(parameters.start(Some(view)), photo, "start")?);
        }
        Ok(rows)
    }

    pub(super) fn of_step(&self, at: At, view: usize) -> Result<Vec<SharedRow>> {
        let (Some(parameters), layout) = (&self.0, self.layout()) else { return Ok(Vec::new()) };
        let rates = checked(parameters.rates(at), layout.scene + layout.photo, "rates")?;
        Ok(layout.of_step(view).zip(rates).map(|(row, rates)| SharedRow { row, rates }).collect())
    }

    /// Joins the passes of a strategy and of the parameters.
    pub(super) fn extended(&self, strategy: Arc<dyn Extension>) -> Arc<dyn Extension> {
        match &self.0 {
            None => strategy,
            Some(parameters) => Arc::new(Both { strategy, shared: parameters.extension() }),
        }
    }

    /// Returns the pass number of [`Both`] for the number of the strategy.
    pub(super) fn passes(&self, of_strategy: u32) -> u32 {
        of_strategy + u32::from(self.0.is_some())
    }

    pub(super) fn kept(&self) -> Option<KeptShared> {
        self.0.as_ref().map(|parameters| KeptShared { name: parameters.name().to_owned(), layout: parameters.layout() })
    }

    pub(super) fn check(&self, kept: Option<&KeptShared>) -> Result<(), String> {
        let own = self.kept();
        let text = |kept: Option<&KeptShared>| kept.map_or("none".to_owned(), ToString::to_string);
        if own.as_ref() == kept {
            return Ok(());
        }
        Err(format!("were {}, now there are {}", text(kept), text(own.as_ref())))
    }
}

fn checked(rows: Vec<[f32; 4]>, wanted: u32, what: &str) -> Result<Vec<[f32; 4]>> {
    match rows.len() == wanted as usize {
        true => Ok(rows),
        false => Err(Error::Bug(format!("{what} of shared parameters: {} rows, {wanted} expected", rows.len()))),
    }
}

/// The entry of the shared parameters in a checkpoint.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KeptShared {
    /// Name of the parameters.
    pub name: String,
    /// Number of their rows.
    pub layout: SharedLayout,
}

impl std::fmt::Display for KeptShared {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "{} ({} rows of the scene, {} of each photo)", self.name, self.layout.scene, self.layout.photo)
    }
}

/// The passes of a strategy, under a number that is one higher, and the passes of the shared parameters.
#[derive(Debug)]
struct Both {
    strategy: Arc<dyn Extension>,
    shared: Arc<dyn Extension>,
}

impl Extension for Both {
    fn extend(&self, passes: u32, hook: Hook, b: &mut Builder) {
        if passes > 1 {
            self.strategy.extend(passes - 1, hook, b);
        }
        self.shared.extend(1, hook, b);
    }

    fn updates_unseen(&self, passes: u32) -> bool {
        passes <= 1 || self.strategy.updates_unseen(passes - 1)
    }
}
