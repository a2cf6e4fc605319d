//! What happens to the Gaussians besides the optimiser: when, and what. [`DefaultStrategy`] is that of 3DGS; others
//! implement [`Strategy`], and go into a [`TrainerOptions`](super::TrainerOptions).

pub(crate) mod default;
pub(crate) mod population;

pub(crate) use default::DefaultStrategy;
pub use population::Densified;
pub(crate) use population::{Bound, Population};

use super::TrainConfig;
use crate::error::Result;
use crate::pass::Extension;
use crate::scheduler::plan::{Buf, TABLE};
use crate::shaders::structs::StepUniforms;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::fmt::Debug;
use std::sync::Arc;

/// A step as a strategy sees it.
#[derive(Clone, Copy, Debug)]
pub struct At<'a> {
    /// Step, from 1.
    pub step: u32,
    /// The configuration.
    pub config: &'a TrainConfig,
    /// Extent of the scene, world units.
    pub extent: f64,
}

impl At<'_> {
    /// True for the last step of the run, or beyond it.
    pub fn is_last(&self) -> bool {
        self.step >= self.config.iterations
    }
}

/// Densification in the widest sense. All answers must follow from the arguments and from what is [kept](Strategy::keep):
/// steps are repeated after a buffer had to grow, and a training that is resumed asks again.
pub trait Strategy: Debug + Send {
    /// Name in checkpoints.
    fn name(&self) -> &'static str;

    /// True if it acts after this step. Steps in flight are waited for then.
    fn acts_after(&self, at: At) -> bool;

    /// Acts after such a step.
    fn act(&mut self, at: At, population: &mut Population) -> Result<()>;

    /// True if a step updates the parameters.
    fn updates(&self, _at: At) -> bool {
        true
    }

    /// True if the model does not show what is in front right after this step: votes and occluders wait for their next
    /// turn.
    fn blurs_depth_after(&self, _at: At) -> bool {
        false
    }

    /// Sets its uniforms of a step.
    fn uniforms(&self, _at: At, _to: &mut StepUniforms) {}

    /// Passes that it adds to steps; asked once.
    fn extension(&self) -> Arc<dyn Extension> {
        Arc::new(())
    }

    /// Which of its passes a step has; it is handed to [`Extension::extend`]. 0: the step is recorded without them.
    fn passes(&self, _at: At) -> u32 {
        0
    }

    /// Buffers of the model, besides parameters, moments and labels, that checkpoints hold. Their words are floats.
    fn planes(&self) -> &'static [Buf] {
        &[]
    }

    /// What else checkpoints hold.
    fn keep(&self) -> Value {
        Value::Null
    }

    /// Goes on from what was kept, or says what is wrong with it.
    fn restore(&mut self, _kept: &Value) -> Result<(), String> {
        Ok(())
    }
}

/// A strategy in a checkpoint.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Kept {
    /// Its name.
    pub name: String,
    /// Names of its planes.
    pub planes: Vec<String>,
    /// What else it keeps.
    pub value: Value,
}

impl Default for Kept {
    fn default() -> Self {
        Self::of(&DefaultStrategy)
    }
}

impl Kept {
    /// What a strategy keeps.
    pub fn of(strategy: &dyn Strategy) -> Self {
        let planes = strategy.planes().iter().map(|buf| TABLE[buf.index()].name.to_owned()).collect();
        Self { name: strategy.name().to_owned(), planes, value: strategy.keep() }
    }

    /// True for [`DefaultStrategy`], which checkpoints do not mention.
    pub fn is_default(&self) -> bool {
        *self == Self::default()
    }

    /// Gives it back to a strategy of the same name and planes.
    pub fn restore(&self, strategy: &mut dyn Strategy) -> Result<(), String> {
        let own = Self::of(strategy);
        if (&own.name, &own.planes) != (&self.name, &self.planes) {
            return Err(format!("was made with the strategy {}, not {}", self.name, own.name));
        }
        strategy.restore(&self.value)
    }
}
