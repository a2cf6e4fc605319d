//! The object that pages point at, until it becomes a label or is discarded.

use super::finder::{Finder, News, Pointing, Spot};
use super::hub::{ClientId, Hub};
use super::message::{ObjectRequest, Viewpoint};
use crate::edit::{Edit, Rows};
use crate::error::{Error, Result};
use crate::scene::Gaussians;
use serde_json::{Value, json};
use std::sync::Arc;

/// Points along each side of a box whose surface points are projected into a photo.
const BOX_SAMPLES_PER_SIDE: u32 = 16;

/// The object, and who looks for it.
pub(super) struct Object {
    finder: Finder,
    /// Which Gaussians the finder has ([`Work::rows_version`](super::edits::Work::rows_version)).
    sent: Option<u64>,
    found: Option<Answer>,
    /// What the finder does: photos that were asked, of how many, and seconds left.
    asked: Option<(usize, usize, Option<f64>)>,
}

/// An answer.
struct Answer {
    rows: Arc<[bool]>,
    flags: Vec<(&'static str, String)>,
    /// A better answer is on its way.
    is_first: bool,
}

impl Object {
    pub(super) fn new(finder: Finder) -> Self {
        Self { finder, sent: None, found: None, asked: None }
    }

    /// Returns true while an object is looked for or shown.
    pub(super) fn is_there(&self) -> bool {
        self.found.is_some() || self.asked.is_some()
    }

    /// Looks for what a page points at. `version` stands for the Gaussians of `model`.
    pub(super) fn point(
        &mut self,
        client: ClientId,
        pointed: Pointing,
        (model, version): (&Gaussians, u64),
    ) -> Result<()> {
        if matches!(pointed, Pointing::Click(_, false)) && !self.is_there() {
            return Err(Error::usage("point", "click the object first, then exclude what does not belong to it"));
        }
        if self.sent != Some(version) {
            self.finder.set_model(model.clone());
            self.sent = Some(version);
        }
        self.finder.point(client, pointed);
        self.asked = Some((0, 0, None));
        Ok(())
    }

    /// Takes news of the finder. Returns true if another object is to be drawn.
    pub(super) fn hear(&mut self, number: u64, news: News, hub: &Hub) -> bool {
        if let News::Failed(client, text) = &news {
            hub.reply(*client, &json!({ "kind": "problem", "text": text }));
        }
        if number != self.finder.newest() {
            return false;
        }
        match news {
            News::Asked { done, all, left } => self.asked = Some((done, all, left)),
            News::Found { rows, flags, is_last } => {
                self.found = Some(Answer { rows, flags, is_first: !is_last });
                self.asked = self.asked.filter(|_| !is_last);
                return true;
            }
            News::Failed(..) => self.asked = None,
        }
        false
    }

    /// Forgets the object. Returns true if one was drawn.
    pub(super) fn drop(&mut self) -> bool {
        if self.is_there() {
            self.finder.forget();
        }
        self.asked = None;
        self.found.take().is_some()
    }

    /// Returns the rows of the object, if there are some.
    pub(super) fn rows(&self) -> Option<&[bool]> {
        self.found.as_ref().map(|found| &*found.rows)
    }

    /// Returns the change that makes a label of it.
    pub(super) fn edit(&self, name: &str) -> Result<Edit> {
        let none = || Error::usage("object", "no object was found yet");
        let rows = Rows::from_mask(self.rows().ok_or_else(none)?);
        let name = Some(name.trim().to_owned()).filter(|name| !name.is_empty());
        Ok(Edit::Assign { rows, label: None, name })
    }

    /// Returns what pages show of it. `label` is the one that it is drawn with.
    pub(super) fn describe(&self, label: Option<u32>) -> Value {
        let rows = self.rows().map(|rows| rows.iter().filter(|is_in| **is_in).count());
        json!({
            "kind": "object",
            "label": label,
            "count": rows,
            "first": self.found.as_ref().is_some_and(|found| found.is_first),
            "asked": self.asked.map(|(done, all, left)| json!({ "done": done, "all": all, "left": left })),
            "flags": self.found.as_ref().map(|found| &found.flags),
        })
    }
}

/// Returns what a page points at; `at` finds what is at pixels of an image.
pub(super) fn pointed(
    find: &ObjectRequest,
    at: impl FnOnce(&Viewpoint, &[[u32; 2]]) -> Result<Spot>,
) -> Result<Option<Pointing>> {
    Ok(match find {
        ObjectRequest::Click { from, pixel, on } => Some(Pointing::Click(at(from, &[*pixel])?, *on)),
        ObjectRequest::Box { from, corners: [x0, y0, x1, y1] } => {
            if x0 >= x1 || y0 >= y1 {
                return Err(Error::usage("corners", "the box is empty; drag a larger one"));
            }
            let pixels = match from {
                Viewpoint::View(_) => vec![[*x0, *y0], [*x1, *y1]],
                // Corners of a box around an object show what is behind it.
                Viewpoint::Camera(_) => ellipse([*x0, *y0, *x1, *y1]),
            };
            Some(Pointing::Area(at(from, &pixels)?))
        }
        ObjectRequest::Keep { .. } | ObjectRequest::Drop => None,
    })
}

/// Returns pixels all over the ellipse in a box.
fn ellipse([x0, y0, x1, y1]: [u32; 4]) -> Vec<[u32; 2]> {
    let steps = || (0..=BOX_SAMPLES_PER_SIDE).map(|step| 2.0 * f64::from(step) / f64::from(BOX_SAMPLES_PER_SIDE) - 1.0);
    let along = |share: f64, from: u32, to: u32| {
        (f64::from(from) + (0.5 + 0.5 * share) * (f64::from(to) - f64::from(from))).round() as u32
    };
    let inside = steps().flat_map(|x| steps().map(move |y| (x, y))).filter(|(x, y)| x * x + y * y <= 1.0);
    inside.map(|(x, y)| [along(x, x0, x1), along(y, y0, y1)]).collect()
}
