//! Everything before the first step: the folder, the settings, the scene, the initial model.

use super::block::{self, Block};
use super::checkpoints::Checkpoints;
use super::depths::{self, DepthSource};
use super::every::Every;
use super::history::{Recorder, Sums};
use super::info::Info;
use super::models::{Models, open};
use super::resume::{self, ResumePoint, RunState};
use super::{Inputs, Observer, Request, Run, Settings, Start, occluders, pictures};
use crate::engine::Engine;
use crate::error::{Error, Result, Setting};
use crate::files::label_table::LabelTable;
use crate::files::run_folder::Lock;
use crate::files::{self, atomic};
use crate::gpu::Gpu;
use crate::records::checkpoint_folder;
use crate::records::occlusion_table::OcclusionTable;
use crate::scene::{Dataset, Gaussians};
use crate::scenes::capture::{self, Sightings};
use crate::scenes::{self, Lookup};
use crate::scheduler::SchedulerOptions;
use crate::train::setup::TrainerOptions;
use crate::train::shared::{SharedSet, exposure};
use crate::train::{self, ExposureMode, TrainConfig, Trainer};
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// The inputs of a run, before it opens a device.
pub(super) struct RunSetup {
    lock: Lock,
    settings: Settings,
    resumed: Option<ResumePoint>,
    inputs: Inputs,
    models: Models,
    names: Option<LabelTable>,
    dataset: Dataset,
    table: Option<OcclusionTable>,
    /// The model to start from, if there is one.
    first: Option<Gaussians>,
    block: Option<Block>,
}

/// Locks the folder, decides the settings and reads the scene. If `is_again`, continues from the newest checkpoint.
pub(super) fn prepare(request: &Request, is_again: bool) -> Result<RunSetup> {
    // Check the settings first, so that invalid settings leave no folder behind. List checkpoints only after locking:
    // another run may be writing its last one.
    if let Start::New(settings) = &request.start {
        check_new(settings, request)?;
    }
    let out = request.output.as_path();
    std::fs::create_dir_all(out).map_err(Error::write(out))?;
    let lock = Lock::take(out)?;
    let resumed = match &request.start {
        Start::Newest(changed) => resume::find(request, *changed)?,
        Start::New(settings) if is_again => resume::find(request, &|found| Ok(found.unwrap_or(settings).clone()))?,
        Start::New(_) => None,
    };
    let settings = match (&resumed, &request.start) {
        (Some(resumed), _) => resumed.settings.clone(),
        (None, Start::New(settings)) => settings.clone(),
        (None, Start::Newest(changed)) => {
            let settings = changed(None)?;
            check_new(&settings, request)?;
            settings
        }
    };
    let settings = settings.settled();
    if request.restart && settings.run.checkpoint_every == Every::NEVER {
        return Err(Error::usage(
            Setting("restart"),
            format!("needs checkpoints, but {} is 0", Setting("checkpoint_every")),
        ));
    }
    let block = request.block.as_deref().map(Block::read).transpose()?;
    let first = read_first(request, block.as_ref(), resumed.is_some())?;
    clear(out, &settings)?;
    block::settle(block.as_ref(), resumed.as_ref(), out)?;
    let models = Models::new(out, resumed.as_ref().map_or(0, |resumed| resumed.state.step))?;
    let inputs = resumed.as_ref().map_or(&request.inputs, |resumed| &resumed.record.inputs).clone();
    let names = inputs.masks.as_deref().map(LabelTable::read_in_folder).transpose()?.flatten();
    let dataset = read_scene(request, &settings, &inputs, block.as_ref())?;
    if resumed.is_none() {
        warn_of_surroundings(&settings, &dataset)?;
    }
    let table = if resumed.is_none() { occluders::table(request, &dataset)? } else { None };
    Ok(RunSetup { lock, settings, resumed, inputs, models, names, dataset, table, first, block })
}

/// Warns if there are masks and the surroundings do not follow the poses: the objects should then be trained alone.
fn warn_of_surroundings(settings: &Settings, dataset: &Dataset) -> Result<()> {
    let has_masks = dataset.train.iter().any(|view| view.mask.is_some());
    if !has_masks || settings.read.masked_only {
        return Ok(());
    }
    if let Some(share) = capture::still_share(dataset)? {
        let cure = Setting("masked_only");
        tracing::warn!("{}: train only the masked objects with {cure}", capture::surroundings_text(share));
    }
    Ok(())
}

fn check_new(settings: &Settings, request: &Request) -> Result<()> {
    settings.check()?;
    occluders::check(&settings.train, request.occluders.as_deref())
}

/// Deletes temporary files of killed runs, and refuses an unusable folder before any work is done.
fn clear(out: &Path, settings: &Settings) -> Result<()> {
    let checkpoints = out.join(checkpoint_folder::CHECKPOINTS_FOLDER);
    if settings.run.checkpoint_every != Every::NEVER {
        std::fs::create_dir_all(&checkpoints).map_err(Error::write(&checkpoints))?;
    }
    // A missing or unreadable folder needs no clearing.
    let models = files::read::folder(&out.join("point_cloud")).unwrap_or_default();
    let own = [out.to_owned(), checkpoints, out.join("preview"), out.join(pictures::PICTURES_FOLDER)];
    for folder in own.into_iter().chain(models) {
        atomic::remove_stale(folder, Duration::ZERO);
    }
    Ok(())
}

/// Returns where the scene's files are, and how to interpret its poses.
fn lookup(settings: &Settings, inputs: &Inputs) -> Lookup {
    Lookup { allow_outside: inputs.allow_outside, images: inputs.images.clone(), poses: settings.read.poses }
}

fn read_scene(request: &Request, settings: &Settings, inputs: &Inputs, block: Option<&Block>) -> Result<Dataset> {
    let mut options = settings.load_options(inputs.masks.clone());
    options.ignore = inputs.ignore.clone();
    options.max_bad_photos = inputs.max_bad_photos.unwrap_or(options.max_bad_photos);
    options.lookup = lookup(settings, inputs);
    options.photo_folder = Some(request.output.clone());
    if let Some(block) = block {
        block.limit(&mut options);
    }
    let dataset = scenes::open_logged(&request.scene, &options)?;
    block.map_or(Ok(()), |block| block.check_scene(&dataset))?;
    if dataset.train.is_empty() {
        let problem = format!("no training views are left; set {} to 0 or to a larger number", Setting("test_every"));
        return Err(Error::data(&request.scene, "", problem));
    }
    Ok(dataset)
}

/// Uploads the checkpoint's model or the initial model to the device.
pub(super) fn begin<'a>(
    prepared: RunSetup,
    request: &'a Request,
    gpu: Arc<Gpu>,
    observer: &'a mut dyn Observer,
) -> Result<Run<'a>> {
    let RunSetup { lock, settings, resumed, inputs, models, names, dataset, table, first, block } = prepared;
    let out = request.output.as_path();
    let preview = dataset.test.first().or(dataset.train.first()).cloned();
    let options = SchedulerOptions {
        memory_limit: inputs.memory_limit,
        crash_markers: request.restart,
        ..SchedulerOptions::default()
    };
    let is_new = resumed.is_none();
    let lookup = lookup(&settings, &inputs);
    let (sightings, folder) = (&Sightings::new(&lookup, &dataset), inputs.known_depths.as_deref());
    let source = DepthSource { scene: &request.scene, lookup: &lookup, dataset: &dataset, folder, sightings };
    let (train, depths) = depths::decide(source, &settings.train, is_new)?;
    let options = TrainerOptions { region: block.map(|block| block.region()).transpose()?, depths, ..options.into() };
    let mut facts = facts(request, inputs.masks.as_deref(), &gpu);
    facts.extend(resumed.as_ref().map(|resumed| ("resumed after step", resumed.state.step.to_string())));
    let before = resumed.as_ref().and_then(|resumed| resumed.record.occlusion.clone());
    let occlusion = before.or(table.as_ref().map(|table| table.kind.clone()));
    let record = RunState {
        inputs: inputs.recorded(),
        occlusion: occlusion.clone(),
        read: settings.read.clone(),
        run: settings.run.clone(),
        history: Sums::default(),
    };
    let after = resumed.as_ref().map_or(0, |resumed| resumed.state.step);
    let sums = resumed.as_ref().map(|resumed| resumed.record.history).unwrap_or_default();
    let mut info = Info::new(request, after, inputs.masks.as_deref(), &dataset, &gpu);
    let history = Recorder::new(out, (after, settings.train.iterations), sums);
    let checkpoints = Checkpoints::new(out, lock, record, resumed.as_ref().map(|resumed| &resumed.state))?;
    let mut trainer = match resumed {
        Some(resumed) => Trainer::resume(gpu, &dataset, resumed.state, options)?,
        None => start(gpu, (&train, first), (sightings, &dataset), table.as_ref(), options)?,
    };
    info.plan(&mut trainer);
    // The near plane is decided now.
    let settings = Settings { train: trainer.config().clone(), ..settings };
    Ok(Run {
        request,
        settings,
        occlusion,
        facts,
        names,
        dataset,
        preview,
        previewed: Instant::now(),
        trainer,
        checkpoints,
        models,
        history,
        info,
        observer,
        stopped: false,
    })
}

/// Makes a trainer with the scene's initial model, or with a previously trained model.
fn start(
    gpu: Arc<Gpu>,
    (config, first): (&TrainConfig, Option<Gaussians>),
    (sightings, dataset): (&Sightings, &Dataset),
    occluders: Option<&OcclusionTable>,
    mut options: TrainerOptions,
) -> Result<Trainer> {
    let (model, config) = match first {
        Some(model) => train::go_on_from(model, dataset, config),
        None => (train::first_model(dataset, config)?, config.clone()),
    };
    let size = train::start_size(&gpu, dataset, &config, (&model, options.region.as_ref()), options.scheduler)?;
    let memory = Engine::predict(&gpu, &size, options.scheduler)?;
    tracing::info!(
        "initial device memory: {:.1} MiB for {} Gaussians and {} x {} px; it grows with the model",
        memory.total as f64 / f64::from(1 << 20),
        size.gaussians,
        size.image.0,
        size.image.1
    );
    let gains = match config.exposure {
        _ if options.region.is_some() => Vec::new(),
        ExposureMode::Off => Vec::new(),
        ExposureMode::Auto | ExposureMode::On => sightings.gains()?,
    };
    let config = exposure::decided(&config, &gains);
    options.shared = SharedSet::from_config(&config, &gains, dataset, options.region.as_ref());
    let mut trainer = Trainer::new(gpu, config, dataset, &model, options)?;
    if let Some(table) = occluders {
        let without = trainer.set_occluders(&table.views);
        if let Some(first) = without.first() {
            let count = without.len();
            tracing::warn!(
                "{count} training views (such as {first}) have no occluder list; their objects are assumed \
                 not to be hidden"
            );
        }
    }
    Ok(trainer)
}

/// Reads the model that a new run starts from, if requested.
fn read_first(request: &Request, block: Option<&Block>, is_resumed: bool) -> Result<Option<Gaussians>> {
    if request.init.is_some() && block.is_some() {
        return Err(Error::usage(Setting("init"), "cannot be combined with a block, which has its own first model"));
    }
    let Some(path) = &request.init.clone().or(block.map(Block::init)) else { return Ok(None) };
    if is_resumed {
        tracing::info!("the checkpoint has the model; {} is not read again", path.display());
        return Ok(None);
    }
    let model = open(path)?.gaussians;
    if model.is_empty() {
        return Err(Error::data(path, "", "has no Gaussians to start from"));
    }
    Ok(Some(model))
}

fn facts(request: &Request, masks: Option<&Path>, gpu: &Gpu) -> Vec<(&'static str, String)> {
    let found = gpu.capabilities();
    let mut facts = vec![
        ("scene", request.scene.display().to_string()),
        ("device", format!("{} ({} {})", found.name, found.driver_name, found.driver_info)),
        ("subgroups", found.subgroup.to_string()),
    ];
    let named = [("masks", masks), ("init", request.init.as_deref()), ("occluders", request.occluders.as_deref())];
    facts.extend(named.into_iter().filter_map(|(name, path)| Some((name, path?.display().to_string()))));
    facts
}
