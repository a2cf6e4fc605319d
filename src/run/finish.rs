//! Writes the records of a run, and scores it at the end.

use super::history::{Entry, ViewScore};
use super::info::RunEnd;
use super::pictures::WorstViews;
use super::{Event, Run, Summary, models, objects, preview, report};
use crate::edit::select::MIN_LABEL_CONFIDENCE;
use crate::error::Result;
use crate::eval::evaluate::{Rendering, evaluate};
use crate::eval::scores::{MeanScores, Scores};
use crate::eval::subject::WholeModel;
use crate::files::label_table::{self, LabelTable};
use crate::files::{atomic, run_folder};
use crate::records::occlusion_table::{self, OcclusionTable};
use crate::scene::{Camera, Gaussians, View};
use crate::scenes::colmap;
use crate::stage::Stage;
use crate::train::Occlusion;
use std::path::PathBuf;

impl Run<'_> {
    /// Writes settings, label names and cameras.
    pub(super) fn write_records(&self) -> Result<()> {
        let out = &self.request.output;
        let text = self.settings.dump(&self.facts)?;
        atomic::write(out.join(run_folder::CONFIG_FILE), |file| file.write_all(text.as_bytes()))?;
        LabelTable::write_or_remove(self.names.as_ref(), &out.join(label_table::FILE_NAME))?;
        let cameras: Vec<_> = self.dataset.all().into_iter().map(|view| (view.name.as_str(), &view.camera)).collect();
        models::save_cameras(out, &cameras)
    }

    /// Checks that the folder still belongs to this run, and restores its records if they are missing.
    pub(super) fn hold_records(&mut self) -> Result<()> {
        self.hold_folder()?;
        let out = &self.request.output;
        if !out.join(run_folder::CONFIG_FILE).exists() {
            tracing::warn!("{} was deleted; settings, labels and cameras are written again", out.display());
            self.write_records()?;
        }
        Ok(())
    }

    /// Writes the model with its final labels. Returns it with its path.
    pub(super) fn save_labelled(&mut self) -> Result<(PathBuf, Gaussians)> {
        let model = self.trainer.labelled_model().map_err(|error| self.keep_model(error))?;
        let path = self.models.save(self.trainer.steps_done(), &model)?;
        Ok((path, model))
    }

    /// Returns the summary of the training, without scores.
    pub(super) fn summary(&self, model: PathBuf) -> Summary {
        let last = self.trainer.newest_report();
        Summary {
            steps: self.trainer.steps_done(),
            seconds: self.history.seconds(),
            gaussians: self.trainer.gaussian_count(),
            loss: last.map(|report| report.loss),
            label_loss: last.map(|report| report.label_loss),
            model,
            scores: None,
            objects: Vec::new(),
            stopped: false,
        }
    }

    /// Writes the last preview, scores the saved model on the held-out views unless the run was stopped, and writes the
    /// summary. `kept` is the result of saving a stopped run's checkpoint.
    pub(super) fn finish(&mut self, summary: &mut Summary, model: &Gaussians, kept: Result<bool>) -> Result<()> {
        let step = summary.steps;
        self.save_occluders()?;
        self.save_exposures()?;
        self.save_poses()?;
        if let Some(path) = preview::write(self)? {
            self.tell(Event::Preview { step, path: &path })?;
        }
        self.tell(Event::Model { step, path: &summary.model })?;
        if !self.stopped {
            summary.scores = self.score(model)?;
            // Scoring takes long enough for another run to take the folder.
            self.hold_folder()?;
        }
        summary.stopped = self.stopped;
        summary.objects = objects::summaries(model, self.names.as_ref(), summary.scores.as_ref());
        summary.write(&self.request.output)?;
        self.finish_records(summary, model)?;
        let is_kept = kept?;
        if self.stopped {
            let further =
                if is_kept { "the run can be resumed from its checkpoint" } else { "only the scores are missing" };
            tracing::info!("stopped after step {step} of {}; {further}", self.settings.train.iterations);
        } else {
            self.checkpoints.finish()?;
        }
        if let Some(scores) = &summary.scores {
            self.tell(Event::Evaluated(scores))?;
        }
        self.tell(Event::Done(summary))
    }

    /// Completes the history and `run.json`, and writes the report.
    fn finish_records(&mut self, summary: &Summary, model: &Gaussians) -> Result<()> {
        if let Some(scores) = &summary.scores {
            let MeanScores { psnr, ssim, objects, .. } = scores.mean;
            let scored = ViewScore { step: summary.steps, view: None, psnr, ssim, iou: objects.iou_map };
            self.history.put(&Entry::Scores(scored));
        }
        self.history.sync();
        self.note_memory();
        if !self.stopped {
            self.time_passes(model);
        }
        self.info.ended = Some(RunEnd { stopped: summary.stopped, seconds: summary.seconds });
        self.write_info()?;
        let out = &self.request.output;
        let path = report::write(std::slice::from_ref(out), &out.join(report::REPORT_FILE))?;
        tracing::info!("report: {}", path.display());
        Ok(())
    }

    /// Writes the occluders of the last step.
    fn save_occluders(&self) -> Result<()> {
        let views = self.trainer.occluders();
        if views.is_empty() {
            return Ok(());
        }
        let kind = match (self.occlusion.as_deref(), self.settings.train.occlusion) {
            (Some(kind), _) => kind,
            (None, Occlusion::None) => "none",
            (None, _) => "rendered",
        };
        OcclusionTable::new(kind, views).write(&self.request.output.join(occlusion_table::OCCLUSION_FILE))
    }

    /// Writes the photos' exposure matrices, if they were trained.
    fn save_exposures(&mut self) -> Result<()> {
        let matrices = self.trainer.exposures()?;
        if matrices.is_empty() {
            return Ok(());
        }
        let found = serde_json::json!({ "schema_version": 2, "matrices": matrices });
        atomic::write_json(&self.request.output.join(run_folder::EXPOSURES_FILE), &found)
    }

    /// Writes the refined poses, if there are any, as a reconstruction and in the run's cameras. Held-out views keep
    /// their poses.
    fn save_poses(&mut self) -> Result<()> {
        let refined = self.trainer.poses()?;
        if refined.is_empty() {
            return Ok(());
        }
        let (out, views) = (&self.request.output, self.dataset.all());
        let cameras: Vec<(&str, &Camera)> =
            views.iter().map(|view| (view.name.as_str(), refined.get(&view.name).unwrap_or(&view.camera))).collect();
        let changed = || views.iter().filter_map(|view| Some((&view.camera, refined.get(&view.name)?)));
        let count = refined.len() as f64;
        let moved = changed().map(|(a, b)| a.centre().distance(b.centre())).sum::<f64>() / count;
        let turned = changed().map(|(a, b)| a.axis().angle_between(b.axis())).sum::<f64>().to_degrees() / count;
        tracing::info!(
            "poses: on average, axes turned by {turned:.3} degrees and cameras moved by {:.2} % of their radius",
            100.0 * moved / self.dataset.extent()
        );
        colmap::write::model(&out.join(run_folder::REFINED_FOLDER), &cameras, &self.dataset.points)?;
        models::save_cameras(out, &cameras)
    }

    /// Scores the held-out views, and their objects if they have masks.
    fn score(&mut self, model: &Gaussians) -> Result<Option<Scores>> {
        let views: Vec<&View> = self.dataset.test.iter().collect();
        if views.is_empty() {
            return Ok(None);
        }
        let how = Rendering::new(self.trainer.render_options());
        let _stage = Stage::new("scoring the held-out views", 0);
        let mut worst = WorstViews::default();
        let engine = self.trainer.engine_mut();
        let mut whole = WholeModel { engine, model, min_confidence: MIN_LABEL_CONFIDENCE };
        let scores = evaluate(&mut whole, &views, how, &(), &mut worst)?;
        scores.warn_of_odd_view(self.settings.train.near);
        self.info.pictures = worst.write(&self.request.output)?;
        Ok(Some(scores))
    }
}
