//! `labelgs profile`.

pub mod compare;
pub(crate) mod report;
pub mod timed;

use crate::cli::commands::profile::report::{Clocks, Measurement, Profile, Window, Workers};
use crate::cli::support::parsers::share;
use crate::cli::support::{Context, JsonFileArg, Progress, SceneArgs, open_gpu_for_long, open_model, open_scene};
use crate::gpu::Gpu;
use crate::run::Settings;
use crate::scene::{Dataset, Gaussians};
use crate::scheduler::plan::PlanOptions;
use crate::scheduler::{SchedulerOptions, Traffic};
use crate::synth::{self, SynthOptions};
use crate::train::{StepReport, TrainConfig, Trainer, first_model};
use crate::{Error, Result, Setting};
use clap::Args;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// `labelgs profile`.
#[derive(Args, Clone, Debug)]
#[command(group(clap::ArgGroup::new("input").required(true).args(["scene", "synthetic", "compare"])))]
pub struct ProfileArgs {
    /// Scene to time.
    #[arg(value_name = "SCENE")]
    pub scene: Option<PathBuf>,
    /// Use the scene and masks of `labelgs synth` instead of SCENE.
    #[arg(long)]
    pub synthetic: bool,
    /// Folder of id masks.
    #[arg(long, value_name = "DIR", conflicts_with = "synthetic")]
    pub masks: Option<PathBuf>,
    /// Use --synthetic without its masks.
    #[arg(long, requires = "synthetic")]
    pub no_masks: bool,
    /// Which steps, and how.
    #[command(flatten)]
    pub window: Window,
    /// Start from this model, a PLY file or the output folder of `labelgs train`, instead of the scene's points.
    #[arg(long, value_name = "MODEL")]
    pub model: Option<PathBuf>,
    /// Follow the schedule of a run: early steps use small photos, no labels and a low degree of spherical harmonics.
    #[arg(long)]
    pub as_scheduled: bool,
    /// Settings file (TOML), such as config.toml of an earlier run.
    #[arg(long, value_name = "FILE.toml", help_heading = "Settings")]
    pub config: Option<PathBuf>,
    /// How the scene is read.
    #[command(flatten)]
    pub reading: SceneArgs,
    /// Compare two --json files instead of measuring. Exits with status 1 if a stage got slower beyond noise.
    #[arg(
        long, help_heading = "Comparison", value_names = ["OLD.json", "NEW.json"], num_args = 2,
        conflicts_with_all = ["scene", "synthetic", "model"]
    )]
    pub compare: Option<Vec<PathBuf>>,
    /// Allowed growth of a median in --compare, as a share.
    #[arg(
        long, value_name = "SHARE", value_parser = share, default_value_t = 0.05, requires = "compare",
        help_heading = "Comparison"
    )]
    pub tolerance: f32,
    /// JSON.
    #[command(flatten)]
    pub json: JsonFileArg,
}

/// Steps after the timed ones; they count pairs.
const COUNTED_STEPS: u32 = 10;

/// Times steps of a real training.
pub(crate) fn run(args: &ProfileArgs, context: &Context) -> Result<()> {
    if let Some([old, new]) = args.compare.as_deref() {
        return compare::run([old, new], args.tolerance.into(), context.json || args.json.file.is_some());
    }
    let config = decide(args)?;
    let gpu = open_gpu_for_long(context)?;
    let dataset = open(args, &config)?;
    let model = match &args.model {
        Some(path) => open_model(path)?,
        None => first_model(&dataset, &config)?,
    };
    let profile = profile(&gpu, (&dataset, &model, config), args.window, context)?;
    args.json.put_out(&profile, &profile.to_text(), context)
}

/// Returns the settings of a run whose steps after `from_step` are as at its end: full-size photos, the full degree of
/// spherical harmonics, labels.
pub(crate) fn finished_from(from_step: u32, settings: TrainConfig) -> TrainConfig {
    let first = from_step.saturating_add(1);
    TrainConfig {
        full_size_from: Some(settings.full_size_from().min(first)),
        label_from: Some(settings.label_from.unwrap_or(first).min(first)),
        sh_degree_interval: Some(settings.sh_interval().min(first / settings.sh_degree.max(1)).max(1)),
        ..settings
    }
}

/// Returns the settings: no timed step is the last step.
fn decide(args: &ProfileArgs) -> Result<TrainConfig> {
    let mut decided = match &args.config {
        Some(path) => Settings::read(path)?.train,
        None => TrainConfig::default(),
    };
    let Window { steps, warm_up, from_step, .. } = args.window;
    let steps = u64::from(from_step) + 2 * (u64::from(warm_up) + u64::from(steps)) + u64::from(COUNTED_STEPS) + 1;
    let steps = u32::try_from(steps).map_err(|_| Error::usage(Setting("steps"), "there are too many steps in all"))?;
    decided.iterations = decided.iterations.max(steps);
    if !args.as_scheduled {
        decided = finished_from(from_step, decided);
    }
    decided.check()?;
    Ok(decided)
}

fn open(args: &ProfileArgs, config: &TrainConfig) -> Result<Dataset> {
    let mut dataset = match &args.scene {
        Some(scene) => open_scene(scene, &args.reading, args.masks.clone(), config.background, true)?,
        None => synth::dataset(&SynthOptions::default(), args.reading.test_every()),
    };
    if args.no_masks {
        dataset.train.iter_mut().for_each(|view| view.mask = None);
    }
    if dataset.train.is_empty() {
        let scene = args.scene.as_deref().unwrap_or(Path::new("the built-in scene"));
        return Err(Error::data(scene, "", "no view is left to train on; use a larger --test-every"));
    }
    Ok(dataset)
}

/// Times steps of a training of `model` on a dataset.
pub(crate) fn profile(
    gpu: &Arc<Gpu>,
    (dataset, model, config): (&Dataset, &Gaussians, TrainConfig),
    window: Window,
    context: &Context,
) -> Result<Profile> {
    if gpu.limits().timestamp_bits == 0 {
        return Err(Error::NoDevice("this device has no timestamps on its compute queue".into()));
    }
    let workers = workers(gpu)?;
    let plan = PlanOptions { barrier_everywhere: !window.overlap, ..PlanOptions::default() };
    let options = SchedulerOptions { plan, timestamps: true, ..SchedulerOptions::default() };
    let mut trainer = Trainer::new(Arc::clone(gpu), config, dataset, model, options)?;
    let measured = measure(&mut trainer, window, context)?;
    Ok(Profile::new(gpu, workers, window, dataset.train.len(), measured))
}

fn measure(trainer: &mut Trainer, window: Window, context: &Context) -> Result<Measurement> {
    let before = window.from_step + window.warm_up;
    let all = u64::from(before) + u64::from(window.warm_up) + 2 * u64::from(window.steps);
    let mut progress = Progress::new(all, "steps", &context.global);
    let mut step = |trainer: &mut Trainer| {
        let done = trainer.step();
        progress.set(u64::from(trainer.steps_done()), String::new);
        done
    };
    for number in 1..=before {
        if number == window.from_step + 1 {
            trainer.keep_times();
        }
        step(trainer)?;
    }
    trainer.keep_times();
    let mut reports = Vec::new();
    for _ in 0..window.steps {
        reports.extend(step(trainer)?);
    }
    reports.extend(trainer.drain()?);
    reports.retain(|report| report.step > before);
    let times = trainer.take_times().into_iter().filter(|times| times.step > before).collect();
    let gaussians = trainer.gaussian_count();
    let clocks = in_the_pipeline(trainer, window, step)?;
    trainer.count_pairs(true);
    let mut counted = Vec::new();
    for _ in 0..COUNTED_STEPS.min(window.steps) {
        counted.extend(trainer.step()?);
    }
    counted.extend(trainer.drain()?);
    Ok(Measurement { clocks, reports, times, counted, gaussians })
}

/// Runs further steps as in a training: without timestamps, and with as many in flight as there are frames. The clock
/// ends after the last of them.
fn in_the_pipeline(
    trainer: &mut Trainer,
    window: Window,
    mut step: impl FnMut(&mut Trainer) -> Result<Vec<StepReport>>,
) -> Result<Clocks> {
    trainer.stop_times()?;
    for _ in 0..window.warm_up {
        step(trainer)?;
    }
    trainer.drain()?;
    let (wall, cpu, before) = (Instant::now(), cpu_time(), trainer.engine_mut().traffic());
    let mut steps = Vec::new();
    for _ in 0..window.steps {
        let start = Instant::now();
        step(trainer)?;
        steps.push(start.elapsed());
    }
    trainer.drain()?;
    let cpu = cpu_time().zip(cpu).map(|(after, before)| after.saturating_sub(before));
    let (wall, after) = (wall.elapsed(), trainer.engine_mut().traffic());
    let traffic = Traffic { up: after.up - before.up, down: after.down - before.down };
    Ok(Clocks { wall, steps, cpu, traffic })
}

/// Returns the host threads that run the passes; `None` on a GPU.
fn workers(gpu: &Gpu) -> Result<Option<Workers>> {
    const THREADS_VARIABLE: &str = "LP_NUM_THREADS";
    /// lavapipe starts at most this many threads.
    const THREADS_MAX: usize = 32;
    if !gpu.is_cpu() {
        return Ok(None);
    }
    let set = std::env::var(THREADS_VARIABLE).ok().filter(|text| !text.is_empty());
    let (count, source) = match set {
        // 0 runs everything on the submitting thread.
        Some(text) => match text.parse::<usize>() {
            Ok(count) => (count.max(1), THREADS_VARIABLE),
            Err(_) => {
                return Err(Error::usage(THREADS_VARIABLE, format!("is {text}, needs a whole number of threads")));
            }
        },
        None => (std::thread::available_parallelism().map_or(1, usize::from), "CPU cores of this machine"),
    };
    Ok(Some(Workers { count: count.min(THREADS_MAX), source }))
}

/// Returns the CPU time of this process: user and system, all threads.
#[cfg(unix)]
fn cpu_time() -> Option<Duration> {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    Some(Duration::new(time.tv_sec.try_into().ok()?, time.tv_nsec.try_into().ok()?))
}

#[cfg(not(unix))]
fn cpu_time() -> Option<Duration> {
    None
}
