//! Requests of pages for a finished model: images, selections, edits, files.

use super::chosen::Selection;
use super::drawing::{Drawing, Visibility};
use super::edits::Work;
use super::exports::export;
use super::finished::frame_of;
use super::hub::{ClientId, Hub};
use super::message::{Message, ObjectRequest};
use super::object::{Object, pointed};
use super::painter::{Painter, Source};
use super::portraits::Portraits;
use super::rows;
use super::views::{Score, describe_scores};
use crate::edit::Edit;
use crate::edit::add::add;
use crate::edit::fill::Sight;
use crate::error::{Error, Result, Setting};
use crate::eval::removal::sights;
use crate::files::label_table::LabelTable;
use crate::formats::FirstView;
use crate::run::models;
use crate::scene::{Gaussians, Overview, View};
use crate::words::counted;
use glam::DVec3;
use serde_json::{Value, json};
use std::path::Path;
use std::sync::Arc;

/// A finished model with the edits and selections of the pages.
pub(super) struct Session<'a> {
    pub(super) hub: &'a Hub,
    pub(super) painter: Painter,
    pub(super) drawing: Drawing,
    pub(super) work: Work<'a>,
    pub(super) chosen: Selection,
    pub(super) object: Option<Object>,
    /// The label with which the object is drawn until it has one.
    pub(super) object_label: Option<u32>,
    pub(super) shown: Visibility,
    /// State of the model whose labels pages know.
    pub(super) told: Option<u64>,
    pub(super) portraits: Portraits,
    pub(super) scores: Vec<Score>,
    /// The training views, for what fills a hole.
    pub(super) views: Vec<&'a View>,
    /// Colour behind the model that it is scored with.
    pub(super) background: [f32; 3],
    /// The way up, of length 1.
    pub(super) up: DVec3,
    pub(super) first_view: Option<FirstView>,
    /// The scene as described to pages.
    pub(super) scene: Value,
}

impl Session<'_> {
    pub(super) fn hear(&mut self, id: ClientId, message: Message) -> Result<()> {
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
            Ok(text) => self.tell(id, "said", &text),
            Err(error) if error.is_device_lost() => return Err(error),
            Err(error) => self.tell(id, "problem", &error.to_string()),
        }
        if let Some(text) = self.work.take_problem() {
            self.tell(id, "problem", &text);
        }
        self.publish();
        Ok(())
    }

    /// Sends a text to the page that asked, or to all pages for a request of the server.
    fn tell(&self, id: ClientId, kind: &'static str, text: &str) {
        let message = json!({ "kind": kind, "text": text });
        if id == 0 { self.hub.publish(kind, &message) } else { self.hub.reply(id, &message) }
    }

    /// Serves a request. Returns a sentence for the page, or an empty text.
    fn serve(&mut self, id: ClientId, message: Message) -> Result<String> {
        match message {
            Message::Show { hidden, solo } => {
                self.shown = Visibility { hidden, solo };
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
            Message::Open { path } => return self.open(&path),
            Message::Object { what } => self.find(id, &what)?,
            Message::Write => return self.work.write(),
            Message::Export { what } => {
                let cameras = self.painter.views.cameras();
                let (path, count) = export(&what, &self.work, &self.chosen, (self.first_view, &cameras))?;
                let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
                let file = self.hub.add_file(path.clone());
                self.hub.reply(id, &json!({ "kind": "exported", "file": file, "name": name }));
                return Ok(format!("{} in {}.", counted(count, "Gaussian"), path.display()));
            }
            _ => return Ok("No training is running.".to_owned()),
        }
        Ok(String::new())
    }

    /// Shows another model from the same views. Changes of the one before are saved.
    fn open(&mut self, path: &Path) -> Result<String> {
        let read = models::open(path)?;
        let saved = self.work.save()?;
        let table = LabelTable::find_for_model(path).map(|table| LabelTable::read(&table)).transpose()?.or(read.names);
        let first_view = read.first_view;
        self.work = self.work.reopened(path, read.gaussians, table).seen_from(first_view);
        let frame = self.painter.views.frame().unwrap_or_else(|| frame_of(self.work.model(), first_view));
        let from = first_view.filter(|_| self.painter.views.list.is_empty());
        self.up = frame.up;
        let Overview { up, target, distance } = frame;
        for (key, value) in [
            ("title", json!(path.display().to_string())),
            ("up", json!(up.to_array())),
            ("target", json!(target.to_array())),
            ("distance", json!(distance)),
            ("from", json!(from.map(|view| (view.eye - target).to_array()))),
        ] {
            self.scene[key] = value;
        }
        self.scores.clear();
        self.shown = Visibility::default();
        self.hub.publish("scene", &self.scene);
        self.changed()?;
        Ok(saved.map_or(String::new(), |saved| {
            format!("The edits of the previous model are saved in {}.", saved.display())
        }))
    }

    /// Makes a change; one of rows has those that are chosen.
    fn edit(&mut self, edit: Edit) -> Result<()> {
        let edit = edit.with_rows(self.chosen.rows());
        let done = self.work.apply(edit, &mut sights_of(&mut self.drawing, &self.views));
        self.after(done)
    }

    /// Draws the model after a change. One that failed leaves what is chosen, but may have left another model on the
    /// device.
    fn after(&mut self, done: Result<()>) -> Result<()> {
        if done.is_ok() { self.changed() } else { self.redraw().and(done) }
    }

    /// Draws a model that has changed. What was pointed at or chosen is of the model before.
    fn changed(&mut self) -> Result<()> {
        self.object.as_mut().map(Object::drop);
        self.chosen = Selection::new(self.work.model());
        self.redraw()
    }

    /// Does what a page asks of the object that it points at.
    fn find(&mut self, id: ClientId, find: &ObjectRequest) -> Result<()> {
        let none = || Error::usage(Setting("network"), "is missing; finding objects needs a segmentation network");
        let object = self.object.as_mut().ok_or_else(none)?;
        let drawing = &mut self.drawing;
        let pointed = pointed(find, |from, pixels| self.painter.spot(from, pixels, drawing))?;
        match (find, pointed) {
            (_, Some(pointed)) => object.point(id, pointed, (self.work.model(), self.work.rows_version())),
            (ObjectRequest::Keep { name }, _) => {
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

    pub(super) fn publish(&mut self) {
        self.publish_object();
        if self.told != Some(self.work.version()) {
            self.told = Some(self.work.version());
            self.hub.publish("labels", &rows::of_model(self.work.model(), self.work.table()));
            self.portraits.note(self.work.model());
        }
        self.hub.publish("edits", &self.work.describe());
        self.hub.publish("chosen", &self.chosen.describe());
        let Visibility { hidden, solo } = &self.shown;
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
        let shown = Visibility { solo, hidden: self.shown.hidden.clone() };
        self.drawing.show(model, &shown.rows(model), self.chosen.mask())
    }

    /// Makes images of labels, then scores, while nothing else is to do.
    pub(super) fn use_pause(&mut self) -> Result<()> {
        if !self.hub.is_watched() {
            return Ok(());
        }
        let cameras = self.painter.views.cameras();
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
            return Err(Error::usage("hole", "needs the training views of a scene; open the model with its scene"));
        }
        drawing.engine.upload_model(model)?;
        sights(&mut drawing.engine, views, drawing.options.near)
    }
}
