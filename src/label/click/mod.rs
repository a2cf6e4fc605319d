//! Finds an object from clicks or a box in photos. A segmentation network makes a mask there, and the model carries the
//! object into other views.

mod photos;
mod question;
mod shapes;

pub use photos::Photos;

use crate::engine::Engine;
use crate::error::{Error, Result, Setting};
use crate::gpu::Gpu;
use crate::label::vote::ballot::{Sweep, Voter, sweep};
use crate::label::vote::decide::decide;
use crate::label::vote::model::vote_engine;
use crate::render::{Parts, Render, RenderOptions, render};
use crate::scene::{Gaussians, LabelMap, Pixels, View};
use crate::segment::{PhotoPoint, PreparedPhoto, Prompt};
use glam::{DVec2, DVec3};
use photos::Masks;
use question::{Question, Spot, Target};
use rayon::prelude::*;
use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::Duration;

/// Largest relative depth difference at which a view sees a point rather than something in front of it.
const DEPTH_SHARE_MAX: f64 = 0.04;
/// Id of the object in temporary masks and labels.
const OBJECT_ID: u16 = 1;

/// A click in a photo.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Click {
    /// Index of the view.
    pub view: usize,
    /// Column and row, px of [`Photos::size`].
    pub pixel: [u32; 2],
    /// True on the object, false on something that does not belong to it.
    pub is_on: bool,
}

/// A box around the object in a photo.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Area {
    /// Index of the view.
    pub view: usize,
    /// First column and row, and one past the last, px of [`Photos::size`].
    pub corners: [u32; 4],
}

/// The user's hints for an object: at least one click on it, or a box.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Hints {
    /// Clicks.
    pub clicks: Vec<Click>,
    /// A box.
    pub area: Option<Area>,
}

impl Hints {
    /// Returns the equivalent flags of `labelgs label`, with their values.
    pub fn flags(&self, photos: &Photos) -> Vec<(&'static str, String)> {
        let click = |Click { view, pixel: [x, y], is_on }: &Click| {
            (if *is_on { "click" } else { "not" }, format!("{}:{x},{y}", photos.name(*view)))
        };
        let area = |Area { view, corners: [x0, y0, x1, y1] }: &Area| {
            ("box", format!("{}:{x0},{y0},{x1},{y1}", photos.name(*view)))
        };
        self.area.iter().map(area).chain(self.clicks.iter().map(click)).collect()
    }

    /// Returns the view of the box, or else of the first click on the object.
    fn first(&self) -> Result<usize> {
        let click = self.clicks.iter().find(|click| click.is_on).map(|click| click.view);
        self.area.map(|area| area.view).or(click).ok_or_else(|| {
            Error::usage(Setting("click"), "no click is on the object; give at least one, or a box around the object")
        })
    }
}

/// Progress of a search.
#[derive(Clone, Copy, Debug)]
pub enum Progress<'a> {
    /// Queries of the network.
    Asked {
        /// Photos done in this round.
        done: usize,
        /// All photos of this round.
        all: usize,
        /// Estimated time for photos that the network has not seen before, if known.
        left: Option<Duration>,
    },
    /// A first result: which Gaussians belong to the object.
    First(&'a [bool]),
}

/// Receives progress. An error cancels the search.
pub type ProgressObserver<'a> = &'a mut dyn FnMut(Progress) -> Result<()>;

/// Finds objects in a model. Results per view are cached for later searches.
pub struct ObjectFinder<'a> {
    engine: Engine,
    means: Vec<[f32; 3]>,
    photos: &'a Photos,
    near: f32,
    known: Vec<ViewCache>,
    /// Views whose photos the network has not encoded yet; then time and number of the encoded ones.
    unseen: BTreeSet<usize>,
    looked: (Duration, u32),
    answers: Vec<(Question, Vec<bool>)>,
}

/// Adds Gaussians to an object, or removes them.
fn joined(object: Option<&[bool]>, rows: &[bool], is_on: bool) -> Vec<bool> {
    let Some(object) = object else { return rows.to_vec() };
    object.iter().zip(rows).map(|(&old, &new)| if is_on { old || new } else { old && !new }).collect()
}

fn nothing(by_box: bool) -> Error {
    let problem = "the network found no object there that the model shows; try another view";
    Error::usage(Setting(if by_box { "box" } else { "click" }), problem)
}

/// Returns the index of the pixel at a position; positions outside are clamped to the border.
fn pixel_of([x, y]: PhotoPoint, view: &View) -> usize {
    let along = |at: f32, size: u32| (at.max(0.0) as u32).min(size - 1);
    (along(y, view.camera.height) * view.camera.width + along(x, view.camera.width)) as usize
}

/// Cached renders of a view.
#[derive(Default)]
struct ViewCache {
    shown: Option<Render>,
    prepared: Option<PreparedPhoto>,
}

impl<'a> ObjectFinder<'a> {
    /// Uploads a model to the device.
    pub fn new(gpu: Arc<Gpu>, model: &Gaussians, photos: &'a Photos, near: f32) -> Result<Self> {
        let engine = vote_engine(gpu, model, &photos.views.iter().collect::<Vec<_>>(), 2)?;
        let known = photos.views.iter().map(|_| ViewCache::default()).collect();
        let (unseen, looked) = (BTreeSet::new(), (Duration::ZERO, 0));
        Ok(Self { engine, means: model.means.clone(), photos, near, known, unseen, looked, answers: Vec::new() })
    }

    /// Drops the largest cached data, before another object.
    pub fn forget(&mut self) {
        self.known.iter_mut().for_each(|known| known.prepared = None);
        self.answers.clear();
    }

    /// Returns the view that sees most of the points from a direction similar to `eye`, and their positions in it.
    pub fn nearest(&mut self, points: &[DVec3], eye: DVec3) -> Result<Option<(usize, Vec<[u32; 2]>)>> {
        let middle = points.iter().sum::<DVec3>() / points.len().max(1) as f64;
        for view in self.views_by_direction(eye, middle) {
            let mut seen = Vec::new();
            for &point in points {
                seen.extend(self.place_of(view, point)?.map(|place| self.photos.pixel(view, place)));
            }
            if 2 * seen.len() > points.len() {
                return Ok(Some((view, seen)));
            }
        }
        Ok(None)
    }

    /// Returns which Gaussians belong to the object. Starts with the box or the first click on the object. Each further
    /// click on the object adds Gaussians, and each click off it removes some, unless the current result already
    /// agrees. Clicks on the object come first, whatever their original order.
    pub fn object(&mut self, hints: &Hints, observe: ProgressObserver) -> Result<Vec<bool>> {
        hints.first()?;
        let mut spots = Vec::new();
        for click in &hints.clicks {
            spots.push(self.spot(*click)?);
        }
        spots.sort_by_key(|spot| !spot.is_on);
        let area = hints.area.map(|area| Question { target: Target::Box(area), others: Vec::new() });
        let mut object = area.map(|area| self.remembered(area, observe)).transpose()?;
        for &spot in &spots {
            if object.as_ref().is_some_and(|object| object[spot.gaussian] == spot.is_on) {
                continue;
            }
            let others: Vec<Spot> = spots.iter().filter(|other| other.is_on != spot.is_on).copied().collect();
            let before = object.as_deref();
            let found =
                self.meant(spot, if before.is_some() { &others } else { &[] }, &mut |progress| match progress {
                    Progress::First(rows) => observe(Progress::First(&joined(before, rows, spot.is_on))),
                    asked @ Progress::Asked { .. } => observe(asked),
                })?;
            object = Some(joined(before, &found, spot.is_on));
        }
        object.filter(|object| object.contains(&true)).ok_or_else(|| nothing(hints.area.is_some()))
    }

    /// Returns the model surface at a click.
    fn spot(&mut self, Click { view, pixel, is_on }: Click) -> Result<Spot> {
        let place = self.photos.drawn(view, pixel.map(|at| at as f32 + 0.5));
        let point = self.surface(view, place)?;
        let shown = self.known[view].shown.as_ref();
        let top = shown.map(|shown| shown.top_id[pixel_of(place, &self.photos.views[view])]);
        let gaussian = top.and_then(|top| usize::try_from(top).ok()).filter(|top| *top < self.means.len());
        match (point, gaussian) {
            (Some(point), Some(gaussian)) => Ok(Spot { view, point, gaussian, is_on }),
            _ => {
                let [x, y] = pixel;
                let problem = format!("{}:{x},{y} shows nothing of the model", self.photos.name(view));
                Err(Error::usage(Setting(if is_on { "click" } else { "not" }), problem))
            }
        }
    }

    /// Returns the surface point at a position in a view, if there is one.
    fn surface(&mut self, view: usize, [x, y]: PhotoPoint) -> Result<Option<DVec3>> {
        let place = DVec2::new(f64::from(x), f64::from(y));
        let depth = self.depth(view, place)?;
        Ok(depth.map(|depth| self.photos.views[view].camera.unproject(place, depth)))
    }

    /// Returns the surface depth at a position in a view, if there is one.
    fn depth(&mut self, view: usize, place: DVec2) -> Result<Option<f64>> {
        let camera = &self.photos.views[view].camera;
        if self.known[view].shown.is_none() {
            let parts = Parts { depth: true, main: true, labels: false };
            let options = RenderOptions { sh_degree: Some(0), ..RenderOptions::new(self.near, parts) };
            self.known[view].shown = Some(render(&mut self.engine, camera, &options)?);
        }
        let inside =
            place.x >= 0.0 && place.y >= 0.0 && place.x < f64::from(camera.width) && place.y < f64::from(camera.height);
        let at = pixel_of([place.x as f32, place.y as f32], &self.photos.views[view]);
        let shown = self.known[view].shown.as_ref().filter(|_| inside);
        Ok(shown.and_then(|shown| shown.depth_at(at)).map(f64::from))
    }

    /// Returns the position at which a view sees a point, if nothing hides it.
    fn place_of(&mut self, view: usize, point: DVec3) -> Result<Option<PhotoPoint>> {
        let camera = &self.photos.views[view].camera;
        let z = camera.to_camera(point).z;
        let Some(place) = camera.sees(point) else { return Ok(None) };
        let depth = self.depth(view, place)?;
        let is_seen = depth.is_some_and(|depth| (depth - z).abs() <= DEPTH_SHARE_MAX * z);
        Ok(is_seen.then_some([place.x as f32, place.y as f32]))
    }

    /// Returns the views by the angle at the point between them and an eye.
    fn views_by_direction(&self, eye: DVec3, point: DVec3) -> Vec<usize> {
        let toward = |from: DVec3| (from - point).normalize_or_zero();
        let near = |view: usize| toward(self.photos.views[view].camera.centre()).dot(toward(eye));
        let mut order: Vec<usize> = (0..self.photos.views.len()).collect();
        order.sort_by(|&a, &b| near(b).total_cmp(&near(a)));
        order
    }

    /// Queries the network for views, several at a time.
    fn ask_all(&mut self, prompts: &[(usize, Prompt)], observe: ProgressObserver) -> Result<Vec<Masks>> {
        let mut answers = Vec::new();
        for some in prompts.chunks(rayon::current_num_threads()) {
            for &(view, _) in some {
                observe(Progress::Asked { done: answers.len(), all: prompts.len(), left: self.left() })?;
                // Encoding a photo uses all threads.
                if self.unseen.remove(&view) {
                    let (prepared, time) = self.photos.prepare(view)?;
                    self.known[view].prepared = Some(prepared);
                    self.looked = (self.looked.0 + time, self.looked.1 + 1);
                }
            }
            let ask = |(view, prompt): &(usize, Prompt), prepared: Option<PreparedPhoto>| {
                let prepared = prepared.map_or_else(|| Ok(self.photos.prepare(*view)?.0), Ok::<_, Error>)?;
                let masks = self.photos.ask(*view, &prepared, prompt)?;
                Ok((*view, prepared, masks))
            };
            let prepared: Vec<_> = some.iter().map(|(view, _)| self.known[*view].prepared.take()).collect();
            let found: Vec<_> =
                some.par_iter().zip(prepared).map(|(asked, prepared)| ask(asked, prepared)).collect::<Result<_>>()?;
            for (view, prepared, masks) in found {
                self.known[view].prepared = Some(prepared);
                answers.push(masks);
            }
        }
        observe(Progress::Asked { done: answers.len(), all: prompts.len(), left: self.left() })?;
        Ok(answers)
    }

    /// Returns the estimated time for photos that are not encoded yet; `None` before the first one.
    fn left(&self) -> Option<Duration> {
        let (time, count) = self.looked;
        (count > 0 && !self.unseen.is_empty()).then(|| time / count * self.unseen.len() as u32)
    }

    /// Labels the model in the engine by masks of views, and returns which Gaussians have the label.
    fn vote(&mut self, masks: &[(usize, LabelMap)]) -> Result<Vec<bool>> {
        let pixels: Vec<Pixels<LabelMap>> = masks.iter().map(|(_, mask)| mask.clone().into()).collect();
        let views: &'a [View] = &self.photos.views;
        let voters: Vec<Voter> =
            // Photos and masks differ in size.
            masks.iter().zip(&pixels).map(|((view, _), mask)| Voter { photo: None, ..Voter::for_view(&views[*view],
            mask) }).collect();
        let decision = decide(&sweep(&mut self.engine, &voters, Sweep::new(self.near, 0))?, &self.means)?;
        self.engine.set_labels(&decision.labels)?;
        Ok(decision.labels.iter().map(|&label| label == u32::from(OBJECT_ID)).collect())
    }
}
