//! The initial model of a training.

use super::{engine_size, for_photos};
use crate::error::{Result, Setting};
use crate::scene::{Dataset, Gaussians, Point};
use crate::scenes::init;
use crate::train::{StrategyKind, TrainConfig};
use std::borrow::Cow;

/// Most random Gaussians in a scene without points.
const RANDOM_GAUSSIANS_MAX: u64 = 50_000;
/// Largest share of the budget for them, so that growth chooses the positions of the others.
const RANDOM_BUDGET_SHARE_MAX: f64 = 0.25;
/// Most initial points, in multiples of the budget: more Gaussians add little but cost time.
const POINT_BUDGETS_MAX: u64 = 4;
/// Initial opacity with the strategy mcmc, as in 3DGS-MCMC.
const MCMC_OPACITY: f32 = 0.5;
/// Factor of the initial deviations. 3DGS-MCMC has 0.1, but its long runs have time to grow.
const MCMC_SIZE_FACTOR: f32 = 0.3;

/// Makes the initial Gaussians: at the scene's points or at random positions, plus far ones. Points are thinned evenly
/// to half of `max_gaussians`, which leaves room for growth, or else to a multiple of the budget.
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

/// Returns the scene's points for the initial Gaussians: all, or as many as allowed. More would cost time and memory,
/// and the photos have too few pixels to resolve them.
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
            let why = format!("photos of {width} x {height} px need {budget} Gaussians");
            (budget.saturating_mul(POINT_BUDGETS_MAX), why)
        }
        (bound, _) if all <= bound => return Ok(Cow::Borrowed(&dataset.points)),
        (bound, budget) => {
            // Without growth, only far Gaussians need room.
            let room = if budget.is_some_and(|budget| budget < bound) { far.min(bound / 2) } else { bound / 2 };
            (bound - room, format!("{} is {bound}", Setting("max_gaussians")))
        }
    };
    if all <= most {
        return Ok(Cow::Borrowed(&dataset.points));
    }
    let enough = all + far;
    tracing::warn!(
        "{all} points, but {why}; using {most} of them, evenly spread; {} uses all",
        Setting("max_gaussians").to(enough)
    );
    Ok(Cow::Owned(init::thinned(&dataset.points, most as usize)))
}

/// Adapts a trained model and the settings to each other, so that training continues with the full model. The schedules
/// for new models, which start with small photos and degree 0, would degrade it first.
pub(crate) fn go_on_from(mut model: Gaussians, dataset: &Dataset, config: &TrainConfig) -> (Gaussians, TrainConfig) {
    if model.labels.is_some() && dataset.train.iter().all(|view| view.mask.is_none()) {
        tracing::warn!("the initial model's labels are dropped, because the scene has no masks");
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
            "{count} initial Gaussians, but {} is {bound}; using every {:.1}-th",
            Setting("max_gaussians"),
            count as f64 / bound as f64
        );
        // Keep row i if `i * bound / count` increases there.
        *model = model.filtered(|row| row as u64 * bound / count != (row as u64 + 1) * bound / count);
    }
}
