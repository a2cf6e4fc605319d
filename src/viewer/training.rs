//! Shows a training. Viewing reads the model between two steps and changes no bit of it.

use super::finished::scene;
use super::hub::ClientId;
use super::message::{Command, Message};
use super::pace::Budget;
use super::painter::{Painter, Source};
use super::rows::{self, Curve};
use super::views::{Score, Views, describe_scores};
use super::{ProgramCommands, Viewer};
use crate::error::{Error, Result};
use crate::render::{Parts, Render};
use crate::run::{Event, Flow, LiveScene, Observer};
use crate::scene::{Camera, Overview};
use glam::DVec3;
use serde_json::json;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Time between two reports to the pages.
const REPORT_INTERVAL: Duration = Duration::from_millis(250);
/// Time between two counts of labels.
const LABEL_COUNT_INTERVAL: Duration = Duration::from_secs(5);
/// Rounds over the test views in a run, and the fewest and most steps between two.
const SCORE_ROUNDS: u32 = 20;
const STEPS_PER_SCORE_ROUND: [u32; 2] = [25, 500];
/// Time between two events of a paused run.
const PAUSED_WAIT_MAX: Duration = Duration::from_millis(50);

/// Shows a training to pages, and lets them pause, save and stop it. Passes all events to another observer, whose
/// request to stop has priority.
pub struct ViewerObserver<'a> {
    inner: &'a mut dyn Observer,
    viewer: &'a Viewer,
    words: &'a dyn ProgramCommands,
    title: String,
    painter: Painter,
    budget: Budget,
    curve: Curve,
    scores: Vec<Score>,
    /// Step of the present round of scores.
    scored_at: u32,
    scored_to: usize,
    steps: u32,
    wish: RunRequests,
    pace: Pace,
}

/// Requests of the pages.
#[derive(Default)]
struct RunRequests {
    pause: bool,
    save: bool,
    stop: bool,
}

/// Times of the training.
struct Pace {
    /// When the last event was answered.
    last: Instant,
    reported: Option<Instant>,
    counted: Option<Instant>,
    /// Mean time of a step, viewing included, s.
    step: f64,
}

/// The model between two steps.
impl Source for LiveScene<'_> {
    fn render(&mut self, camera: &Camera, parts: Parts) -> Result<Render> {
        LiveScene::render(self, camera, parts)
    }

    fn confidence(&self) -> Option<&[f32]> {
        None
    }

    fn largest(&mut self) -> Option<(u32, u32)> {
        // A larger image would need memory, which might bound the number of Gaussians.
        Some(self.image())
    }

    fn step(&self) -> u32 {
        LiveScene::step(self)
    }
}

impl<'a> ViewerObserver<'a> {
    /// Shows a run to the pages of `viewer`.
    pub fn new(viewer: &'a Viewer, inner: &'a mut dyn Observer, title: String, words: &'a dyn ProgramCommands) -> Self {
        Self {
            inner,
            viewer,
            words,
            title,
            painter: Painter::new(Arc::default(), true),
            budget: Budget::new(viewer.options.share),
            curve: Curve::default(),
            scores: Vec::new(),
            scored_at: 0,
            scored_to: 0,
            steps: 0,
            wish: RunRequests::default(),
            pace: Pace { last: Instant::now(), reported: None, counted: None, step: 0.0 },
        }
    }

    fn begin(&mut self, live: &mut LiveScene, steps: u32) {
        let views = Arc::new(Views::new(live.dataset()));
        let nothing = Overview { up: DVec3::NEG_Y, target: DVec3::ZERO, distance: 1.0 };
        let frame = views.frame().unwrap_or(nothing);
        self.viewer.hub.set_views(Arc::clone(&views));
        self.viewer.hub.publish("scene", &scene(&views, frame, &self.title, ("", true)));
        self.painter = Painter::new(views, live.is_cpu());
        self.steps = steps;
    }

    /// Serves the pages after a step, as long as the budget allows.
    fn after_step(&mut self, live: &mut LiveScene) -> Result<()> {
        let spent = self.pace.last.elapsed();
        self.budget.trained(spent);
        self.hear_all(live)?;
        let start = Instant::now();
        if self.viewer.hub.is_watched() {
            if self.budget.allows() && self.viewer.hub.has_work() {
                live.wait()?;
                self.budget.trained(start.elapsed());
            }
            while self.budget.allows() && self.viewer.hub.has_work() {
                let Some((id, message)) = self.viewer.hub.next(Duration::ZERO) else { break };
                self.timed(|watched| watched.serve(id, message, live))?;
            }
            if self.budget.allows() {
                self.timed(|watched| watched.score_one(live))?;
            }
            self.report(live, false)?;
        }
        // Viewing is part of what a step takes.
        let seconds = (spent + start.elapsed()).as_secs_f64();
        let weight = if self.pace.step == 0.0 { 1.0 } else { 0.05 };
        self.pace.step += weight * (seconds - self.pace.step);
        Ok(())
    }

    /// Serves the pages for a while, in a pause.
    fn in_pause(&mut self, live: &mut LiveScene) -> Result<()> {
        self.report(live, true)?;
        match self.viewer.hub.next(PAUSED_WAIT_MAX) {
            Some((id, message)) => self.serve(id, message, live),
            None => self.score_one(live),
        }
    }

    /// Does something that counts as viewing.
    fn timed(&mut self, what: impl FnOnce(&mut Self) -> Result<()>) -> Result<()> {
        let start = Instant::now();
        let done = what(self);
        self.budget.viewed(start.elapsed());
        done
    }

    fn hear_all(&mut self, live: &mut LiveScene) -> Result<()> {
        while let Some((id, message)) = self.viewer.hub.next_message(self.budget.allows()) {
            self.timed(|watched| watched.serve(id, message, live))?;
        }
        Ok(())
    }

    fn serve(&mut self, id: ClientId, message: Message, live: &mut LiveScene) -> Result<()> {
        let hub = &self.viewer.hub;
        match message {
            Message::Look(look) => return self.painter.look(hub, id, &look, live),
            Message::Pick { seq, from, pixel } => {
                return self.painter.pick(hub, id, (seq, &from, pixel), live);
            }
            Message::Share { share } if (0.0..=1.0).contains(&share) => self.budget.set_share(share),
            Message::Train { what } => match what {
                Command::Pause => self.wish.pause = true,
                Command::Resume => self.wish.pause = false,
                Command::Save => self.wish.save = true,
                Command::Stop => self.wish.stop = true,
            },
            _ => {
                let text = "You cannot edit labels while training is running or paused.";
                hub.reply(id, &json!({ "kind": "problem", "text": text }));
            }
        }
        self.pace.reported = None;
        Ok(())
    }

    /// Scores the next test view. A run has some rounds over them.
    fn score_one(&mut self, live: &mut LiveScene) -> Result<()> {
        let (step, views) = (live.step(), Arc::clone(&self.painter.views));
        if self.scored_to >= views.list.len() {
            let [fewest, most] = STEPS_PER_SCORE_ROUND;
            if step < self.scored_at + (self.steps / SCORE_ROUNDS).clamp(fewest, most) || step == 0 {
                return Ok(());
            }
            (self.scored_to, self.scored_at) = (0, step);
        }
        self.scores.resize(views.list.len(), Score::default());
        let rest = self.scored_to..views.list.len();
        let next = rest.clone().find(|&index| views.list[index].is_test && views.list[index].view.photo.is_some());
        self.scored_to = next.map_or(rest.end, |index| index + 1);
        if let Some(index) = next {
            self.scores[index] = self.painter.score(index, live)?;
            self.viewer.hub.publish("scores", &describe_scores(&self.scores, step));
        }
        Ok(())
    }

    fn report(&mut self, live: &mut LiveScene, is_paused: bool) -> Result<()> {
        let now = Instant::now();
        if self.pace.reported.is_some_and(|last| now - last < REPORT_INTERVAL) || !self.viewer.hub.is_watched() {
            return Ok(());
        }
        self.pace.reported = Some(now);
        let hub = &self.viewer.hub;
        let left = f64::from(self.steps.saturating_sub(live.step())) * self.pace.step;
        hub.publish(
            "training",
            &json!({
                "kind": "training",
                "step": live.step(),
                "steps": self.steps,
                "left": left,
                "stepMs": self.pace.step * 1e3,
                "gaussians": live.gaussian_count(),
                "memory": live.memory(),
                "paused": is_paused,
                "share": self.budget.share(),
            }),
        );
        hub.publish("curve", &self.curve.describe());
        let is_due = self.pace.counted.is_none_or(|last| now - last > LABEL_COUNT_INTERVAL);
        if is_due {
            self.pace.counted = Some(now);
            return self.timed(|watched| {
                let labels = live.labels()?.unwrap_or_default();
                watched.viewer.hub.publish("labels", &rows::of_training(&labels, live.names()));
                Ok(())
            });
        }
        Ok(())
    }

    fn notice(&self, text: &str) {
        self.viewer.hub.publish("notice", &json!({ "kind": "notice", "text": text }));
    }

    /// Serves what an event is about.
    fn see(&mut self, event: &Event, live: &mut LiveScene) -> Result<()> {
        match event {
            Event::Started { steps, .. } => self.begin(live, *steps),
            Event::Step { report, is_last, .. } => {
                if let Some(report) = report {
                    let values = [report.loss, report.label_loss, f64::from(live.gaussian_count())];
                    self.curve.add(report.step, values);
                }
                self.after_step(live)?;
                if *is_last {
                    self.notice("The last step is done. Scoring and writing the model ...");
                }
            }
            Event::Paused { .. } => self.in_pause(live)?,
            Event::Checkpoint { step, .. } => self.notice(&format!("Saved a checkpoint of step {step}.")),
            Event::Model { step, path } => {
                self.notice(&format!("Saved the model of step {step} as {}.", path.display()))
            }
            Event::Warning(text) => self.notice(text),
            Event::Done(summary) => {
                let (psnr, iou) = summary
                    .scores
                    .as_ref()
                    .map_or((None, None), |scores| (scores.mean.psnr, scores.mean.objects.iou_map));
                let over = json!({
                    "kind": "over",
                    "stopped": summary.stopped,
                    "steps": summary.steps,
                    "psnr": psnr,
                    "iou": iou,
                    "command": self.words.view(&summary.model),
                });
                self.viewer.hub.publish("over", &over);
            }
            _ => {}
        }
        Ok(())
    }
}

impl Observer for ViewerObserver<'_> {
    fn observe(&mut self, event: &Event<'_>, live: &mut LiveScene<'_>) -> Result<Flow> {
        let asked = self.inner.observe(event, live)?;
        match self.see(event, live) {
            // Images that do not fit cost the training nothing.
            Err(error) if error.is_out_of_memory() => self.notice(&error.to_string()),
            Err(Error::Usage { problem, .. }) => self.notice(&problem),
            other => other?,
        }
        self.pace.last = Instant::now();
        if asked == Flow::Stop || self.wish.stop {
            return Ok(Flow::Stop);
        }
        if !matches!(event, Event::Step { .. } | Event::Paused { .. }) {
            return Ok(asked);
        }
        if std::mem::take(&mut self.wish.save) {
            return Ok(Flow::Save);
        }
        Ok(if self.wish.pause { Flow::Pause } else { asked })
    }
}
