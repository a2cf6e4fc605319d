//! Refits the opacities of objects that are extracted from their scene.
//!
//! In its scene, haze behind other things and Gaussians across a contour cost little, but they show when the object
//! stands alone. A copy of the object can have its own opacities. LabelGS' object layers fit them: colours and opacity
//! of the object alone are compared with photos and masks, except where something hides the object.

use crate::error::{Error, Result, Setting};
use crate::gpu::Gpu;
use crate::scene::{Dataset, Gaussians, Occluders, View};
use crate::scheduler::SchedulerOptions;
use crate::train::{Objective, Occlusion, TrainConfig, Trainer, TrainerOptions};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// Steps of [`refitted`], one view each.
pub const REFIT_STEPS: u32 = 600;
/// Weight of the alpha term. It is higher than in a scene, because a copy need not look right within the scene.
const ALPHA_WEIGHT: f32 = 3.0;

/// Returns the Gaussians of whole objects with opacities for rendering these objects alone.
///
/// `views` are training views with photos, and masks with the labels of the Gaussians as ids. `occluders` are the
/// scene's occluders, by name of the view ([`occluders_by_contour`](crate::label::occlusion::occluders_by_contour)).
/// `watch` receives the number of each step. Fails if a label is in no mask.
pub fn refitted(
    gpu: &Arc<Gpu>,
    objects: &Gaussians,
    (views, occluders): (&[&View], &BTreeMap<String, Occluders>),
    near: f32,
    scheduler: SchedulerOptions,
    watch: &mut dyn FnMut(u32),
) -> Result<Gaussians> {
    let labels: BTreeSet<u32> = objects.labels.iter().flatten().copied().collect();
    let shown = |view: &View| view.mask.as_ref().map(|mask| mask.objects()).unwrap_or_default();
    let is_chosen = |id: &u16| labels.contains(&u32::from(*id));
    let train: Vec<View> =
        views.iter().filter(|view| shown(view).iter().any(is_chosen)).map(|&view| view.clone()).collect();
    let known: BTreeSet<u32> = train.iter().flat_map(shown).map(u32::from).collect();
    if let Some(label) = labels.difference(&known).next() {
        let problem = format!("label {label} is in no mask of a training view, so its opacity cannot be fitted");
        return Err(Error::usage(Setting("masks"), problem));
    }
    let config = TrainConfig {
        iterations: REFIT_STEPS,
        start_size: Some(1.0),
        label_from: Some(0),
        layer_every: Some(1),
        label_alpha: ALPHA_WEIGHT,
        occlusion: Occlusion::None,
        ..TrainConfig::for_finished(objects, near)
    };
    let dataset = Dataset { train, ..Dataset::default() };
    let options = TrainerOptions { objective: Objective::OBJECT_OPACITIES, ..scheduler.into() };
    let mut trainer = Trainer::new(Arc::clone(gpu), config, &dataset, objects, options)?;
    trainer.set_occluders(occluders);
    trainer.show_only(is_chosen);
    for step in 1..=REFIT_STEPS {
        trainer.step()?;
        watch(step);
    }
    Ok(Gaussians { opacities: trainer.model()?.opacities, ..objects.clone() })
}
