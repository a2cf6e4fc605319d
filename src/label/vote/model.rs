//! Labels a trained model of any trainer.

use super::ballot::{Sweep, Voter, columns_for};
use super::decide::{apply, count, lower_outside};
use super::lift::lift;
use crate::engine::{Engine, EngineSize, LabelSize};
use crate::error::Result;
use crate::gpu::Gpu;
use crate::render::{RenderOptions, render};
use crate::scene::{Gaussians, Pixels, UNLABELLED, View};
use crate::scheduler::SchedulerOptions;
use crate::stage::Stage;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_pcg::Pcg64Mcg;
use std::collections::BTreeSet;
use std::sync::Arc;

/// Rounds of voting. In the second round, masks that disagree with the first result count less.
pub(crate) const VOTE_ROUNDS: u32 = 2;
/// Seed of the view order for the paper's rule.
const SEED: u64 = 0;

/// The options for counting votes.
#[derive(Clone, Copy, Debug)]
pub struct VoteOptions {
    /// Near plane, world units.
    pub near: f32,
    /// Width of the band along mask contours without votes, px.
    pub mask_border: u32,
    /// Labels with less confidence become 0 at the end, 0 to 1.
    pub min_confidence: f32,
}

/// Makes an engine with a model and memory for `columns` vote columns ([`columns_of`]).
pub fn vote_engine(gpu: Arc<Gpu>, model: &Gaussians, views: &[&View], columns: u32) -> Result<Engine> {
    limited_vote_engine(gpu, model, views, columns, SchedulerOptions::default())
}

/// Same as [`vote_engine`] with scheduler options, such as a memory limit.
pub(crate) fn limited_vote_engine(
    gpu: Arc<Gpu>,
    model: &Gaussians,
    views: &[&View],
    columns: u32,
    options: SchedulerOptions,
) -> Result<Engine> {
    let sizes = views.iter().map(|view| (view.camera.width, view.camera.height));
    let labels = LabelSize { vote_columns: columns, ..LabelSize::default() };
    let size = EngineSize::for_model(model, sizes).with_labels(Some(labels));
    let mut engine = Engine::new(gpu, size, options)?;
    engine.upload_model(model)?;
    Ok(engine)
}

/// Returns the objects in the masks of views.
pub(crate) fn objects_of(views: &[&View]) -> BTreeSet<u16> {
    views.iter().filter_map(|view| view.mask.as_ref()).flat_map(Pixels::objects).collect()
}

/// Returns the number of vote columns for the objects in the masks of views.
pub fn columns_of(views: &[&View]) -> u32 {
    columns_for(objects_of(views).len())
}

/// Labels a model by votes. `engine` holds the model; `tick` is called in each round.
pub fn label_by_votes(
    engine: &mut Engine,
    model: &mut Gaussians,
    views: &[&View],
    how: &VoteOptions,
    tick: &mut dyn FnMut(u32),
) -> Result<()> {
    let voters = Voter::for_views(views);
    let sweep = Sweep::new(how.near, how.mask_border);
    for round in 0..VOTE_ROUNDS {
        let mut decision = count(engine, &voters, round > 0, &model.means, sweep)?;
        if round + 1 == VOTE_ROUNDS {
            lower_outside(engine, &voters, sweep, &mut decision)?;
            decision.drop_unsure(how.min_confidence);
        }
        engine.set_labels(&decision.labels)?;
        apply(model, decision);
        tick(round + 1);
    }
    Ok(())
}

/// Labels a model by the paper's rule: every view writes its labels, in random order.
pub fn label_by_lift(engine: &mut Engine, model: &mut Gaussians, views: &[&View], near: f32) -> Result<()> {
    let mut order: Vec<usize> = (0..views.len()).collect();
    order.shuffle(&mut Pcg64Mcg::seed_from_u64(SEED));
    let mut labels = vec![UNLABELLED; model.len()];
    let stage = Stage::new("lifting labels", views.len());
    for view in order.into_iter().map(|index| views[index]) {
        stage.count();
        let Some(mask) = view.mask()? else { continue };
        let rendered = render(engine, &view.camera, &RenderOptions::for_main(near))?;
        lift(&mut labels, &model.means, &view.camera.relative_to(model.origin), &rendered, &mask);
    }
    model.labels = Some(labels);
    model.label_confidence = None;
    Ok(())
}
