//! Shows a finished model, and changes its labels.

use super::chosen::Chosen;
use super::drawing::{Drawing, Shown};
use super::edits::Work;
use super::exports::export;
use super::finder::Finder;
use super::hub::{ClientId, Hub};
use super::message::{Find, Message};
use super::object::{Object, pointed};
use super::painter::{Painter, Source};
use super::portraits::Portraits;
use super::views::{Score, Views, describe_scores};
use super::{Viewer, Words, rows};
use crate::edit::Edit;
use crate::edit::add::add;
use crate::edit::fill::Sight;
use crate::engine::Engine;
use crate::error::{Error, Result, Setting};
use crate::eval::removal::sights;
use crate::files::label_table::LabelTable;
use crate::formats::{FirstView, formats};
use crate::gpu::Gpu;
use crate::label::click::Photos;
use crate::render::RenderOptions;
use crate::scene::{Camera, Dataset, Gaussians, Overview, View};
use crate::words::counted;
use glam::DVec3;
use serde_json::json;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

/// Time between two looks for work.
const TURN: Duration = Duration::from_millis(200);

/// What is shown.
pub struct Finished<'a> {
    /// The model as it was typed.
    pub path: &'a Path,
    /// The model.
    pub model: Gaussians,
    /// Names of its labels.
    pub table: Option<LabelTable>,
    /// Views with photos, and masks to score with; may be empty.
    pub dataset: &'a Dataset,
    /// Near plane and background.
    pub options: RenderOptions,
    /// Commands to show.
    pub words: &'a dyn Words,
    /// Photos that are asked for an object that a page points at; without them pages cannot point at objects.
    pub photos: Option<Photos>,
}

/// Serves a finished model until `goes_on` says no. Changes that are in no file yet are saved then; returns their file. As
/// long as that fails, it says why and goes on, so that they can be saved from the page.
///
/// # Errors
///
/// A device that fails. What a page asks for wrongly is told to the page.
pub fn show(viewer: &Viewer, finished: Finished, gpu: Arc<Gpu>, goes_on: &dyn Fn() -> bool) -> Result<Option<PathBuf>> {
    let views = Arc::new(Views::new(finished.dataset));
    let sizes = views.list.iter().map(|posed| (posed.view.camera.width, posed.view.camera.height));
    let (hub, is_cpu) = (&*viewer.hub, gpu.is_cpu());
    let frame = views.frame().unwrap_or_else(|| frame_of(&finished.model));
    let name = gpu.capabilities().name.clone();
    hub.set_views(Arc::clone(&views));
    let mut scene = scene(&views, frame, &finished.path.display().to_string(), (&name, false));
    scene["finds"] = finished.photos.is_some().into();
    scene["fills"] = finished.dataset.train.iter().any(|view| view.photo.is_some()).into();
    scene["formats"] = json!(formats());
    let near = finished.options.near;
    let finder = finished.photos.map(|photos| Finder::new(Arc::clone(&gpu), photos, near, Arc::clone(&viewer.hub)));
    let frame_up = frame.up;
    let first_view = views.list.first().map(|first| FirstView { up: frame.up, eye: first.view.camera.centre() });
    let engine = Engine::of_model(gpu, &finished.model, sizes.chain([(1, 1)]))?;
    let mut session = Session {
        hub,
        painter: Painter::new(Arc::clone(&views), is_cpu),
        background: finished.options.background,
        drawing: Drawing::new(engine, finished.options, &finished.model),
        chosen: Chosen::new(&finished.model),
        work: Work::new(finished.path, finished.model, finished.table, finished.words),
        object: finder.map(Object::new),
        object_label: None,
        shown: Shown::default(),
        portraits: Portraits::default(),
        scores: Vec::new(),
        views: finished.dataset.train.iter().filter(|view| view.photo.is_some()).collect(),
        up: frame_up,
        first_view,
    };
    hub.publish("scene", &scene);
    session.publish();
    let mut is_refused = false;
    loop {
        if !goes_on() {
            match session.work.save() {
                Ok(file) => return Ok(file),
                Err(error) if !is_refused => {
                    is_refused = true;
                    tracing::error!(
                        "the changes cannot be saved: {error}. The page is still there; a second signal ends it"
                    );
                }
                Err(_) => {}
            }
        }
        match hub.next(TURN) {
            Some((id, message)) => session.hear(id, message)?,
            None => session.use_pause()?,
        }
    }
}

/// Returns what a page has to know of the scene.
pub(super) fn scene(
    views: &Views,
    Overview { up, target, distance }: Overview,
    title: &str,
    (device, is_training): (&str, bool),
) -> serde_json::Value {
    json!({
        "kind": "scene",
        "title": title,
        "training": is_training,
        "device": device,
        "views": views.describe(),
        "up": up.to_array(),
        "target": target.to_array(),
        "distance": distance,
        "masks": views.list.iter().any(|posed| posed.view.mask.is_some()),
        "version": env!("CARGO_PKG_VERSION"),
    })
}

/// Returns where to see a model from that has no views: half of it is in the middle.
fn frame_of(model: &Gaussians) -> Overview {
    let quantiles = [0, 1, 2].map(|axis| {
        let mut values: Vec<f32> = model.means.iter().map(|mean| mean[axis]).filter(|v| v.is_finite()).collect();
        values.sort_by(f32::total_cmp);
        [0.1, 0.5, 0.9].map(|share| {
            let at = ((values.len().max(1) - 1) as f64 * share) as usize;
            values.get(at).map_or(0.0, |&value| f64::from(value))
        })
    });
    let middle = DVec3::from_array(quantiles.map(|[_, middle, _]| middle));
    let size = quantiles.map(|[low, _, high]| high - low).into_iter().fold(1e-3, f64::max);
    // Most captures have the axes of COLMAP, y down.
    Overview { up: DVec3::NEG_Y, target: model.origin + middle, distance: 1.5 * size }
}

struct Session<'a> {
    hub: &'a Hub,
    painter: Painter,
    drawing: Drawing,
    work: Work<'a>,
    chosen: Chosen,
    object: Option<Object>,
    /// The label with which the object is drawn until it has one.
    object_label: Option<u32>,
    shown: Shown,
    portraits: Portraits,
    scores: Vec<Score>,
    /// The training views, for what fills a hole.
    views: Vec<&'a View>,
    /// Colour behind the model that it is scored with.
    background: [f32; 3],
    /// The way up, of length 1.
    up: DVec3,
    first_view: Option<FirstView>,
}

impl Session<'_> {
    fn hear(&mut self, id: ClientId, message: Message) -> Result<()> {
        let said = match message {
            Message::Look(look) => return self.painter.look(self.hub, id, &look, &mut self.drawing),
            Message::Pick { seq, from, pixel } => {
                return self.painter.pick(self.hub, id, (seq, &from, pixel), &mut self.drawing);
            }
            Message::News { number, news } => {
                if self.object.as_mut().is_some_and(|object| object.hear(number, news, self.hub)) {
                    self.redraw()?;
                }
                // The labels of the model are the same.
                self.publish_object();
                return Ok(());
            }
            Message::Ack { .. } | Message::Alive => return Ok(()),
            message => self.serve(id, message),
        };
        match said {
            Ok(text) if text.is_empty() => {}
            Ok(text) => self.hub.reply(id, &json!({ "kind": "said", "text": text })),
            Err(error) if error.is_device_lost() => return Err(error),
            Err(error) => self.hub.reply(id, &json!({ "kind": "problem", "text": error.to_string() })),
        }
        if let Some(text) = self.work.take_problem() {
            self.hub.reply(id, &json!({ "kind": "problem", "text": text }));
        }
        self.publish();
        Ok(())
    }

    /// Does what a page asks. Returns a sentence for it, or none.
    fn serve(&mut self, id: ClientId, message: Message) -> Result<String> {
        match message {
            Message::Show { hidden, solo } => {
                self.shown = Shown { hidden, solo };
                self.redraw()?;
            }
            Message::Background { colour } if colour.iter().all(|value| (0.0..=1.0).contains(value)) => {
                self.drawing.options.background = colour;
            }
            Message::Choose { what } => {
                let is_drawn = self.shown.rows(self.work.model());
                let with = (&self.painter, &mut self.drawing as &mut dyn Source);
                self.chosen.choose(&what, self.work.model(), &is_drawn, with)?;
                self.redraw()?;
            }
            Message::Edit { what } => self.edit(what)?,
            // The object that is pointed at is the last change.
            Message::Undo if self.object.as_ref().is_some_and(Object::is_there) => self.changed()?,
            Message::Undo => {
                self.work.undo()?;
                self.changed()?;
            }
            Message::Redo => {
                let done = self.work.redo(&mut sights_of(&mut self.drawing, &self.views));
                self.after(done)?;
            }
            Message::Object { what } => self.find(id, &what)?,
            Message::Write => return self.work.write(),
            Message::Export { what } => {
                let (path, count) = export(&what, &self.work, &self.chosen, self.first_view)?;
                let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
                let file = self.hub.add_file(path.clone());
                self.hub.reply(id, &json!({ "kind": "exported", "file": file, "name": name }));
                return Ok(format!("{} in {}.", counted(count, "Gaussian"), path.display()));
            }
            _ => return Ok("No training runs.".to_owned()),
        }
        Ok(String::new())
    }

    /// Makes a change; one of rows has those that are chosen.
    fn edit(&mut self, edit: Edit) -> Result<()> {
        let edit = edit.with_rows(self.chosen.rows());
        let done = self.work.apply(edit, &mut sights_of(&mut self.drawing, &self.views));
        self.after(done)
    }

    /// Draws the model after a change. One that failed leaves what is chosen, but may have left another model on the device.
    fn after(&mut self, done: Result<()>) -> Result<()> {
        if done.is_ok() { self.changed() } else { self.redraw().and(done) }
    }

    /// Draws a model that has changed. What was pointed at or chosen is of the model before.
    fn changed(&mut self) -> Result<()> {
        self.object.as_mut().map(Object::drop);
        self.chosen = Chosen::new(self.work.model());
        self.redraw()
    }

    /// Does what a page asks of the object that it points at.
    fn find(&mut self, id: ClientId, find: &Find) -> Result<()> {
        let none = || Error::usage(Setting("network"), "was not given; without one no object can be found");
        let object = self.object.as_mut().ok_or_else(none)?;
        let drawing = &mut self.drawing;
        let pointed = pointed(find, |from, pixels| self.painter.spot(from, pixels, drawing))?;
        match (find, pointed) {
            (_, Some(pointed)) => object.point(id, pointed, (self.work.model(), self.work.rows_version())),
            (Find::Keep { name }, _) => {
                let edit = object.edit(name)?;
                self.work.apply(edit, &mut sights_of(&mut self.drawing, &self.views))?;
                let label = self.object_label;
                self.changed()?;
                self.publish();
                self.hub.reply(id, &json!({ "kind": "kept", "label": label }));
                Ok(())
            }
            _ => self.changed(),
        }
    }

    fn publish_object(&self) {
        if let Some(object) = &self.object {
            self.hub.publish("object", &object.describe(self.object_label));
        }
    }

    fn publish(&mut self) {
        self.publish_object();
        self.hub.publish("labels", &rows::of_model(self.work.model(), self.work.table()));
        self.hub.publish("edits", &self.work.describe());
        self.hub.publish("chosen", &self.chosen.describe());
        self.portraits.note(self.work.model());
        let Shown { hidden, solo } = &self.shown;
        let background = self.drawing.options.background;
        self.hub
            .publish("shown", &json!({ "kind": "shown", "hidden": hidden, "solo": solo, "background": background }));
    }

    /// Puts the visible part of the model on the device. An object that is pointed at is always visible.
    fn redraw(&mut self) -> Result<()> {
        let rows = self.object.as_ref().and_then(Object::rows);
        let table = self.work.table().cloned();
        let found = rows.map(|rows| add(self.work.model(), table, rows, None)).transpose()?;
        self.object_label = found.as_ref().map(|found| found.into);
        let model = found.as_ref().map_or(self.work.model(), |found| &found.model);
        self.shown.retain(model);
        let is_solo = !self.shown.solo.is_empty();
        let solo = self.shown.solo.iter().copied().chain(self.object_label.filter(|_| is_solo)).collect();
        let shown = Shown { solo, hidden: self.shown.hidden.clone() };
        self.drawing.show(model, &shown.rows(model), self.chosen.mask())
    }

    /// Makes pictures of labels, then scores, while nothing else is to do.
    fn use_pause(&mut self) -> Result<()> {
        if !self.hub.is_watched() {
            return Ok(());
        }
        let cameras: Vec<&Camera> = self.painter.views.list.iter().map(|posed| &posed.view.camera).collect();
        let up = self.up;
        let from = (&cameras[..], up, self.drawing.options.near);
        if self.portraits.make_some(&mut self.drawing.engine, self.work.model(), from, self.hub)? {
            return self.redraw();
        }
        self.score_one()
    }

    /// Scores the next view of the whole, unchanged model.
    fn score_one(&mut self) -> Result<()> {
        let views = Arc::clone(&self.painter.views);
        let is_plain = self.shown.is_whole()
            && !self.work.is_changed()
            && !self.chosen.mask().contains(&true)
            && self.drawing.options.background == self.background;
        // Views without a photo have no score.
        let next = (self.scores.len()..views.list.len()).find(|&index| views.list[index].view.photo.is_some());
        let Some(index) = next.filter(|_| is_plain) else { return Ok(()) };
        self.scores.resize(index, Score::default());
        self.scores.push(self.painter.score(index, &mut self.drawing)?);
        self.hub.publish("scores", &describe_scores(&self.scores, 0));
        Ok(())
    }
}

/// Returns what draws a model from the training views.
fn sights_of<'a>(drawing: &'a mut Drawing, views: &'a [&View]) -> impl FnMut(&Gaussians) -> Result<Vec<Sight>> + 'a {
    move |model| {
        if views.is_empty() {
            return Err(Error::usage("hole", "is filled by the training views of a scene; open the model with its scene"));
        }
        drawing.engine.upload_model(model)?;
        sights(&mut drawing.engine, views, drawing.options.near)
    }
}
