//! An object from a click: what a network sees at a place of one photo, found again in the other views through the model.

use crate::engine::Engine;
use crate::error::{Error, Result, Setting};
use crate::label::masks::nested::{NestedMasks, sight::Sight};
use crate::label::vote::ballot::{Sweep, Voter, sweep};
use crate::label::vote::decide::decide;
use crate::render::{Parts, RenderOptions, Rendered, label_map, render};
use crate::scene::{Gaussians, LabelMap, Pixels, View};
use crate::segment::{Answer, Features, Network, Place, Prepared, Prompt};
use glam::{DVec2, DVec3};

/// Views that are asked for a first answer, and at most.
const FIRST_VIEWS: usize = 12;
const ALL_VIEWS: usize = 24;
/// Difference of depths, as a share, up to which a view sees the point and not something in front of it.
const DEPTH_SHARE_MAX: f64 = 0.04;
/// Overlap of the masks of two views above which both show the object.
const AGREEING_MIN: f64 = 0.5;
/// IoU of a mask with what the model shows of the object above which it counts in the second round.
const CONFIRMING_IOU_MIN: f64 = 0.6;
/// Opacity below which a place shows no surface.
const OPAQUE_MIN: f32 = 0.5;
/// The object, in masks and labels of this work.
const OBJECT: u16 = 1;

/// A click in a photo.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Click {
    /// Index of the view.
    pub view: usize,
    /// Place, px of the view.
    pub place: Place,
    /// On the object, or on what does not belong to it.
    pub is_on: bool,
}

/// What is asked, and of whom.
pub struct Clicking<'a> {
    /// The engine, with the model and memory for two columns of votes.
    pub engine: &'a mut Engine,
    /// The model.
    pub model: &'a Gaussians,
    /// The views with their photos.
    pub views: &'a [&'a View],
    /// Near plane, world units.
    pub near: f32,
    /// The network.
    pub network: &'a Network,
    /// Returns the features of a view's photo.
    pub features: &'a dyn Fn(&View) -> Result<Features>,
}

/// What was worked out of a view.
#[derive(Default)]
struct Known {
    shown: Option<Rendered>,
    prepared: Option<Prepared>,
}

/// A view that is asked.
struct Asked {
    view: usize,
    /// Masks at the size of the view.
    masks: Vec<LabelMap>,
    qualities: Vec<f64>,
    sight: Sight,
}

impl Asked {
    fn new(view: usize, (masks, qualities): (Vec<LabelMap>, Vec<f64>), shown: Option<&Rendered>) -> Self {
        let layer = |(mask, number): (&LabelMap, u16)| LabelMap {
            ids: mask.ids.iter().map(|id| id * number).collect(),
            ..mask.clone()
        };
        let nested = NestedMasks { layers: masks.iter().zip(1..).map(layer).collect(), qualities };
        let sight = shown.map_or_else(Sight::default, |shown| Sight::new(&shown.top_id, &nested));
        Self { view, masks, qualities: nested.qualities, sight }
    }
}

impl Clicking<'_> {
    /// Returns which Gaussians belong to the object. One click at least must be on it. `tick` is called for each photo that is
    /// asked.
    pub fn object(&mut self, clicks: &[Click], tick: &mut dyn FnMut()) -> Result<Vec<bool>> {
        let first = clicks.iter().find(|click| click.is_on);
        let first =
            *first.ok_or_else(|| Error::usage(Setting("click"), "no click is on the object; at least one must be"))?;
        let mut known: Vec<Known> = self.views.iter().map(|_| Known::default()).collect();
        let mut points = Vec::new();
        for click in clicks {
            points.push((self.point(*click, &mut known)?, click.is_on));
        }
        let target = self.point(first, &mut known)?;
        let order = self.by_direction(first.view, target);
        let mut asked = Vec::new();
        for &view in &order {
            if asked.len() == FIRST_VIEWS {
                break;
            }
            if let Some(prompt) = self.prompt(view, &points, &mut known)? {
                let (masks, qualities) = self.ask(view, &prompt, &mut known[view])?;
                asked.push(Asked::new(view, (masks, qualities), known[view].shown.as_ref()));
                tick();
            }
        }
        let chosen = agreeing(&asked);
        let rows = self.vote(&chosen)?;
        // What the model shows now is asked again, in more views.
        let mut confirmed = Vec::new();
        for &view in order.iter().take(ALL_VIEWS) {
            let map = label_map(self.engine, &self.views[view].camera, self.near)?;
            let Some(mut prompt) = prompt_of(&map) else { continue };
            let off = points.iter().filter(|(_, is_on)| !is_on);
            for (point, _) in off {
                prompt.off.extend(self.place_of(view, *point, &mut known)?);
            }
            let (masks, _) = self.ask(view, &prompt, &mut known[view])?;
            tick();
            let best = masks.into_iter().map(|mask| (iou(&mask, &map), mask));
            if let Some((found, mask)) = best.max_by(|a, b| a.0.total_cmp(&b.0))
                && found >= CONFIRMING_IOU_MIN
            {
                confirmed.push((view, mask));
            }
        }
        // Where no view confirms, the first answer stands.
        if confirmed.is_empty() { Ok(rows) } else { self.vote(&confirmed) }
    }

    /// Returns the point of the surface at a click, in the world.
    fn point(&mut self, click: Click, known: &mut [Known]) -> Result<DVec3> {
        let view = self.views[click.view];
        let place = DVec2::new(f64::from(click.place[0]), f64::from(click.place[1]));
        let depth = self.depth(click.view, place, known)?.ok_or_else(|| {
            let problem = format!("{}:{},{} shows nothing of the model", view.name, click.place[0], click.place[1]);
            Error::usage(Setting("click"), problem)
        })?;
        Ok(view.camera.unproject(place, depth))
    }

    /// Returns the depth of the surface at a place of a view, if there is one.
    fn depth(&mut self, view: usize, place: DVec2, known: &mut [Known]) -> Result<Option<f64>> {
        let camera = &self.views[view].camera;
        if known[view].shown.is_none() {
            let parts = Parts { depth: true, main: true, labels: false };
            let options = RenderOptions { sh_degree: Some(0), ..RenderOptions::new(self.near, parts) };
            known[view].shown = Some(render(self.engine, camera, &options)?);
        }
        let inside =
            place.x >= 0.0 && place.y >= 0.0 && place.x < f64::from(camera.width) && place.y < f64::from(camera.height);
        let at = (place.y.max(0.0) as u32 * camera.width + place.x.max(0.0) as u32) as usize;
        let found = known[view].shown.as_ref().filter(|_| inside).map(|found| (found.depth[at], found.alpha[at]));
        Ok(found.filter(|(_, alpha)| *alpha >= OPAQUE_MIN).map(|(depth, alpha)| f64::from(depth / alpha)))
    }

    /// Returns where a view sees a point, if nothing hides it.
    fn place_of(&mut self, view: usize, point: DVec3, known: &mut [Known]) -> Result<Option<Place>> {
        let camera = &self.views[view].camera;
        let z = camera.to_camera(point).z;
        let Some(place) = camera.sees(point) else { return Ok(None) };
        let depth = self.depth(view, place, known)?;
        let is_seen = depth.is_some_and(|depth| (depth - z).abs() <= DEPTH_SHARE_MAX * z);
        Ok(is_seen.then_some([place.x as f32, place.y as f32]))
    }

    /// Returns the prompt of a view that sees a point of the object.
    fn prompt(&mut self, view: usize, points: &[(DVec3, bool)], known: &mut [Known]) -> Result<Option<Prompt>> {
        let mut prompt = Prompt::default();
        for &(point, is_on) in points {
            let place = self.place_of(view, point, known)?;
            if is_on { prompt.on.extend(place) } else { prompt.off.extend(place) }
        }
        Ok((!prompt.on.is_empty()).then_some(prompt))
    }

    /// Returns the views by the angle at the point between them and one of them.
    fn by_direction(&self, first: usize, point: DVec3) -> Vec<usize> {
        let toward = |view: usize| (self.views[view].camera.centre() - point).normalize_or_zero();
        let mut order: Vec<usize> = (0..self.views.len()).collect();
        order.sort_by(|&a, &b| {
            let near = |view: usize| toward(view).dot(toward(first));
            (b == first).cmp(&(a == first)).then(near(b).total_cmp(&near(a)))
        });
        order
    }

    /// Returns the masks of a view, at its size, and how sure the network is of each.
    fn ask(&mut self, view: usize, prompt: &Prompt, known: &mut Known) -> Result<(Vec<LabelMap>, Vec<f64>)> {
        let camera = &self.views[view].camera;
        let prepared = match known.prepared.take() {
            Some(prepared) => prepared,
            None => self.network.prepare(&(self.features)(self.views[view])?)?,
        };
        let photo = prepared.frame.size;
        let scale = [photo.0 as f32 / camera.width as f32, photo.1 as f32 / camera.height as f32];
        let Answer { masks, scores } = self.network.ask(&prepared, &prompt.scaled(scale))?;
        let size = (camera.width, camera.height);
        let draw = |logits: &Vec<f32>| {
            let inside = prepared.frame.drawn(&|cell| logits[cell], size);
            LabelMap { width: size.0, height: size.1, ids: inside.into_iter().map(u16::from).collect() }
        };
        let masks = masks.iter().map(draw).collect();
        known.prepared = Some(prepared);
        Ok((masks, scores.iter().map(|score| f64::from(*score).clamp(0.0, 1.0)).collect()))
    }

    /// Labels the model in the engine by masks of views, and returns which Gaussians have the label.
    fn vote(&mut self, masks: &[(usize, LabelMap)]) -> Result<Vec<bool>> {
        let pixels: Vec<Pixels<LabelMap>> = masks.iter().map(|(_, mask)| mask.clone().into()).collect();
        let voters: Vec<Voter> =
            masks.iter().zip(&pixels).map(|((view, _), mask)| Voter::of(self.views[*view], mask)).collect();
        let decision = decide(&sweep(self.engine, &voters, Sweep::new(self.near, 0))?, &self.model.means)?;
        self.engine.set_labels(&decision.labels)?;
        Ok(decision.labels.iter().map(|&label| label == u32::from(OBJECT)).collect())
    }
}

/// Chooses among the masks of the first view, which show a part, the object or more, the one on which the other views agree
/// most, and returns it with theirs.
fn agreeing(asked: &[Asked]) -> Vec<(usize, LabelMap)> {
    let Some((first, others)) = asked.split_first() else { return Vec::new() };
    let overlaps: Vec<_> = others.iter().map(|other| first.sight.overlaps(&other.sight)).collect();
    let mut best: (f64, Vec<(usize, LabelMap)>) = (-1.0, Vec::new());
    for (level, mask) in first.masks.iter().enumerate() {
        let (mut found, mut sum) = (vec![(first.view, mask.clone())], 0.0);
        for (other, overlaps) in others.iter().zip(&overlaps) {
            let own = overlaps.iter().filter(|(ours, ..)| usize::from(*ours) == level);
            let Some((_, theirs, overlap)) = own.max_by(|a, b| a.2.ratio().total_cmp(&b.2.ratio())) else { continue };
            if overlap.ratio() >= AGREEING_MIN {
                sum += overlap.ratio();
                found.push((other.view, other.masks[usize::from(*theirs)].clone()));
            }
        }
        let agreement = first.qualities[level] * (1.0 + sum) / (1 + others.len()) as f64;
        if agreement > best.0 {
            best = (agreement, found);
        }
    }
    best.1
}

fn iou(a: &LabelMap, b: &LabelMap) -> f64 {
    let count =
        |of: &dyn Fn(bool, bool) -> bool| a.ids.iter().zip(&b.ids).filter(|(a, b)| of(**a != 0, **b != 0)).count();
    count(&|a, b| a && b) as f64 / count(&|a, b| a || b).max(1) as f64
}

/// Returns the box around the pixels of the object and the one of them that is farthest from their border.
fn prompt_of(map: &LabelMap) -> Option<Prompt> {
    let (width, height) = (map.width as usize, map.height as usize);
    let mut distance: Vec<u32> = map.ids.iter().map(|&id| if id == OBJECT { u32::MAX / 2 } else { 0 }).collect();
    // City-block distance in two passes; the border of the picture counts as outside.
    for y in 0..height {
        for x in 0..width {
            let up = if y > 0 { distance[(y - 1) * width + x] } else { 0 };
            let left = if x > 0 { distance[y * width + x - 1] } else { 0 };
            let at = y * width + x;
            distance[at] = distance[at].min(up + 1).min(left + 1);
        }
    }
    let mut best = (0, 0);
    for y in (0..height).rev() {
        for x in (0..width).rev() {
            let down = if y + 1 < height { distance[(y + 1) * width + x] } else { 0 };
            let right = if x + 1 < width { distance[y * width + x + 1] } else { 0 };
            let at = y * width + x;
            distance[at] = distance[at].min(down + 1).min(right + 1);
            best = best.max((distance[at], at));
        }
    }
    let [left, top, right, bottom] = map.bounds()?.map(|side| side as f32);
    let area = Some([[left, top], [right, bottom]]);
    let place = [(best.1 % width) as f32 + 0.5, (best.1 / width) as f32 + 0.5];
    (best.0 > 1).then(|| Prompt { on: vec![place], off: Vec::new(), area })
}
