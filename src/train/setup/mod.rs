//! Sets up a training: options, sizes, views.

pub(in crate::train) mod first_model;
pub(crate) mod near_plane;
pub mod region;

use crate::engine::{Engine, EngineSize, LabelSize};
use crate::error::{Error, Result, Setting};
use crate::gpu::Gpu;
use crate::label::vote::ballot::columns_for;
use crate::pass::KernelShape;
use crate::scene::pixels::PixelSource;
use crate::scene::{Dataset, Gaussians, LabelMap, Pixels, View, parallel};
use crate::scheduler::SchedulerOptions;
use crate::train::input::known_depths::KnownDepths;
use crate::train::input::part::PhotoPart;
use crate::train::input::step_input::{self, TrainView};
use crate::train::shared::SharedSet;
use crate::train::strategy::Strategy;
use crate::train::{LabelRule, Moments, Objective, TrainConfig};
use region::Region;
use std::collections::BTreeSet;
use std::sync::Arc;

/// Options of a trainer besides its configuration.
#[derive(Debug, Default)]
pub struct TrainerOptions {
    /// Shape of the kernels; `None` takes the device's default.
    pub shape: Option<KernelShape>,
    /// Options of the engine.
    pub scheduler: SchedulerOptions,
    /// Trained parameters and losses.
    pub objective: Objective,
    /// The strategy for the number of Gaussians; `None` takes that of objective and configuration.
    pub strategy: Option<Box<dyn Strategy>>,
    /// Parameters of the scene or of photos.
    pub shared: SharedSet,
    /// The region of the scene to train; `None` for the whole scene.
    pub region: Option<Region>,
    /// Known depths of each training photo; empty with a weight of 0.
    pub depths: Vec<KnownDepths>,
}

impl From<SchedulerOptions> for TrainerOptions {
    fn from(scheduler: SchedulerOptions) -> Self {
        Self { scheduler, ..Self::default() }
    }
}

/// Returns the sizes for training on a data set.
pub fn engine_size(dataset: &Dataset, config: &TrainConfig, gaussians: u64) -> Result<EngineSize> {
    let sizes = dataset.train.iter().chain(&dataset.test).map(|view| (view.camera.width, view.camera.height));
    let image = sizes.reduce(|a, b| (a.0.max(b.0), a.1.max(b.1)));
    let image = image.ok_or_else(|| Error::data(&dataset.root, "", "the scene has no training views"))?;
    let of_views: Vec<Vec<u16>> =
        dataset.train.iter().filter_map(|view| view.mask.as_ref().map(Pixels::objects)).collect();
    let most = of_views.iter().map(Vec::len).max();
    let objects = of_views.concat();
    let labels = objects.iter().max().map(|&max_label| LabelSize {
        max_label: u32::from(max_label),
        layers: if config.layer_every() > 0 { config.label_samples.min(most.unwrap_or(0) as u32) } else { 0 },
        vote_columns: match config.label_rule {
            LabelRule::Votes => columns_for(objects.iter().collect::<BTreeSet<_>>().len()),
            LabelRule::Main => 0,
        },
    });
    let size = EngineSize::new(gaussians, image).for_training().with_labels(labels).with_depths(config.has_depths());
    Ok(size.with_half_moments(config.moments == Moments::Half))
}

/// Decides settings that depend on the photos.
pub(in crate::train) fn for_photos(config: &TrainConfig, dataset: &Dataset) -> Result<TrainConfig> {
    Ok(config.for_size(engine_size(dataset, config, 0)?.image))
}

/// Returns the initial sizes: for twice the initial Gaussians, or for exactly that number if memory is short.
pub(crate) fn start_size(
    gpu: &Gpu,
    dataset: &Dataset,
    config: &TrainConfig,
    (model, region): (&Gaussians, Option<&Region>),
    options: SchedulerOptions,
) -> Result<EngineSize> {
    region.map_or(Ok(()), |region| region.check(model))?;
    let gaussians = model.len() as u64;
    if let Some(advice) = config.moments.advice(gaussians.max(config.budget)).filter(|_| !gpu.is_cpu()) {
        tracing::info!("moments: {advice}");
    }
    let most = if config.max_gaussians > 0 { config.max_gaussians } else { u64::MAX };
    let roomy =
        engine_size(dataset, config, (gaussians * 2).min(most).max(gaussians))?.with_frozen(Region::frozen(region));
    match Engine::predict(gpu, &roomy, options) {
        Err(Error::OutOfMemory { .. }) => {
            let least = EngineSize { gaussians, ..roomy };
            propose_half(gpu, &least, options).map_or(Ok(least), Err)
        }
        other => other.map(|_| roomy),
    }
}

/// Improves the error of sizes that do not fit, if they fit with packed moments.
fn propose_half(gpu: &Gpu, size: &EngineSize, options: SchedulerOptions) -> Option<Error> {
    let error = Engine::predict(gpu, size, options).err()?;
    let fits = !size.half_moments && Engine::predict(gpu, &size.with_half_moments(true), options).is_ok();
    match error {
        Error::OutOfMemory { what, needed, limit_name, limit, cure } if fits => {
            let cure = format!("it fits with {}; or {cure}", Setting("moments").to("half"));
            Some(Error::OutOfMemory { what, needed, limit_name, limit, cure })
        }
        _ => None,
    }
}

/// Makes the training views of a data set, and their parts of at most `most` rows. `depths` has the known depths of
/// each view, or is empty.
pub(in crate::train) fn train_views(
    dataset: &Dataset,
    depths: Vec<KnownDepths>,
    border: u32,
    most: Option<u32>,
) -> Result<(Vec<TrainView>, Vec<PhotoPart>)> {
    let views = &dataset.train;
    let of = |index: usize| train_view((index, &views[index]), border, most);
    let (mut whole, mut parts) = (Vec::new(), Vec::new());
    for found in parallel::map_bounded("preparing photos", views.len(), parallel::views_at_once(views.iter()), of) {
        let (view, of_view) = found?;
        whole.push(view);
        parts.extend(of_view);
    }
    whole.iter_mut().zip(depths).for_each(|(view, depths)| view.depths = depths);
    Ok((whole, parts))
}

fn train_view((index, view): (usize, &View), border: u32, most: Option<u32>) -> Result<(TrainView, Vec<PhotoPart>)> {
    let (pixels, mask) = (view.photo()?, view.mask()?);
    let photo = view.photo.clone().unwrap_or_else(|| pixels.clone().into());
    let objects = mask.as_deref().map(LabelMap::objects).unwrap_or_default();
    let labels = mask.as_ref().map(|mask| step_input::view_labels(mask, border)).unwrap_or_default();
    let parts = PhotoPart::split((index, &view.camera), &pixels, mask.as_deref(), &labels, most);
    let view_labels = match &view.mask {
        Some(mask) if !mask.is_held() => {
            Pixels::from_source(Arc::new(LazyViewLabels { mask: mask.clone(), border }), Default::default())
        }
        _ => labels.into(),
    };
    let view = TrainView {
        name: view.name.clone(),
        camera: view.camera.clone(),
        near: 0.0,
        photo,
        mask: view.mask.clone(),
        objects,
        view_labels,
        depths: KnownDepths::default(),
        occluders: Default::default(),
    };
    Ok((view, parts))
}

/// Device layout of a mask that is not in memory, made on demand.
#[derive(Debug)]
struct LazyViewLabels {
    mask: Pixels<LabelMap>,
    border: u32,
}

impl PixelSource<Vec<u32>> for LazyViewLabels {
    fn make(&self) -> Result<Arc<Vec<u32>>> {
        Ok(Arc::new(step_input::view_labels(&*self.mask.get()?, self.border)))
    }

    fn at_once(&self) -> usize {
        self.mask.at_once()
    }
}
