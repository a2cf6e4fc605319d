//! `labelgs train`.

pub(crate) mod args;
mod network;

use crate::Result;
use crate::cli::commands::train::args::TrainArgs;
use crate::cli::commands::view::TypedOptions;
use crate::cli::support::shell_words::typed;
use crate::cli::support::{Context, Progress, log, open_gpu_for_long, quoted_path, signals};
use crate::report::text::duration;
use crate::run::{self, Event, Flow, LiveScene, Observer, Request, Settings, Summary};
use crate::viewer::ViewerObserver;
use crate::words::{brief, counted};

/// Trains a model and prints a summary.
pub(crate) fn run(args: &TrainArgs, context: &Context) -> Result<()> {
    let summary = match &args.network {
        Some(folder) => network::run(args, folder, context)?,
        None => once(args, context)?,
    };
    context.show(&summary.to_json(), &(sentence(&summary) + &next(args)))
}

fn once(args: &TrainArgs, context: &Context) -> Result<Summary> {
    let settings = |checkpoint: Option<&Settings>| args.how.settings(checkpoint);
    let request = args.how.request((&args.scene, &args.output), args.masks.clone(), &settings)?;
    trained(args, request, context)
}

/// Trains, with a page if one is asked for.
fn trained(args: &TrainArgs, request: Request, context: &Context) -> Result<Summary> {
    if args.watch.view { shown(args, request, context) } else { train(request, context) }
}

/// Trains with progress on the terminal. A signal ends the run after it saved its state.
pub(crate) fn train(request: Request, context: &Context) -> Result<Summary> {
    observed(request, context, &mut Terminal { context, progress: None })
}

/// Trains with progress on the terminal and in a browser.
fn shown(args: &TrainArgs, request: Request, context: &Context) -> Result<Summary> {
    let viewer = args.watch.server.start(args.watch.view_share)?;
    tracing::info!("view this run at {}", viewer.address());
    let words = TypedOptions {
        scene: Some(args.scene.clone()),
        masks: args.masks.clone(),
        network: None,
        reading: String::new(),
    };
    let mut terminal = Terminal { context, progress: None };
    let title = args.output.display().to_string();
    observed(request, context, &mut ViewerObserver::new(&viewer, &mut terminal, title, &words))
}

fn observed(request: Request, context: &Context, observer: &mut dyn Observer) -> Result<Summary> {
    let open = || {
        signals::check()?;
        open_gpu_for_long(context)
    };
    let before = log::warnings().len();
    let warnings = || log::warnings().split_off(before);
    let request = &Request { command: Some(typed()), warnings: Some(&warnings), ..request };
    let summary = run::train(request, &open, observer)?;
    if summary.stopped { signals::check().map(|()| summary) } else { Ok(summary) }
}

/// Shows progress, and stops the run after a signal.
struct Terminal<'a> {
    context: &'a Context,
    progress: Option<Progress>,
}

impl Observer for Terminal<'_> {
    fn observe(&mut self, event: &Event<'_>, live: &mut LiveScene<'_>) -> Result<Flow> {
        match *event {
            Event::Started { steps, .. } => {
                // From here on the run has work to save.
                signals::note_only();
                self.progress = Some(Progress::new(u64::from(steps), "steps", &self.context.global));
            }
            Event::Step { step, report, is_last } => {
                if let Some(progress) = &mut self.progress {
                    progress.set(u64::from(step), || {
                        let (loss, label) = report.map_or((f64::NAN, 0.0), |report| (report.loss, report.label_loss));
                        let label = if label > 0.0 { format!(" + {label:.3}") } else { String::new() };
                        format!("loss {loss:.3}{label}, {} Gaussians", brief(live.gaussian_count().into()))
                    });
                }
                if is_last {
                    self.progress = None;
                }
            }
            _ => {}
        }
        Ok(if signals::is_noted() { Flow::Stop } else { Flow::Continue })
    }
}

/// Returns the command that shows what was trained.
fn next(args: &TrainArgs) -> String {
    let [out, scene] = [&args.output, &args.scene].map(|path| quoted_path(path.as_path()));
    format!("View it: labelgs view {out} --scene {scene}\n")
}

fn sentence(summary: &Summary) -> String {
    let Summary { model, gaussians, steps, seconds, .. } = summary;
    let mut text = format!(
        "{}: {} after {} in {}",
        model.display(),
        counted(gaussians, "Gaussian"),
        counted(steps, "step"),
        duration(*seconds)
    );
    if let Some(mean) = summary.scores.as_ref().map(|scores| &scores.mean) {
        text += &format!(
            "; held-out views: PSNR {:.2} dB, SSIM {:.3}",
            mean.psnr.unwrap_or(f64::NAN),
            mean.ssim.unwrap_or(f64::NAN)
        );
        if let Some(iou) = mean.objects.iou_map {
            text += &format!(", label IoU {iou:.3}");
        }
    }
    text + "\n"
}
