//! Labels for a model that is not being trained, of any trainer.

use super::ballot::{Sweep, Voter, columns_for};
use super::decide::{apply, count};
use super::lift::{Lift, lift};
use crate::engine::{Engine, EngineSize, LabelSize};
use crate::error::Result;
use crate::gpu::Gpu;
use crate::render::{RenderOptions, render};
use crate::scene::{Gaussians, UNLABELLED, View};
use crate::scheduler::SchedulerOptions;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_pcg::Pcg64Mcg;
use std::collections::BTreeSet;
use std::sync::Arc;

/// How votes are counted.
#[derive(Clone, Copy, Debug)]
pub struct Counting {
    /// Near plane, world units.
    pub near: f32,
    /// Pixels so near to a contour of their mask have no say, px.
    pub mask_border: u32,
    /// Counts; from the second on, masks are judged by the outcome of the one before.
    pub rounds: u32,
    /// Gaussians that show in no pixel ask their neighbours.
    pub complete: bool,
    /// Labels of less confidence are taken back at the end.
    pub min_confidence: f32,
}

/// An engine with a model and memory to count votes for so many labels at once ([`columns_for`]).
pub fn vote_engine(gpu: Arc<Gpu>, model: &Gaussians, views: &[&View], columns: u32) -> Result<Engine> {
    let sizes = views.iter().map(|view| (view.camera.width, view.camera.height));
    // No layer is ever sampled, so no id needs a place among them.
    let labels = LabelSize { max_label: 0, layers: 0, vote_columns: columns };
    let size = EngineSize::of_model(model, sizes).with_labels(Some(labels));
    let mut engine = Engine::new(gpu, size, SchedulerOptions::default())?;
    engine.upload_model(model)?;
    Ok(engine)
}

/// Columns for the objects of the masks of some views.
pub fn columns_of(views: &[&View]) -> u32 {
    let objects: BTreeSet<u16> = views.iter().filter_map(|view| view.mask.as_ref()).flat_map(|m| m.objects()).collect();
    columns_for(objects.len())
}

/// Labels by votes. `engine` holds the model; `tick` is told of each round.
pub fn label_by_votes(
    engine: &mut Engine,
    model: &mut Gaussians,
    views: &[&View],
    how: &Counting,
    tick: &mut dyn FnMut(u32),
) -> Result<()> {
    let voters: Vec<Voter> = views.iter().filter_map(|view| Some(Voter::of(view, view.mask.as_ref()?))).collect();
    let sweep = Sweep { near: how.near, border: how.mask_border };
    for round in 0..how.rounds {
        let judges = model.labels.as_deref().filter(|_| round > 0);
        let mut decision = count(engine, &voters, judges, &model.means, sweep, how.complete)?;
        if round + 1 == how.rounds {
            decision.drop_unsure(how.min_confidence);
        }
        apply(model, decision);
        tick(round + 1);
    }
    Ok(())
}

/// Labels by the paper's rule: every view writes its own, one after the other in an order that `seed` decides.
pub fn label_by_lift(
    engine: &mut Engine,
    model: &mut Gaussians,
    views: &[&View],
    (near, how, seed): (f32, Lift, u64),
) -> Result<()> {
    let mut order: Vec<usize> = (0..views.len()).collect();
    order.shuffle(&mut Pcg64Mcg::seed_from_u64(seed));
    let mut labels = vec![UNLABELLED; model.len()];
    for view in order.into_iter().map(|index| views[index]) {
        let Some(mask) = &view.mask else { continue };
        let rendered = render(engine, &view.camera, &RenderOptions::of_labels(near))?;
        lift(&mut labels, &model.means, &view.camera.relative_to(model.origin), &rendered, mask, how);
    }
    model.labels = Some(labels);
    model.label_confidence = None;
    Ok(())
}
