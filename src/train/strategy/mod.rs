//! Strategies that change the set of Gaussians between steps: [`StrategyKind`] names them. To add one, implement
//! [`Strategy`] and pass it in [`TrainerOptions`](super::TrainerOptions).

pub mod adc;
pub(crate) mod budget;
pub(crate) mod exchange;
pub(crate) mod mcmc;
pub mod passes;
pub mod population;
pub mod weights;

use adc::AdcStrategy;
use budget::BudgetStrategy;
use mcmc::McmcStrategy;
pub(crate) use population::GaussianLimit;
pub use population::{DensifyCounts, Population};

use super::{StrategyKind, TrainConfig};
use crate::error::Result;
use crate::pass::Extension;
use crate::pass::buffers::TABLE;
use crate::scheduler::plan::Buf;
use crate::shaders::structs::StepUniforms;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::fmt::Debug;
use std::sync::Arc;

/// Smallest opacity: fainter Gaussians are pruned or relocated (3DGS, 3DGS-MCMC).
pub(crate) const OPACITY_MIN: f32 = 0.005;

/// Makes a built-in strategy.
pub fn make(kind: StrategyKind) -> Box<dyn Strategy> {
    match kind {
        StrategyKind::Budget => Box::new(BudgetStrategy),
        StrategyKind::Mcmc => Box::new(McmcStrategy),
        StrategyKind::Adc => Box::new(AdcStrategy),
    }
}

/// The step for which a strategy decides.
#[derive(Clone, Copy, Debug)]
pub struct StepContext<'a> {
    /// Step, from 1.
    pub step: u32,
    /// The configuration.
    pub config: &'a TrainConfig,
    /// Extent of the scene, world units.
    pub extent: f64,
}

impl StepContext<'_> {
    /// Returns true for the last step of the run and beyond it.
    pub fn is_last(&self) -> bool {
        self.step >= self.config.iterations
    }
}

/// Rules for the set of Gaussians. All results must be functions of the arguments and of the [kept](Strategy::keep)
/// state, because steps are repeated after a buffer has grown, and a resumed training calls these functions again.
pub trait Strategy: Debug + Send {
    /// Returns the name for checkpoints.
    fn name(&self) -> &'static str;

    /// Returns true if the strategy acts after this step. The trainer then waits for the steps in flight.
    fn acts_after(&self, _at: StepContext) -> bool {
        false
    }

    /// Acts after the step.
    fn act(&mut self, _at: StepContext, _population: &mut Population) -> Result<()> {
        Ok(())
    }

    /// Returns true if the step updates the parameters.
    fn updates(&self, _at: StepContext) -> bool {
        true
    }

    /// Returns true if the depth of the model is unreliable right after this step. Votes and occluders are then skipped
    /// until their next turn.
    fn blurs_depth_after(&self, _at: StepContext) -> bool {
        false
    }

    /// Sets uniforms of a step.
    fn uniforms(&self, _at: StepContext, _to: &mut StepUniforms) {}

    /// Returns the passes to add to steps; called once. By default, those of the built-in strategies.
    fn extension(&self) -> Arc<dyn Extension> {
        Arc::new(passes::StrategyPasses)
    }

    /// Returns the variant of its passes for a step, for [`Extension::extend`]; 0 for a step without its passes.
    fn passes(&self, _at: StepContext) -> u32 {
        0
    }

    /// Returns the float buffers to store in checkpoints besides parameters, moments and labels.
    fn planes(&self) -> &'static [Buf] {
        &[]
    }

    /// Returns further state to store in checkpoints.
    fn keep(&self) -> Value {
        Value::Null
    }

    /// Restores the stored state, or returns what is wrong with it.
    fn restore(&mut self, _kept: &Value) -> Result<(), String> {
        Ok(())
    }
}

/// Changes nothing.
impl Strategy for () {
    fn name(&self) -> &'static str {
        "none"
    }
}

/// The state of a strategy in a checkpoint.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StrategyState {
    /// Name of the strategy.
    pub name: String,
    /// Names of the strategy's planes.
    pub planes: Vec<String>,
    /// Other state.
    pub value: Value,
}

impl StrategyState {
    /// Returns the state of a strategy.
    pub fn from_strategy(strategy: &dyn Strategy) -> Self {
        let planes = strategy.planes().iter().map(|buf| TABLE[buf.index()].name.to_owned()).collect();
        Self { name: strategy.name().to_owned(), planes, value: strategy.keep() }
    }

    /// Restores a strategy of the same name and planes.
    pub fn restore(&self, strategy: &mut dyn Strategy) -> Result<(), String> {
        let own = Self::from_strategy(strategy);
        if (&own.name, &own.planes) != (&self.name, &self.planes) {
            return Err(format!("was made with the strategy {}, not {}", self.name, own.name));
        }
        strategy.restore(&self.value)
    }
}
