//! Shared by commands that render: the device, the scene, its views.

use crate::cli::support::args::SceneArgs;
use crate::cli::support::context::Context;
use crate::cli::support::model_fit::warn_of_misfit;
use crate::error::{Error, Result, Setting};
use crate::gpu::{Gpu, GpuOptions, PipelineStore};
use crate::label::click::Photos;
use crate::records::pipeline_file::{PipelineFolder, user_cache};
use crate::run::Settings;
use crate::scene::{Dataset, Gaussians, View};
use crate::scenes::{self, LoadOptions};
use crate::segment::Network;
use crate::train::setup::near_plane::NEAR_DEFAULT;
use crate::words::{counted, did_you_mean};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Once};

/// Returns the near plane to render a model with, world units: the typed value, else that of the model's run (its
/// config.toml), else 0.2 (3DGS).
pub fn near_plane(model: &Path, typed: Option<f32>) -> Result<f32> {
    match typed {
        Some(near) => Ok(near),
        None => Ok(Settings::for_model(model)?.map_or(NEAR_DEFAULT, |settings| settings.train.near)),
    }
}

/// Opens the chosen device.
pub(crate) fn open_gpu(context: &Context) -> Result<Arc<Gpu>> {
    let pipelines = PipelineFolder::for_user().map(|folder| Arc::new(folder) as Arc<dyn PipelineStore>);
    let gpu = Gpu::new(&GpuOptions { pipelines, ..context.gpu_options()? })?;
    context.listen(&gpu);
    let found = gpu.capabilities();
    tracing::debug!("device: {} ({})", found.name, found.driver_info);
    Ok(gpu)
}

/// Opens the chosen device for long work, and says once which one it is.
pub(crate) fn open_gpu_for_long(context: &Context) -> Result<Arc<Gpu>> {
    static ANNOUNCEMENT: Once = Once::new();
    let gpu = open_gpu(context)?;
    let name = &gpu.capabilities().name;
    // What follows in brackets are versions of the compiler inside of the driver.
    let short = name.split(" (").next().unwrap_or(name);
    ANNOUNCEMENT.call_once(|| match gpu.is_cpu() {
        true => tracing::info!("Using the CPU ({short}). A GPU is much faster."),
        false => tracing::info!("Using the GPU {short}."),
    });
    Ok(gpu)
}

/// Reads a scene and logs its notes.
pub(crate) fn open_scene(
    path: &Path,
    reading: &SceneArgs,
    masks: Option<PathBuf>,
    background: [f32; 3],
    photos: bool,
) -> Result<Dataset> {
    let test_every = Some(reading.test_every()).filter(|&every| every > 0);
    let (max_resolution, base) = (reading.max_resolution, LoadOptions::default());
    let ignore = reading.ignore.clone();
    let masked_only = reading.masked_only;
    let options = LoadOptions { masks, ignore, max_resolution, test_every, background, masked_only, photos, ..base };
    scenes::open_logged(path, &reading.read.options(options))
}

/// Reads the photos of a scene for a network, which is asked for objects in a model; warns if they do not fit it.
/// Returns the views too, in the sizes in which places are typed.
pub(crate) fn open_photos(
    (path, model): (&Path, &Gaussians),
    (scene, reading): (&Path, &SceneArgs),
    network: &Path,
) -> Result<(Photos, Dataset)> {
    let network = Network::open(network, rayon::current_num_threads())?;
    let typed = open_scene(scene, reading, None, [0.0; 3], false)?;
    let options = LoadOptions { max_resolution: Some(network.side()), ..LoadOptions::default() };
    let photos = scenes::open_logged(scene, &reading.read.options(options))?;
    warn_of_misfit(path, model, &photos)?;
    Ok((Photos::new(network, user_cache().as_deref(), &typed, photos)?, typed))
}

/// Returns the views for `test`, `train`, `all` or a list of names.
pub(crate) fn pick_views<'a>(dataset: &'a Dataset, which: &str) -> Result<Vec<&'a View>> {
    let views: Vec<&View> = match which {
        "test" => dataset.test.iter().collect(),
        "train" => dataset.train.iter().collect(),
        "all" => dataset.all(),
        names => names.split(',').map(|name| find_view(dataset, name.trim())).collect::<Result<_>>()?,
    };
    if views.is_empty() {
        return Err(Error::usage(
            Setting("views"),
            format!(
                "the scene has no {which} views; use {}, or change {}",
                Setting("views").to("all"),
                Setting("test_every")
            ),
        ));
    }
    Ok(views)
}

/// Maximum number of views that a message names.
const NAMED_MAX: usize = 4;

/// Returns the view with a name, with or without its extension.
pub(crate) fn find_view<'a>(dataset: &'a Dataset, name: &str) -> Result<&'a View> {
    let all = dataset.all();
    let found =
        all.iter().find(|view| view.name == name || view.stem() == name || without_extension(&view.name) == name);
    found.copied().ok_or_else(|| {
        let names = || all.iter().map(|view| view.name.as_str());
        let some = || names().take(NAMED_MAX).collect::<Vec<_>>().join(", ");
        let cure = did_you_mean(name, names()).unwrap_or_else(|| format!("such as {}", some()));
        let problem = format!("no view is called {name}; the scene has {}, {cure}", counted(all.len(), "view"));
        Error::usage("name of a view", problem)
    })
}

fn without_extension(name: &str) -> String {
    Path::new(name).with_extension("").to_string_lossy().into_owned()
}
