//! Reads and writes the models, cameras and previews of a run. Each write is atomic.

use super::{Event, Run};
use crate::error::{Error, Result};
use crate::files::{image, read};
use crate::formats::{FirstView, LazyModel, ModelRef, ReadModel, Row, read_model, write_model};
use crate::render::Render;
use crate::scene::colour::to_byte;
use crate::scene::labels::label_colour;
use crate::scene::{Camera, Gaussians, Overview, Photo};
use crate::scenes::camera_json;
use crate::train::between::StepJob;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// Folder for the models of earlier runs.
const EARLIER_FOLDER: &str = "earlier";

/// Returns the path of a step's model, in the layout that 3DGS viewers expect.
pub(crate) fn model_path(out: &Path, step: u32) -> PathBuf {
    out.join("point_cloud").join(format!("iteration_{step}")).join("point_cloud.ply")
}

/// Returns the steps of the models in the folder of a run.
fn steps(out: &Path) -> Result<Vec<u32>> {
    let folder = out.join("point_cloud");
    let entries = if folder.is_dir() { read::folder(&folder)? } else { Vec::new() };
    let steps = entries.iter().filter_map(|path| path.file_name()?.to_str()?.strip_prefix("iteration_")?.parse().ok());
    Ok(steps.filter(|&step| model_path(out, step).is_file()).collect())
}

/// Returns the model of the latest step in the folder of a run.
pub fn latest_model(out: &Path) -> Result<PathBuf> {
    steps(out)?.into_iter().max().map(|step| model_path(out, step)).ok_or_else(|| {
        Error::data(
            out,
            "",
            "is a folder without point_cloud/iteration_N/point_cloud.ply; name a PLY file or a run folder",
        )
    })
}

/// Reads a model file, or the latest model in a run folder, with the label names in the file. Logs the reader's notes.
pub(crate) fn open(path: &Path) -> Result<ReadModel> {
    let path = &model_file(path)?;
    let read = read_model(path)?;
    log_notes(path, &read.notes);
    Ok(read)
}

/// Opens a model like `open`, without reading it if it can stay in its file.
pub fn open_lazily(path: &Path) -> Result<LazyModel> {
    let path = &model_file(path)?;
    let model = LazyModel::open(path)?;
    if let LazyModel::Whole(read) = &model {
        log_notes(path, &read.notes);
    }
    Ok(model)
}

/// Returns the initial view of a model: from its file, or else from the first camera of its run.
///
/// # Errors
///
/// The model or the camera list cannot be read.
pub fn first_view(path: &Path) -> Result<Option<FirstView>> {
    let file = model_file(path)?;
    // A pipe can be read only once.
    let own = if file.is_file() { LazyModel::open(&file)?.first_view() } else { None };
    if own.is_some() {
        return Ok(own);
    }
    let views = camera_json::views_of_model(path)?;
    let all = Overview::from_cameras(views.iter().map(|view| &view.camera));
    Ok(all.zip(views.first()).map(|(all, view)| FirstView { up: all.up, eye: view.camera.centre() }))
}

/// Visits each row of a model that was opened from `path`, and logs the reader's notes.
pub fn scan(path: &Path, model: ModelRef, see: impl FnMut(u64, &Row)) -> Result<()> {
    log_notes(&model_file(path)?, &model.scan(see)?);
    Ok(())
}

/// Logs a reader's notes, each only once, because some commands read a model twice.
pub(crate) fn log_notes(path: &Path, notes: &[String]) {
    static TOLD: Mutex<BTreeSet<String>> = Mutex::new(BTreeSet::new());
    for note in notes {
        let note = format!("{}: {note}", path.display());
        if TOLD.lock().unwrap_or_else(PoisonError::into_inner).insert(note.clone()) {
            tracing::warn!("{note}");
        }
    }
}

/// Returns a model file, or the latest model file in a run folder.
pub fn model_file(path: &Path) -> Result<PathBuf> {
    if path.is_dir() { latest_model(path) } else { Ok(path.to_owned()) }
}

/// The models that a run writes. Other commands take the model of the latest step, so this run's first model moves
/// later models of an earlier run to the folder `earlier`.
pub(crate) struct Models {
    out: PathBuf,
    earlier: Vec<u32>,
}

impl Models {
    /// Makes the list for a run in the folder `out` that continues after step `from`; 0 is a new run.
    pub(crate) fn new(out: &Path, from: u32) -> Result<Self> {
        let earlier: Vec<u32> = steps(out)?.into_iter().filter(|&step| step > from).collect();
        if let Some(step) = earlier.iter().max() {
            let path = model_path(out, *step);
            tracing::warn!(
                "{} is from an earlier run; it moves to {EARLIER_FOLDER} when this run writes its first model",
                path.display()
            );
        }
        Ok(Self { out: out.to_owned(), earlier })
    }

    /// Writes a step's model.
    pub(crate) fn save(&mut self, step: u32, model: &Gaussians) -> Result<PathBuf> {
        let path = model_path(&self.out, step);
        let left_out = write_model(&path, model)?;
        if left_out > 0 {
            tracing::warn!("{}: {left_out} Gaussians are not finite and were left out", path.display());
        }
        self.note_saved(step);
        Ok(path)
    }

    /// Moves the models of an earlier run, after a step's model was written.
    pub(crate) fn note_saved(&mut self, step: u32) {
        for old in self.earlier.drain(..).filter(|&old| old != step) {
            let (from, to) = (model_path(&self.out, old), model_path(&self.out.join(EARLIER_FOLDER), old));
            let moved = to.parent().map_or(Ok(()), std::fs::create_dir_all).and_then(|()| std::fs::rename(&from, &to));
            if let Err(error) = moved {
                tracing::warn!("{}: cannot be moved: {error}", from.display());
            }
            // This fails, as it should, if the folder contains other files.
            let _ = from.parent().map(std::fs::remove_dir);
        }
    }
}

/// Writes a model during a run.
pub(super) struct ModelJob;

impl StepJob<Run<'_>> for ModelJob {
    fn is_due(&self, step: u32, run: &Run) -> bool {
        step < run.settings.train.iterations && run.settings.run.save_at.contains(&step)
    }

    fn run(&mut self, step: u32, run: &mut Run) -> Result<()> {
        let model = run.trainer.labelled_model()?;
        let saved = run.models.save(step, &model);
        match run.tolerate(saved)? {
            Some(path) => run.tell(Event::Model { step, path: &path }),
            None => Ok(()),
        }
    }
}

pub(crate) fn save_cameras(out: &Path, cameras: &[(&str, &Camera)]) -> Result<()> {
    camera_json::write_cameras(out.join(camera_json::CAMERAS_FILE), cameras)
}

/// Writes photo, render and (if it was rendered) label map side by side.
pub(crate) fn save_preview(path: &Path, photo: &Photo, rendered: &Render) -> Result<()> {
    let (width, height) = (rendered.width as usize, rendered.height as usize);
    let labels = &rendered.labels;
    let panels = if labels.is_empty() { 2 } else { 3 };
    let mut pixels = vec![[0_u8; 3]; width * panels * height];
    for y in 0..height {
        let row = &mut pixels[y * width * panels..][..width * panels];
        for x in 0..width {
            let at = y * width + x;
            let [r, g, b, _] = photo.rgba[at];
            row[x] = [r, g, b];
            row[width + x] = rendered.rgb[at].map(to_byte);
            if let Some(&label) = labels.get(at) {
                row[2 * width + x] = label_colour(label);
            }
        }
    }
    image::write_png_rgb8(path, (width * panels) as u32, height as u32, &pixels)
}
