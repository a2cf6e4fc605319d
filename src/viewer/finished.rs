//! Shows a finished model, and changes its labels.

use super::edits::Work;
use super::finder::Finder;
use super::hub::{ClientId, Hub};
use super::message::{Find, Message};
use super::object::{Object, pointed};
use super::painter::{Painter, Source};
use super::views::{Score, Views, describe_scores};
use super::{Viewer, Words, rows};
use crate::edit::add::add;
use crate::edit::merge::Merged;
use crate::edit::select::{MIN_LABEL_CONFIDENCE, extract, remove};
use crate::engine::Engine;
use crate::error::{Error, Result, Setting};
use crate::files::label_table::LabelTable;
use crate::gpu::Gpu;
use crate::label::click::Photos;
use crate::render::{Parts, RenderOptions, Rendered, render};
use crate::scene::{Camera, Dataset, Gaussians, Overview};
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
    let near = finished.options.near;
    let finder = finished.photos.map(|photos| Finder::new(Arc::clone(&gpu), photos, near, Arc::clone(&viewer.hub)));
    let drawing = Drawing {
        engine: Engine::of_model(gpu, &finished.model, sizes.chain([(1, 1)]))?,
        options: finished.options,
        confidence: finished.model.label_confidence.clone(),
        is_blank: finished.model.is_empty(),
    };
    let mut session = Session {
        hub,
        painter: Painter::new(Arc::clone(&views), is_cpu),
        drawing,
        work: Work::new(finished.path, finished.model, finished.table, finished.words),
        object: finder.map(Object::new),
        object_label: None,
        hidden: Vec::new(),
        solo: Vec::new(),
        scores: Vec::new(),
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
            None => session.score_one()?,
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

/// The engine with the drawn part of the model.
struct Drawing {
    engine: Engine,
    options: RenderOptions,
    confidence: Option<Vec<f32>>,
    /// Every label is hidden.
    is_blank: bool,
}

impl Source for Drawing {
    fn render(&mut self, camera: &Camera, parts: Parts) -> Result<Rendered> {
        if self.is_blank {
            return Ok(blank(camera, parts, self.options.background));
        }
        self.engine.grow_image(camera.width, camera.height)?;
        render(&mut self.engine, camera, &RenderOptions { parts, ..self.options })
    }

    fn confidence(&self) -> Option<&[f32]> {
        self.confidence.as_deref()
    }

    fn largest(&mut self) -> Option<(u32, u32)> {
        None
    }

    fn step(&self) -> u32 {
        0
    }
}

/// A picture of nothing.
fn blank(camera: &Camera, parts: Parts, background: [f32; 3]) -> Rendered {
    let pixels = camera.width as usize * camera.height as usize;
    let count = |asked: bool| if asked { pixels } else { 0 };
    Rendered {
        width: camera.width,
        height: camera.height,
        rgb: vec![background; pixels],
        alpha: vec![0.0; pixels],
        depth: vec![0.0; count(parts.depth)],
        top_id: vec![-1; count(parts.main)],
        top_weight: vec![0.0; count(parts.main)],
        labels: vec![0; count(parts.labels)],
    }
}

struct Session<'a> {
    hub: &'a Hub,
    painter: Painter,
    drawing: Drawing,
    work: Work<'a>,
    object: Option<Object>,
    /// The label with which the object is drawn until it has one.
    object_label: Option<u32>,
    hidden: Vec<u32>,
    solo: Vec<u32>,
    scores: Vec<Score>,
}

impl Session<'_> {
    fn hear(&mut self, id: ClientId, message: Message) -> Result<()> {
        let said = match message {
            Message::Look(look) => return self.painter.look(self.hub, id, &look, &mut self.drawing),
            Message::Pick { seq, from, pixel } => {
                return self.painter.pick(self.hub, id, (seq, &from, pixel), &mut self.drawing);
            }
            Message::Show { hidden, solo } => {
                (self.hidden, self.solo) = (hidden, solo);
                self.redraw().map(|()| String::new())
            }
            Message::Edit { what } => self.work.apply(&what).and_then(|said| self.changed().map(|()| said)),
            // The object that is pointed at is the last change.
            Message::Undo if self.object.as_ref().is_some_and(Object::is_there) => {
                self.changed().map(|()| String::new())
            }
            Message::Undo => self.work.undo().and_then(|()| self.changed()).map(|()| String::new()),
            Message::Object { what } => self.find(id, &what).map(|()| String::new()),
            Message::News { number, news } => {
                if self.object.as_mut().is_some_and(|object| object.hear(number, news, self.hub)) {
                    self.redraw()?;
                }
                // The labels of the model are the same.
                self.publish_object();
                return Ok(());
            }
            Message::Write => self.work.write(),
            Message::Train { .. } | Message::Share { .. } => Ok("No training runs.".to_owned()),
            Message::Ack { .. } | Message::Alive => return Ok(()),
        };
        match said {
            Ok(text) if text.is_empty() => {}
            Ok(text) => self.hub.reply(id, &json!({ "kind": "said", "text": text })),
            Err(error) if error.is_device_lost() => return Err(error),
            Err(error) => self.hub.reply(id, &json!({ "kind": "problem", "text": error.to_string() })),
        }
        self.publish();
        Ok(())
    }

    /// Draws a model that has changed. An object that is pointed at is one of the model before.
    fn changed(&mut self) -> Result<()> {
        self.object.as_mut().map(Object::drop);
        self.redraw()
    }

    /// Does what a page asks of the object that it points at.
    fn find(&mut self, id: ClientId, find: &Find) -> Result<()> {
        let none = || Error::usage(Setting("network"), "was not given; without one no object can be found");
        let object = self.object.as_mut().ok_or_else(none)?;
        let drawing = &mut self.drawing;
        let pointed = pointed(find, |from, pixels| self.painter.spot(from, pixels, drawing))?;
        match (find, pointed) {
            (_, Some(pointed)) => object.point(id, pointed, (&self.work.model, self.work.rows_of())),
            (Find::Keep { name }, _) => {
                self.work.apply(&object.edit(name)?)?;
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

    fn publish(&self) {
        self.publish_object();
        self.hub.publish("labels", &rows::of_model(&self.work.model, self.work.table.as_ref()));
        self.hub.publish("edits", &self.work.describe());
        self.hub.publish("shown", &json!({ "kind": "shown", "hidden": self.hidden, "solo": self.solo }));
    }

    /// Puts the visible part of the model on the device: what rendering all but the hidden labels, or only the chosen
    /// ones, would draw. Labels that are gone do not count.
    fn redraw(&mut self) -> Result<()> {
        let with;
        let rows = self.object.as_ref().and_then(Object::rows);
        let found = rows.map(|rows| add(&self.work.model, self.work.table.clone(), rows, None)).transpose()?;
        self.object_label = found.as_ref().map(|found| found.into);
        let model = match found {
            Some(Merged { model, .. }) => {
                with = model;
                &with
            }
            None => &self.work.model,
        };
        let there: std::collections::BTreeSet<u32> = model.labels.iter().flatten().copied().collect();
        self.hidden.retain(|label| there.contains(label));
        self.solo.retain(|label| there.contains(label));
        let part;
        let shown = if !self.solo.is_empty() {
            let solo: Vec<u32> = self.solo.iter().copied().chain(self.object_label).collect();
            part = extract(model, &solo, MIN_LABEL_CONFIDENCE)?;
            &part
        } else if self.hidden.is_empty() {
            model
        } else if there.iter().all(|label| self.hidden.contains(label)) {
            self.drawing.is_blank = true;
            return Ok(());
        } else {
            part = remove(model, &self.hidden)?;
            &part
        };
        self.drawing.is_blank = shown.is_empty();
        if !shown.is_empty() {
            self.drawing.engine.upload_model(shown)?;
            self.drawing.confidence.clone_from(&shown.label_confidence);
        }
        Ok(())
    }

    /// Scores the next view of the whole, unchanged model while nothing else is to do.
    fn score_one(&mut self) -> Result<()> {
        let views = Arc::clone(&self.painter.views);
        let is_whole = self.hidden.is_empty() && self.solo.is_empty() && !self.work.is_changed();
        // Views without a photo have no score.
        let next = (self.scores.len()..views.list.len()).find(|&index| views.list[index].view.photo.is_some());
        let Some(index) = next.filter(|_| is_whole && self.hub.is_watched()) else { return Ok(()) };
        self.scores.resize(index, Score::default());
        self.scores.push(self.painter.score(index, &mut self.drawing)?);
        self.hub.publish("scores", &describe_scores(&self.scores, 0));
        Ok(())
    }
}
