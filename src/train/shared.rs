//! Parameters that are no Gaussian's: of the whole scene, such as a background, or of each photo, such as its exposure.
//! They are rows of four numbers that steps train beside the Gaussians, with the same optimiser, in the same checkpoints.
//!
//! A step knows the rows of the scene and those of its photo; all others stay as they are, with their moments. The moments
//! of a row are corrected by the number of updates that it had itself, so that a photo's first step is as long as it should
//! be however late it comes.

use super::strategy::At;
use crate::engine::SharedRow;
use crate::error::{Error, Result};
use crate::pass::{Builder, Extension, Hook};
use serde::{Deserialize, Serialize};
use std::fmt::Debug;
use std::ops::Range;
use std::sync::Arc;

/// How many rows there are: first those of the scene, then those of each training view in turn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SharedLayout {
    /// Rows of the scene.
    pub scene: u32,
    /// Rows of each photo.
    pub photo: u32,
}

impl SharedLayout {
    /// Rows in all.
    pub fn count(self, views: usize) -> u32 {
        self.photo.saturating_mul(views as u32).saturating_add(self.scene)
    }

    /// The rows of a view.
    pub fn of_view(self, view: usize) -> Range<u32> {
        self.count(view)..self.count(view + 1)
    }

    /// The rows that a step on a view knows.
    fn of_step(self, view: usize) -> impl Iterator<Item = u32> {
        (0..self.scene).chain(self.of_view(view))
    }
}

/// What is trained besides the Gaussians. All answers must follow from the arguments: steps are repeated after a buffer had
/// to grow, and a training that is resumed asks again.
pub trait SharedParameters: Debug + Send {
    /// Name in checkpoints.
    fn name(&self) -> &'static str;

    /// Rows.
    fn layout(&self) -> SharedLayout;

    /// What the rows of a view, or of the scene, start with.
    fn start(&self, view: Option<usize>) -> Vec<[f32; 4]>;

    /// Learning rates of the rows of a step, in their order: those of the scene, then those of its photo. A row whose rates
    /// are all 0 rests in this step, with its moments.
    fn rates(&self, at: At) -> Vec<[f32; 4]>;

    /// Passes of every step, asked once. They find the rows of the step in `Buf::STEP_ROWS`, their values in `Buf::SHARED`,
    /// and write their gradients, which are 0 until then, to the same rows of `Buf::V_SHARED`.
    fn extension(&self) -> Arc<dyn Extension>;
}

/// The shared parameters of a training; by default it has none, and does not pay for them.
#[derive(Debug, Default)]
pub struct Shared(Option<Box<dyn SharedParameters>>);

impl<P: SharedParameters + 'static> From<P> for Shared {
    fn from(parameters: P) -> Self {
        Self(Some(Box::new(parameters)))
    }
}

impl Shared {
    fn layout(&self) -> SharedLayout {
        self.0.as_ref().map(|parameters| parameters.layout()).unwrap_or_default()
    }

    /// Rows in all.
    pub(super) fn rows(&self, views: usize) -> u32 {
        self.layout().count(views)
    }

    /// What the rows start with.
    pub(super) fn start(&self, views: usize) -> Result<Vec<[f32; 4]>> {
        let (Some(parameters), SharedLayout { scene, photo }) = (&self.0, self.layout()) else { return Ok(Vec::new()) };
        let mut rows = checked(parameters.start(None), scene, "start")?;
        for view in 0..views {
            rows.extend(checked(parameters.start(Some(view)), photo, "start")?);
        }
        Ok(rows)
    }

    /// The rows of a step.
    pub(super) fn of_step(&self, at: At, view: usize) -> Result<Vec<SharedRow>> {
        let (Some(parameters), layout) = (&self.0, self.layout()) else { return Ok(Vec::new()) };
        let rates = checked(parameters.rates(at), layout.scene + layout.photo, "rates")?;
        Ok(layout.of_step(view).zip(rates).map(|(row, rates)| SharedRow { row, rates }).collect())
    }

    /// The passes of a strategy, and with them those of the parameters.
    pub(super) fn extended(&self, strategy: Arc<dyn Extension>) -> Arc<dyn Extension> {
        match &self.0 {
            None => strategy,
            Some(parameters) => Arc::new(Both { strategy, shared: parameters.extension() }),
        }
    }

    /// The number of these for a strategy's number.
    pub(super) fn passes(&self, of_strategy: u32) -> u32 {
        of_strategy + u32::from(self.0.is_some())
    }

    /// What checkpoints say.
    pub(super) fn kept(&self) -> Option<KeptShared> {
        self.0.as_ref().map(|parameters| KeptShared { name: parameters.name().to_owned(), layout: parameters.layout() })
    }

    /// Refuses what other parameters have left.
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

/// Shared parameters in a checkpoint.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KeptShared {
    /// Their name.
    pub name: String,
    /// Their rows.
    pub layout: SharedLayout,
}

impl std::fmt::Display for KeptShared {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "{} ({} rows of the scene, {} of each photo)", self.name, self.layout.scene, self.layout.photo)
    }
}

/// What a strategy adds, under a number that is one higher, and what shared parameters add.
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
