//! What the verbs that render share: the device, the scene, its views.

use super::args::SceneArgs;
use super::context::Context;
use crate::engine::{Engine, EngineSize};
use crate::error::{Error, Result};
use crate::gpu::{Gpu, GpuOptions, PipelineStore};
use crate::io::pipeline_file::PipelineFolder;
use crate::io::{self, LoadOptions};
use crate::run::Settings;
use crate::scene::{Dataset, Gaussians, View};
use crate::scheduler::SchedulerOptions;
use crate::train::near::NEAR;
use crate::verify::selftest;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The near plane to render a model with, world units: what was typed, else what the run of the model was trained with
/// (its config.toml), else 0.2 (3DGS).
pub fn near_plane(model: &Path, typed: Option<f32>) -> Result<f32> {
    match typed {
        Some(near) => Ok(near),
        None => Ok(Settings::of_model(model)?.map_or(NEAR, |settings| settings.train.near)),
    }
}

/// Opens the device that was asked for and says which it is. One whose subgroups may not be what it tells has to prove
/// itself first.
pub(crate) fn open_gpu(context: &Context) -> Result<Arc<Gpu>> {
    let gpu = open_untried(context)?;
    if !gpu.capabilities().subgroup.is_pinned {
        tracing::info!("this device does not let subgroup sizes be chosen: a step is tried first");
        selftest::canary(&gpu)?;
    }
    Ok(gpu)
}

/// The same without proof.
pub(crate) fn open_untried(context: &Context) -> Result<Arc<Gpu>> {
    let mut options = GpuOptions::from_env()?;
    if let Some(device) = &context.global.device {
        options.device = Some(device.clone());
    }
    options.pipelines = PipelineFolder::of_user().map(|folder| Arc::new(folder) as Arc<dyn PipelineStore>);
    let gpu = Gpu::new(&options)?;
    context.listen(&gpu);
    let found = gpu.capabilities();
    let cpu = if gpu.is_cpu() { ", a processor: expect it to be slower than a graphics card" } else { "" };
    tracing::info!("device: {} ({}){cpu}", found.name, found.driver_info);
    Ok(gpu)
}

/// Reads a scene and logs what a person should know about it.
pub(crate) fn open_scene(
    path: &Path,
    reading: &SceneArgs,
    masks: Option<PathBuf>,
    background: [f32; 3],
    photos: bool,
) -> Result<Dataset> {
    let test_every = Some(reading.test_every()).filter(|&every| every > 0);
    let (max_resolution, base) = (reading.max_resolution, LoadOptions::default());
    let options = LoadOptions { masks, max_resolution, test_every, background, photos, ..base };
    io::open_logged(path, &reading.read.into_options(options))
}

/// The views that `test`, `train`, `all` or a list of names means.
pub(crate) fn pick_views<'a>(dataset: &'a Dataset, which: &str) -> Result<Vec<&'a View>> {
    let views: Vec<&View> = match which {
        "test" => dataset.test.iter().collect(),
        "train" => dataset.train.iter().collect(),
        "all" => dataset.all(),
        names => names.split(',').map(|name| find_view(dataset, name.trim())).collect::<Result<_>>()?,
    };
    if views.is_empty() {
        return Err(Error::usage(
            "--views",
            format!("the scene has no {which} views; say --views all, or see --test-every"),
        ));
    }
    Ok(views)
}

/// The view of a name, with or without its extension.
pub(crate) fn find_view<'a>(dataset: &'a Dataset, name: &str) -> Result<&'a View> {
    let all = dataset.all();
    let found =
        all.iter().find(|view| view.name == name || view.stem() == name || without_extension(&view.name) == name);
    found.copied().ok_or_else(|| {
        let some: Vec<&str> = all.iter().take(8).map(|view| view.name.as_str()).collect();
        Error::usage(
            "name of a view",
            format!("there is no view {name}; the scene has {} ... ({} in all)", some.join(", "), all.len()),
        )
    })
}

fn without_extension(name: &str) -> String {
    Path::new(name).with_extension("").to_string_lossy().into_owned()
}

/// An engine that renders `model`, which is not yet on it, at up to the largest of `sizes`.
pub(crate) fn render_engine(
    gpu: Arc<Gpu>,
    model: &Gaussians,
    sizes: impl Iterator<Item = (u32, u32)>,
) -> Result<Engine> {
    Engine::new(gpu, EngineSize::of_model(model, sizes), SchedulerOptions::default())
}
