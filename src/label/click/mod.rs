//! An object from places in photos: what a network sees there, found again in the other views through the model.

mod photos;
mod shapes;

pub use photos::Photos;

use crate::engine::Engine;
use crate::error::{Error, Result, Setting};
use crate::gpu::Gpu;
use crate::label::vote::ballot::{Sweep, Voter, sweep};
use crate::label::vote::decide::decide;
use crate::label::vote::model::vote_engine;
use crate::render::{Parts, RenderOptions, Rendered, label_map, render};
use crate::scene::{Gaussians, LabelMap, Pixels, View};
use crate::segment::{Place, Prepared, Prompt};
use glam::{DVec2, DVec3};
use photos::Masks;
use rayon::prelude::*;
use shapes::{Asked, agreeing, iou, places, prompt_of};
use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::Duration;

/// Views that are asked for a first answer, and at most.
const FIRST_VIEWS: usize = 12;
const ALL_VIEWS: usize = 24;
/// Difference of depths, as a share, up to which a view sees the point and not something in front of it.
const DEPTH_SHARE_MAX: f64 = 0.04;
/// IoU of a mask with what the model shows of the object above which it counts in the second round.
const CONFIRMING_IOU_MIN: f64 = 0.6;
/// Opacity below which a place shows no surface.
const OPAQUE_MIN: f32 = 0.5;
/// The object, in masks and labels of this work.
const OBJECT: u16 = 1;

/// A click in a photo.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Click {
    /// Index of the view.
    pub view: usize,
    /// Column and row, px of [`Photos::size`].
    pub pixel: [u32; 2],
    /// On the object, or on what does not belong to it.
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

/// What says which object is meant: a click on it at least, or a box.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Hints {
    /// Clicks.
    pub clicks: Vec<Click>,
    /// A box.
    pub area: Option<Area>,
}

impl Hints {
    /// Returns the flags of `labelgs label` that say the same, and what follows them.
    pub fn flags(&self, photos: &Photos) -> Vec<(&'static str, String)> {
        let click = |Click { view, pixel: [x, y], is_on }: &Click| {
            (if *is_on { "click" } else { "not" }, format!("{}:{x},{y}", photos.name(*view)))
        };
        let area = |Area { view, corners: [x0, y0, x1, y1] }: &Area| {
            ("box", format!("{}:{x0},{y0},{x1},{y1}", photos.name(*view)))
        };
        self.area.iter().map(area).chain(self.clicks.iter().map(click)).collect()
    }

    /// Returns the view of the box, else of the first click on the object.
    fn first(&self) -> Result<usize> {
        let click = self.clicks.iter().find(|click| click.is_on).map(|click| click.view);
        self.area.map(|area| area.view).or(click).ok_or_else(|| {
            Error::usage(Setting("click"), "no click is on the object; one at least must be, or a box around it")
        })
    }
}

/// How far the work is.
#[derive(Clone, Copy, Debug)]
pub enum Progress<'a> {
    /// The network was asked.
    Asked {
        /// Photos that have answered in this round.
        done: usize,
        /// Photos of the round.
        all: usize,
        /// Time that photos take that the network has not seen before, as far as it is known.
        left: Option<Duration>,
    },
    /// A first answer: which Gaussians belong to the object.
    First(&'a [bool]),
}

/// Who hears of the progress. An error ends the work.
pub type Observe<'a> = &'a mut dyn FnMut(Progress) -> Result<()>;

/// Finds objects in a model. What was worked out of a view is kept for the next question.
pub struct Clicking<'a> {
    engine: Engine,
    means: Vec<[f32; 3]>,
    photos: &'a Photos,
    near: f32,
    known: Vec<Known>,
    /// Views whose photos the network has to look at first, and the time and number of those that it has looked at.
    unseen: BTreeSet<usize>,
    looked: (Duration, u32),
}

/// What was worked out of a view.
#[derive(Default)]
struct Known {
    shown: Option<Rendered>,
    prepared: Option<Prepared>,
}

impl<'a> Clicking<'a> {
    /// Puts a model on the device.
    pub fn new(gpu: Arc<Gpu>, model: &Gaussians, photos: &'a Photos, near: f32) -> Result<Self> {
        let engine = vote_engine(gpu, model, &photos.views.iter().collect::<Vec<_>>(), 2)?;
        let known = photos.views.iter().map(|_| Known::default()).collect();
        let (unseen, looked) = (BTreeSet::new(), (Duration::ZERO, 0));
        Ok(Self { engine, means: model.means.clone(), photos, near, known, unseen, looked })
    }

    /// Forgets what takes most memory, before another object.
    pub fn forget(&mut self) {
        self.known.iter_mut().for_each(|known| known.prepared = None);
    }

    /// Returns the view that looks at points most as from `eye` and sees most of them, and where it sees them.
    pub fn nearest(&mut self, points: &[DVec3], eye: DVec3) -> Result<Option<(usize, Vec<[u32; 2]>)>> {
        let middle = points.iter().sum::<DVec3>() / points.len().max(1) as f64;
        for view in self.by_direction(eye, middle) {
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

    /// Returns which Gaussians belong to the object.
    pub fn object(&mut self, hints: &Hints, observe: Observe) -> Result<Vec<bool>> {
        let first = hints.first()?;
        let mut points = Vec::new();
        for click in &hints.clicks {
            points.push((self.point(*click)?, click.is_on));
        }
        let anchors = self.anchors(hints, &points)?;
        let target = points.iter().find(|(_, is_on)| *is_on).map(|(point, _)| *point).or(anchors.first().copied());
        let nothing = || {
            let problem = "the network found nothing there that the model shows; try another view";
            Error::usage(Setting(if hints.area.is_some() { "box" } else { "click" }), problem)
        };
        let mut order = self.by_direction(self.photos.views[first].camera.centre(), target.ok_or_else(nothing)?);
        order.sort_by_key(|&view| view != first);
        let mut prompts = Vec::new();
        for &view in &order {
            if prompts.len() == FIRST_VIEWS {
                break;
            }
            prompts.extend(self.prompt(view, hints, (&points, &anchors))?.map(|prompt| (view, prompt)));
            observe(Progress::Asked { done: 0, all: prompts.len(), left: None })?;
        }
        for view in prompts.iter().map(|(view, _)| *view).chain(order.iter().copied().take(ALL_VIEWS)) {
            if self.known[view].prepared.is_none() && self.photos.is_new(view)? {
                self.unseen.insert(view);
            }
        }
        let answers = self.ask_all(&prompts, observe)?;
        let asked =
            |((view, _), masks): (&(usize, Prompt), Masks)| Asked::new(*view, masks, self.known[*view].shown.as_ref());
        let asked: Vec<Asked> = prompts.iter().zip(answers).map(asked).collect();
        let rows = self.vote(&agreeing(&asked))?;
        if !rows.contains(&true) {
            return Err(nothing());
        }
        observe(Progress::First(&rows))?;
        let confirmed = self.confirmed(&order[..order.len().min(ALL_VIEWS)], hints, &points, observe)?;
        // Where no view confirms, the first answer stands.
        let found = if confirmed.is_empty() { rows } else { self.vote(&confirmed)? };
        found.contains(&true).then_some(found).ok_or_else(nothing)
    }

    /// Asks views for what the model shows now, and returns their masks where they confirm it.
    fn confirmed(
        &mut self,
        views: &[usize],
        hints: &Hints,
        points: &[(DVec3, bool)],
        observe: Observe,
    ) -> Result<Vec<(usize, LabelMap)>> {
        let (mut maps, mut prompts) = (Vec::new(), Vec::new());
        for &view in views {
            observe(Progress::Asked { done: 0, all: prompts.len(), left: None })?;
            let map = label_map(&mut self.engine, &self.photos.views[view].camera, self.near)?;
            let Some(mut prompt) = prompt_of(&map) else { continue };
            for (point, _) in points.iter().filter(|(_, is_on)| !is_on) {
                prompt.off.extend(self.place_of(view, *point)?);
            }
            prompt.area = self.area(view, hints).or(prompt.area);
            maps.push(map);
            prompts.push((view, prompt));
        }
        let answers = self.ask_all(&prompts, observe)?;
        let best = |((masks, _), map): (Masks, &LabelMap)| {
            let found = masks.into_iter().map(|mask| (iou(&mask, map), mask));
            found.max_by(|a, b| a.0.total_cmp(&b.0)).filter(|(iou, _)| *iou >= CONFIRMING_IOU_MIN)
        };
        let found = answers.into_iter().zip(&maps).map(best).zip(prompts);
        Ok(found.filter_map(|(best, (view, _))| Some((view, best?.1))).collect())
    }

    /// Returns the point of the surface at a click, in the world.
    fn point(&mut self, click: Click) -> Result<DVec3> {
        let place = self.photos.drawn(click.view, click.pixel.map(|at| at as f32 + 0.5));
        self.surface(click.view, place)?.ok_or_else(|| {
            let [x, y] = click.pixel;
            let problem = format!("{}:{x},{y} shows nothing of the model", self.photos.name(click.view));
            Error::usage(Setting("click"), problem)
        })
    }

    /// Returns the point of the surface at a place of a view, if there is one.
    fn surface(&mut self, view: usize, [x, y]: Place) -> Result<Option<DVec3>> {
        let place = DVec2::new(f64::from(x), f64::from(y));
        let depth = self.depth(view, place)?;
        Ok(depth.map(|depth| self.photos.views[view].camera.unproject(place, depth)))
    }

    /// Returns the depth of the surface at a place of a view, if there is one.
    fn depth(&mut self, view: usize, place: DVec2) -> Result<Option<f64>> {
        let camera = &self.photos.views[view].camera;
        if self.known[view].shown.is_none() {
            let parts = Parts { depth: true, main: true, labels: false };
            let options = RenderOptions { sh_degree: Some(0), ..RenderOptions::new(self.near, parts) };
            self.known[view].shown = Some(render(&mut self.engine, camera, &options)?);
        }
        let inside =
            place.x >= 0.0 && place.y >= 0.0 && place.x < f64::from(camera.width) && place.y < f64::from(camera.height);
        let at = (place.y.max(0.0) as u32 * camera.width + place.x.max(0.0) as u32) as usize;
        let found = self.known[view].shown.as_ref().filter(|_| inside).map(|found| (found.depth[at], found.alpha[at]));
        Ok(found.filter(|(_, alpha)| *alpha >= OPAQUE_MIN).map(|(depth, alpha)| f64::from(depth / alpha)))
    }

    /// Returns where a view sees a point, if nothing hides it.
    fn place_of(&mut self, view: usize, point: DVec3) -> Result<Option<Place>> {
        let camera = &self.photos.views[view].camera;
        let z = camera.to_camera(point).z;
        let Some(place) = camera.sees(point) else { return Ok(None) };
        let depth = self.depth(view, place)?;
        let is_seen = depth.is_some_and(|depth| (depth - z).abs() <= DEPTH_SHARE_MAX * z);
        Ok(is_seen.then_some([place.x as f32, place.y as f32]))
    }

    /// Returns the box in the drawn view, if it is there.
    fn area(&self, view: usize, hints: &Hints) -> Option<[Place; 2]> {
        let [x0, y0, x1, y1] = hints.area.filter(|area| area.view == view)?.corners.map(|at| at as f32);
        Some([self.photos.drawn(view, [x0, y0]), self.photos.drawn(view, [x1, y1])])
    }

    /// Returns points of the surface that the network takes of a box, from its middle outwards; none without a box.
    fn anchors(&mut self, hints: &Hints, points: &[(DVec3, bool)]) -> Result<Vec<DVec3>> {
        let Some(Area { view, .. }) = hints.area else { return Ok(Vec::new()) };
        let Some(prompt) = self.prompt(view, hints, (points, &[]))? else { return Ok(Vec::new()) };
        let answers = self.ask_all(&[(view, prompt)], &mut |_| Ok(()))?;
        let best = answers.iter().flat_map(|(masks, qualities)| masks.iter().zip(qualities));
        let Some((mask, _)) = best.max_by(|a, b| a.1.total_cmp(b.1)) else { return Ok(Vec::new()) };
        let mut anchors = Vec::new();
        for place in places(mask) {
            anchors.extend(self.surface(view, place)?);
        }
        Ok(anchors)
    }

    /// Returns the prompt of a view that has the box or sees a point of the object.
    fn prompt(
        &mut self,
        view: usize,
        hints: &Hints,
        (points, anchors): (&[(DVec3, bool)], &[DVec3]),
    ) -> Result<Option<Prompt>> {
        let mut prompt = Prompt { area: self.area(view, hints), ..Prompt::default() };
        for &(point, is_on) in points {
            let place = self.place_of(view, point)?;
            if is_on { prompt.on.extend(place) } else { prompt.off.extend(place) }
        }
        if prompt.area.is_some() {
            return Ok(Some(prompt));
        }
        for &anchor in anchors {
            if !prompt.on.is_empty() {
                break;
            }
            prompt.on.extend(self.place_of(view, anchor)?);
        }
        Ok((!prompt.on.is_empty()).then_some(prompt))
    }

    /// Returns the views by the angle at the point between them and an eye.
    fn by_direction(&self, eye: DVec3, point: DVec3) -> Vec<usize> {
        let toward = |from: DVec3| (from - point).normalize_or_zero();
        let near = |view: usize| toward(self.photos.views[view].camera.centre()).dot(toward(eye));
        let mut order: Vec<usize> = (0..self.photos.views.len()).collect();
        order.sort_by(|&a, &b| near(b).total_cmp(&near(a)));
        order
    }

    /// Asks views, several at a time.
    fn ask_all(&mut self, prompts: &[(usize, Prompt)], observe: Observe) -> Result<Vec<Masks>> {
        let mut answers = Vec::new();
        for some in prompts.chunks(rayon::current_num_threads()) {
            for &(view, _) in some {
                observe(Progress::Asked { done: answers.len(), all: prompts.len(), left: self.left() })?;
                // To look at a photo takes all threads.
                if self.unseen.remove(&view) {
                    let (prepared, time) = self.photos.prepare(view)?;
                    self.known[view].prepared = Some(prepared);
                    self.looked = (self.looked.0 + time, self.looked.1 + 1);
                }
            }
            let ask = |(view, prompt): &(usize, Prompt), prepared: Option<Prepared>| {
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

    /// Returns the time that photos take which the network has not seen, once it has seen one.
    fn left(&self) -> Option<Duration> {
        let (time, count) = self.looked;
        (count > 0 && !self.unseen.is_empty()).then(|| time / count * self.unseen.len() as u32)
    }

    /// Labels the model in the engine by masks of views, and returns which Gaussians have the label.
    fn vote(&mut self, masks: &[(usize, LabelMap)]) -> Result<Vec<bool>> {
        let pixels: Vec<Pixels<LabelMap>> = masks.iter().map(|(_, mask)| mask.clone().into()).collect();
        let views: &'a [View] = &self.photos.views;
        let voters: Vec<Voter> =
            // Photos have another size than the masks.
            masks.iter().zip(&pixels).map(|((view, _), mask)| Voter { photo: None, ..Voter::of(&views[*view], mask) }).collect();
        let decision = decide(&sweep(&mut self.engine, &voters, Sweep::new(self.near, 0))?, &self.means)?;
        self.engine.set_labels(&decision.labels)?;
        Ok(decision.labels.iter().map(|&label| label == u32::from(OBJECT)).collect())
    }
}
