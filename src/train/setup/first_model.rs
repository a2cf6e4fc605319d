//! The model that a training starts from.

use super::{engine_size, for_photos};
use crate::error::{Result, Setting};
use crate::scene::{Dataset, Gaussians, Point};
use crate::scenes::init;
use crate::train::{StrategyKind, TrainConfig};
use std::borrow::Cow;

/// Random Gaussians for a scene without points: at most this many, and this share of the budget, so that growth chooses
/// the places of the others.
const RANDOM_GAUSSIANS_MAX: u64 = 50_000;
const RANDOM_BUDGET_SHARE_MAX: f64 = 0.25;
/// Most points, in budgets: more Gaussians than that show little more and cost as much time each.
const POINT_BUDGETS_MAX: u64 = 4;
/// First opacity with the strategy mcmc, and factor of the first deviations. 3DGS-MCMC has 0.5 and 0.1; its long runs
/// have the time to grow.
const MCMC_OPACITY: f32 = 0.5;
const MCMC_SIZE_FACTOR: f32 = 0.3;

/// Makes the initial Gaussians of a training: at the points of the scene or at random places, and far ones. Points
/// beyond `max_gaussians`, or far beyond the budget without it, are thinned evenly; half of `max_gaussians` is left for
/// growth.
pub fn first_model(dataset: &Dataset, config: &TrainConfig) -> Result<Gaussians> {
    let random = match config.strategy {
        StrategyKind::Adc => RANDOM_GAUSSIANS_MAX,
        StrategyKind::Budget | StrategyKind::Mcmc => RANDOM_GAUSSIANS_MAX
            .min((RANDOM_BUDGET_SHARE_MAX * for_photos(config, dataset)?.budget as f64) as u64)
            .max(1),
    };
    let mut model = init::first_gaussians(dataset, &points(dataset, config)?, config.seed, random as usize)?;
    init::add_far_gaussians(&mut model, dataset, config.far_points)?;
    if config.strategy == StrategyKind::Mcmc {
        model.opacities.fill((MCMC_OPACITY / (1.0 - MCMC_OPACITY)).ln());
        model.scales.iter_mut().flatten().for_each(|scale| *scale += MCMC_SIZE_FACTOR.ln());
    }
    thin(&mut model, config.max_gaussians);
    Ok(model)
}

/// Returns the points of the scene for the first Gaussians: all, or as many as their number may be. More would cost
/// time and memory, and the photos have too few pixels to tell them apart.
fn points<'a>(dataset: &'a Dataset, config: &TrainConfig) -> Result<Cow<'a, [Point]>> {
    let (all, far) = (dataset.points.len() as u64, u64::from(config.far_points));
    let (width, height) = engine_size(dataset, config, 0)?.image;
    let budget = config.full_budget((width, height));
    let (most, why) = match (config.max_gaussians, budget) {
        (0, None) => return Ok(Cow::Borrowed(&dataset.points)),
        (0, Some(budget)) if config.budget > 0 => {
            (budget.saturating_mul(POINT_BUDGETS_MAX), format!("{} is {budget}", Setting("budget")))
        }
        (0, Some(budget)) => {
            let why = format!("photos of {width} x {height} px ask for {budget} Gaussians");
            (budget.saturating_mul(POINT_BUDGETS_MAX), why)
        }
        (bound, _) if all <= bound => return Ok(Cow::Borrowed(&dataset.points)),
        (bound, budget) => {
            // Without growth, far ones alone need room.
            let room = if budget.is_some_and(|budget| budget < bound) { far.min(bound / 2) } else { bound / 2 };
            (bound - room, format!("{} is {bound}", Setting("max_gaussians")))
        }
    };
    if all <= most {
        return Ok(Cow::Borrowed(&dataset.points));
    }
    let enough = all + far;
    tracing::warn!(
        "{all} points, and {why}: {most} of them are used, spread evenly; {} uses all",
        Setting("max_gaussians").to(enough)
    );
    Ok(Cow::Owned(init::thinned(&dataset.points, most as usize)))
}

/// Fits a trained model and the settings to each other: the training goes on with all that the model has. The schedules
/// of a new model, which begin with small pictures and one band of colour, would first spoil it.
pub(crate) fn go_on_from(mut model: Gaussians, dataset: &Dataset, config: &TrainConfig) -> (Gaussians, TrainConfig) {
    if model.labels.is_some() && dataset.train.iter().all(|view| view.mask.is_none()) {
        tracing::warn!("the labels of the first model are lost, because the scene has no masks");
        (model.labels, model.label_confidence) = (None, None);
    }
    thin(&mut model, config.max_gaussians);
    let config = TrainConfig {
        start_size: config.start_size.or(Some(1.0)),
        sh_degree_interval: config.sh_degree_interval.or(Some(1)),
        antialias: config.antialias || model.antialiased,
        ..config.clone()
    };
    (model, config)
}

fn thin(model: &mut Gaussians, bound: u64) {
    let count = model.len() as u64;
    if bound > 0 && count > bound {
        tracing::warn!(
            "{count} initial Gaussians, and {} is {bound}: every {:.1}-th is used",
            Setting("max_gaussians"),
            count as f64 / bound as f64
        );
        // Keep row i if `i * bound / count` steps up there.
        *model = model.filtered(|row| row as u64 * bound / count != (row as u64 + 1) * bound / count);
    }
}
