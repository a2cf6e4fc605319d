//! Opacities of objects outside of their scene.
//!
//! In its scene, an object shares opacities with what is around it: haze behind other things and Gaussians across a
//! contour cost little there, and show when the object stands alone. A copy has opacities of its own. The object layers
//! of LabelGS fit them: its colours and opacity alone against photos and masks, without the pixels in which something
//! hides it.

use crate::error::{Error, Result, Setting};
use crate::gpu::Gpu;
use crate::scene::{Dataset, Gaussians, Occluders, View};
use crate::scheduler::SchedulerOptions;
use crate::train::{Objective, Occlusion, TrainConfig, Trainer, TrainerOptions};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// Steps of [`refitted`], each of one view.
pub const REFIT_STEPS: u32 = 600;
/// Weight of the alpha term. It is higher than in a scene, because a copy need not look right in the picture of the
/// scene.
const ALPHA_WEIGHT: f32 = 3.0;

/// Returns labelled Gaussians, those of whole objects, with opacities for a picture of these objects alone.
///
/// `views` are training views with photos, and masks with the labels of the Gaussians as ids. `occluders` are those of
/// the scene, by name of the view ([`occluders_by_contour`](crate::label::occlusion::occluders_by_contour)). `watch` is
/// told the number of each step. Labels that no mask has are an error.
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
        let problem = format!("label {label} is in no mask of a training view, so nothing tells its opacity");
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
