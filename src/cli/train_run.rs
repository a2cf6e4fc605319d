//! One run of a training: what is read, the loop, what is written.

use super::args::ReadArgs;
use super::context::Context;
use super::log::Progress;
use super::resume::{self, Checkpoints};
use super::scene::{open_gpu, open_with};
use super::train_args::TrainArgs;
use super::{config, interrupt, occlusion};
use crate::edit::select::MIN_LABEL_CONFIDENCE;
use crate::engine::Engine;
use crate::eval::evaluate::{Rendering, evaluate};
use crate::eval::scores::Scores;
use crate::gpu::Gpu;
use crate::io::label_table::{self, LabelTable};
use crate::io::occlusion_table::{self, OcclusionTable};
use crate::io::run_folder::{self, Lock};
use crate::io::{atomic, checkpoint_folder, init};
use crate::render::render;
use crate::scene::{Dataset, Photo, View};
use crate::scheduler::SchedulerOptions;
use crate::train::record::{self, Models};
use crate::train::{self, StepReport, TrainConfig, Trainer};
use crate::{Error, Result};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Trains a model; returns its metrics.json, and the same in a sentence.
pub(super) fn train_once(args: &TrainArgs, context: &Context) -> Result<(serde_json::Value, String)> {
    // Bad settings leave no folder behind. Checkpoints are looked for when the folder is this run's: the one that it goes on
    // from may be writing its last.
    let settings = if args.resume { None } else { Some(config::decide(args)?) };
    let out = args.output.as_path();
    let lock = lock_output(out)?;
    let resumed = resume::find(args)?;
    let config = match (&resumed, settings) {
        (Some(state), _) => state.config.clone(),
        (None, Some(settings)) => settings,
        (None, None) => config::decide(args)?,
    };
    if args.restart && config.checkpoint_every == 0 {
        return Err(Error::usage("--restart", "goes on from checkpoints, and --checkpoint-every is 0"));
    }
    prepare_output(out, &config)?;
    let mut models = Models::new(out, resumed.as_ref().map_or(0, |state| state.step))?;
    let mut run = resume::facts(args, resumed.as_ref());
    let masks = args.masks.clone().or(run.masks.as_ref().map(PathBuf::from));
    let names = masks.as_deref().map(LabelTable::of_folder).transpose()?.flatten();
    let reading = ReadArgs { max_bad_photos: run.max_bad_photos, allow_outside: run.allow_outside };
    let dataset = open_with(&args.scene, &reading.into_options(config::load_options(&config, masks.clone())))?;
    if dataset.train.is_empty() {
        return Err(Error::data(
            &args.scene,
            "",
            "no view is left to train on; use --no-test or a larger --test-every",
        ));
    }
    let occluders = if resumed.is_none() { occlusion::for_training(args, &dataset)? } else { None };
    if let Some(table) = &occluders {
        run.occlusion = Some(table.kind.clone());
    }
    let gpu = open_gpu(context)?;
    let preview = preview_view(&dataset);
    let options =
        SchedulerOptions { memory_limit: run.memory_limit, crash_markers: args.restart, ..SchedulerOptions::default() };
    let mut facts = facts(args, masks.as_deref(), &gpu);
    facts.extend(resumed.as_ref().map(|state| ("goes on after step", state.step.to_string())));
    let mut checkpoints = Checkpoints::new(out, lock, run.clone(), resumed.as_ref())?;
    let mut trainer = match resumed {
        Some(state) => Trainer::resume(gpu, &dataset, state, options)?,
        None => start(gpu, &config, &dataset, occluders.as_ref(), options)?,
    };
    // The near plane is known now.
    let config = trainer.config().clone();
    let records = || {
        let text = config::dump(&config, &facts)?;
        atomic::write(out.join(run_folder::CONFIG), |file| file.write_all(text.as_bytes()))?;
        LabelTable::put(names.as_ref(), &out.join(label_table::FILE))?;
        let cameras: Vec<_> = dataset.all().into_iter().map(|view| (view.name.as_str(), &view.camera)).collect();
        record::save_cameras(out, &cameras)
    };
    records()?;
    interrupt::note_only();
    let start = Instant::now();
    let mut go_on = |trainer: &mut Trainer, checkpoints: &mut Checkpoints| {
        steps(trainer, out, preview.as_ref(), (checkpoints, &mut models), context)
    };
    // First a device that erred once is made up for, bit for bit. What fails again has its reason in the scene or in the
    // settings, and slower steps may get past it.
    let mut last = go_on(&mut trainer, &mut checkpoints);
    for is_slower in [false, true] {
        last = match last {
            Err(error @ Error::Numeric { .. }) if checkpoints.restore(&mut trainer, &error)? => {
                if is_slower {
                    trainer.halve_rates();
                    tracing::warn!("it went wrong again: from here on all learning rates are half of what they were");
                }
                go_on(&mut trainer, &mut checkpoints)
            }
            other => other,
        };
    }
    let last = last.map_err(|error| keep_model(&mut trainer, &mut models, error))?;
    checkpoints.hold_folder()?;
    if !out.join(run_folder::CONFIG).exists() {
        tracing::warn!("{} was deleted meanwhile; what is known is written again", out.display());
        records()?;
    }
    // What was learnt is saved either way.
    let kept = match interrupt::status() {
        Some(_) => checkpoints.save(&mut trainer).map(|()| true),
        None => Ok(false),
    };
    let model = trainer.labelled_model();
    let model = model.map_err(|error| keep_model(&mut trainer, &mut models, error))?;
    let seconds = start.elapsed().as_secs_f64();
    let path = models.save(trainer.steps_done(), &model)?;
    save_occluders(out, &trainer, run.occlusion.as_deref())?;
    // Scoring puts single objects in the model's place.
    let gaussians = trainer.gaussian_count();
    if let Some(view) = &preview {
        preview_now(&mut trainer, out, view)?;
    }
    let stopped = interrupt::status();
    let scores = if stopped.is_none() { score(&mut trainer, &dataset, &config)? } else { None };
    let summary = json!({
        "schema_version": 1,
        "steps": trainer.steps_done(),
        "seconds": seconds,
        "gaussians": gaussians,
        "loss": last.map(|report| report.loss),
        "label_loss": last.map(|report| report.label_loss),
        "model": path.display().to_string(),
        "test": scores.as_ref().map(|scores| &scores.mean),
        "views": scores.as_ref().map(|scores| &scores.views),
    });
    super::eval::write_json(&out.join("metrics.json"), &summary)?;
    let is_kept = kept?;
    if let Some(status) = stopped {
        let further = if is_kept { "--resume goes on" } else { "only the scores are missing" };
        tracing::info!("stopped after step {} of {}; {further}", trainer.steps_done(), config.iterations);
        return Err(Error::Interrupted(status));
    }
    checkpoints.finish()?;
    let sentence = sentence((trainer.steps_done(), gaussians, seconds), scores.as_ref(), &path);
    Ok((summary, sentence))
}

fn sentence((steps, gaussians, seconds): (u32, u32, f64), scores: Option<&Scores>, path: &Path) -> String {
    let mut text = format!("{}: {gaussians} Gaussians after {steps} steps in {seconds:.1} s", path.display());
    if let Some(mean) = scores.map(|scores| &scores.mean) {
        text += &format!(
            "; test views: PSNR {:.2} dB, SSIM {:.4}",
            mean.psnr.unwrap_or(f64::NAN),
            mean.ssim.unwrap_or(f64::NAN)
        );
        if let Some(iou) = mean.objects.iou_map {
            text += &format!(", IoU of the label map {iou:.3}");
        }
    }
    text + "\n"
}

/// The loop. A noted signal ends it after the step.
fn steps(
    trainer: &mut Trainer,
    out: &Path,
    preview: Option<&View>,
    (checkpoints, models): (&mut Checkpoints, &mut Models),
    context: &Context,
) -> Result<Option<StepReport>> {
    let config = trainer.config().clone();
    let mut progress = Progress::new(u64::from(config.iterations), "steps", &context.global);
    let mut last = None;
    for step in trainer.steps_done() + 1..=config.iterations {
        let done = trainer.step()?;
        last = done.last().copied().or(last);
        progress.set(u64::from(step), || {
            let (loss, label) = last.map_or((f64::NAN, 0.0), |report| (report.loss, report.label_loss));
            let label = if label > 0.0 { format!(" label loss {label:.4}") } else { String::new() };
            format!("loss {loss:.4}{label} {} Gaussians", trainer.gaussian_count())
        });
        if step < config.iterations {
            if config.save_at.contains(&step) {
                checkpoints.hold_folder()?;
                let model = trainer.labelled_model()?;
                tolerate(models.save(step, &model).map(drop))?;
            }
            if config.preview_every > 0
                && step % config.preview_every == 0
                && let Some(view) = preview
            {
                checkpoints.hold_folder()?;
                tolerate(preview_now(trainer, out, view))?;
            }
        }
        if checkpoints.due(trainer) {
            last = trainer.drain()?.last().copied().or(last);
            checkpoints.save_due(trainer)?;
        }
        if interrupt::status().is_some() {
            break;
        }
    }
    let done = trainer.drain()?;
    Ok(done.last().copied().or(last))
}

/// That something cannot be written on the way ends no training: there may be room again at its end.
fn tolerate(written: Result<()>) -> Result<()> {
    match written {
        Err(error @ Error::Write { .. }) => {
            tracing::warn!("{error}; training goes on without it");
            Ok(())
        }
        other => other,
    }
}

/// Writes the occluders that the last step used.
fn save_occluders(out: &Path, trainer: &Trainer, given: Option<&str>) -> Result<()> {
    let views = trainer.occluders();
    if views.is_empty() {
        return Ok(());
    }
    let kind = match (given, trainer.config().occlusion) {
        (Some(kind), _) => kind,
        (None, train::Occlusion::None) => "none",
        (None, _) => "rendered",
    };
    OcclusionTable::new(kind, views).write(&out.join(occlusion_table::FILE))
}

/// A run that memory ended keeps what it has learnt: steps that did not fit changed nothing.
fn keep_model(trainer: &mut Trainer, models: &mut Models, error: Error) -> Error {
    if !error.is_out_of_memory() {
        return error;
    }
    let step = trainer.steps_done();
    match trainer.model().and_then(|model| models.save(step, &model)) {
        Ok(path) => tracing::warn!(
            "stopped at step {step} of {}; the model so far is {}",
            trainer.config().iterations,
            path.display()
        ),
        Err(second) => tracing::warn!("the model of step {step} could not be saved either: {second}"),
    }
    error
}

/// The output folder, which is this run's as long as the result lives.
fn lock_output(out: &Path) -> Result<Lock> {
    std::fs::create_dir_all(out).map_err(Error::write(out))?;
    Lock::take(out)
}

/// Refuses an output folder that cannot be used before any work is done, and clears it of what killed runs left.
fn prepare_output(out: &Path, config: &TrainConfig) -> Result<()> {
    let checkpoints = out.join(checkpoint_folder::FOLDER);
    if config.checkpoint_every > 0 {
        std::fs::create_dir_all(&checkpoints).map_err(Error::write(&checkpoints))?;
    }
    let models = std::fs::read_dir(out.join("point_cloud")).into_iter().flatten().flatten().map(|entry| entry.path());
    for folder in [out.to_owned(), checkpoints, out.join("preview")].into_iter().chain(models) {
        atomic::remove_stale(folder, Duration::ZERO);
    }
    Ok(())
}

/// A trainer with the initial model of the scene.
fn start(
    gpu: Arc<Gpu>,
    config: &TrainConfig,
    dataset: &Dataset,
    occluders: Option<&OcclusionTable>,
    options: SchedulerOptions,
) -> Result<Trainer> {
    let mut model = init::initial_gaussians(dataset, config.seed, init::RANDOM_COUNT)?;
    bound_start(&mut model, config);
    let room = train::start_room(&gpu, dataset, config, model.len(), options)?;
    let memory = Engine::predict(&gpu, &room, options)?;
    tracing::info!(
        "memory to start with: {:.1} MiB on the device, for {} Gaussians and {} x {} px; it grows with the model",
        memory.total as f64 / f64::from(1 << 20),
        room.gaussians,
        room.image.0,
        room.image.1
    );
    let mut trainer = Trainer::new(gpu, config.clone(), dataset, &model, options)?;
    if let Some(table) = occluders {
        let without = trainer.set_occluders(&table.views);
        if let Some(first) = without.first() {
            let count = without.len();
            tracing::warn!("{count} training views have no list of occluders, such as {first}; nothing hides there");
        }
    }
    Ok(trainer)
}

/// No more initial points than `--max-gaussians`: every n-th is kept.
fn bound_start(model: &mut crate::scene::Gaussians, config: &TrainConfig) {
    let (count, bound) = (model.len() as u64, config.max_gaussians);
    if bound > 0 && count > bound {
        tracing::warn!(
            "{count} initial points, --max-gaussians {bound}: every {:.1}-th is used",
            count as f64 / bound as f64
        );
        // Row i is kept where i * bound / count steps up: an even choice.
        *model = model.filtered(|row| row as u64 * bound / count != (row as u64 + 1) * bound / count);
    }
}

/// What `config.toml` says besides the settings.
fn facts(args: &TrainArgs, masks: Option<&Path>, gpu: &Gpu) -> Vec<(&'static str, String)> {
    let found = gpu.capabilities();
    let mut facts = vec![
        ("scene", args.scene.display().to_string()),
        ("device", format!("{} ({} {})", found.name, found.driver_name, found.driver_info)),
        ("subgroup size", gpu.subgroup_size().to_string()),
    ];
    if let Some(masks) = masks {
        facts.push(("masks", masks.display().to_string()));
    }
    if let (Some(depths), Some(kind)) = (&args.depths, args.depth_kind) {
        facts.push(("depths", format!("{} ({kind:?})", depths.display())));
    }
    if let Some(file) = &args.occlusion_file {
        facts.push(("occlusion file", file.display().to_string()));
    }
    facts
}

/// The view of the preview pictures: the first held-out one, else the first of all.
fn preview_view(dataset: &Dataset) -> Option<View> {
    dataset.test.first().or(dataset.train.first()).cloned()
}

fn preview_now(trainer: &mut Trainer, out: &Path, view: &View) -> Result<()> {
    trainer.drain()?;
    let options = trainer.render_options();
    let Some(photo) = &view.photo else { return Ok(()) };
    let photo: &Photo = photo;
    let rendered = render(trainer.engine_mut(), &view.camera, &options)?;
    let labels = trainer.model()?.labels;
    let path = out.join("preview").join(format!("{:06}_{}.png", trainer.steps_done(), view.stem()));
    record::save_preview(&path, photo, &rendered, labels.as_deref())
}

/// Scores the held-out views, objects too where they have masks.
fn score(trainer: &mut Trainer, dataset: &Dataset, config: &TrainConfig) -> Result<Option<Scores>> {
    let views: Vec<&View> = dataset.test.iter().collect();
    if views.is_empty() {
        return Ok(None);
    }
    let mut model = trainer.model()?;
    // Bands that were never let in are 0; without them the render is cheaper.
    model.sh_degree = model.sh_degree.max(trainer.sh_degree());
    let how = Rendering { options: trainer.render_options(), min_confidence: MIN_LABEL_CONFIDENCE };
    let scores = evaluate(trainer.engine_mut(), &model, &views, how, &(), &mut ())?;
    super::eval::warn_of_odd_view(&scores, config.near);
    Ok(Some(scores))
}
