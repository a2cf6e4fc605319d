//! Answers one question: which object is at a click or in a box. Queries the photos of several views, merges their
//! masks through the Gaussians, and queries again with the merged result.

use super::photos::Masks;
use super::shapes::{ViewMasks, agreeing, iou, places, prompt_of, without};
use super::{Area, ObjectFinder, Progress, ProgressObserver, nothing};
use crate::error::Result;
use crate::render::label_map;
use crate::scene::LabelMap;
use crate::segment::{PhotoPoint, Prompt};
use glam::DVec3;

/// Most views queried for a first answer.
const FIRST_VIEWS_MAX: usize = 12;
/// Most views queried in all.
const VIEWS_MAX: usize = 24;
/// Smallest IoU of a mask with the rendered object for the mask to count in the second round.
const CONFIRMING_IOU_MIN: f64 = 0.6;

/// The model surface at a click.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Spot {
    pub(super) view: usize,
    /// Point on the surface, world units.
    pub(super) point: DVec3,
    /// Gaussian with the largest weight there.
    pub(super) gaussian: usize,
    pub(super) is_on: bool,
}

/// What points at an object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Target {
    Click(Spot),
    Box(Area),
}

/// One click or box, and spots that are not on the object.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Question {
    pub(super) target: Target,
    pub(super) others: Vec<Spot>,
}

impl Question {
    /// Returns the view that is queried first.
    fn first(&self) -> usize {
        match self.target {
            Target::Click(spot) => spot.view,
            Target::Box(area) => area.view,
        }
    }

    /// Returns the point of a click.
    fn point(&self) -> Option<DVec3> {
        match self.target {
            Target::Click(spot) => Some(spot.point),
            Target::Box(_) => None,
        }
    }

    fn area(&self) -> Option<Area> {
        match self.target {
            Target::Click(_) => None,
            Target::Box(area) => Some(area),
        }
    }
}

impl ObjectFinder<'_> {
    /// Returns the Gaussians that a click selects. If they include some at `others`, queries again with these excluded.
    pub(super) fn meant(&mut self, spot: Spot, others: &[Spot], observe: ProgressObserver) -> Result<Vec<bool>> {
        let question = Question { target: Target::Click(spot), others: Vec::new() };
        let found = self.remembered(question.clone(), observe)?;
        let wrong: Vec<Spot> = others.iter().filter(|other| found[other.gaussian]).copied().collect();
        if wrong.is_empty() { Ok(found) } else { self.remembered(Question { others: wrong, ..question }, observe) }
    }

    /// Returns the answer to a question, from the cache if possible.
    pub(super) fn remembered(&mut self, question: Question, observe: ProgressObserver) -> Result<Vec<bool>> {
        if let Some((_, rows)) = self.answers.iter().find(|(other, _)| *other == question) {
            return Ok(rows.clone());
        }
        let rows = self.answer(&question, observe)?;
        self.answers.push((question, rows.clone()));
        Ok(rows)
    }

    /// Queries the object at a click or in a box.
    fn answer(&mut self, question: &Question, observe: ProgressObserver) -> Result<Vec<bool>> {
        let anchors = self.anchors(question)?;
        let Some(target) = question.point().or(anchors.first().copied()) else {
            return Err(nothing(question.area().is_some()));
        };
        let first = question.first();
        let mut order = self.views_by_direction(self.photos.views[first].camera.centre(), target);
        order.sort_by_key(|&view| view != first);
        let mut prompts = Vec::new();
        for &view in &order {
            if prompts.len() == FIRST_VIEWS_MAX {
                break;
            }
            prompts.extend(self.prompt(view, question, &anchors)?.map(|prompt| (view, prompt)));
            observe(Progress::Asked { done: 0, all: prompts.len(), left: None })?;
        }
        for view in prompts.iter().map(|(view, _)| *view).chain(order.iter().copied().take(VIEWS_MAX)) {
            if self.known[view].prepared.is_none() && self.photos.is_new(view)? {
                self.unseen.insert(view);
            }
        }
        let answers = self.ask_without(prompts, &question.others, observe)?;
        let asked = |(view, masks): (usize, Masks)| ViewMasks::new(view, masks, self.known[view].shown.as_ref());
        let asked: Vec<ViewMasks> = answers.into_iter().map(asked).collect();
        let rows = self.vote(&agreeing(&asked))?;
        if !rows.contains(&true) {
            return Err(nothing(question.area().is_some()));
        }
        observe(Progress::First(&rows))?;
        let confirmed = self.confirmed(&order[..order.len().min(VIEWS_MAX)], question, observe)?;
        // If no view confirms it, keep the first answer.
        if confirmed.is_empty() { Ok(rows) } else { self.vote(&confirmed) }
    }

    /// Queries views, and drops masks that include excluded positions. If none remain, queries the view again with
    /// these positions as negative prompts.
    fn ask_without(
        &mut self,
        prompts: Vec<(usize, Prompt)>,
        others: &[Spot],
        observe: ProgressObserver,
    ) -> Result<Vec<(usize, Masks)>> {
        let answers = self.ask_all(&prompts, observe)?;
        let mut found = Vec::new();
        for ((view, mut prompt), masks) in prompts.into_iter().zip(answers) {
            let off = self.places_of(view, others)?;
            let mut masks = without(masks, &off);
            if masks.0.is_empty() {
                prompt.off.extend(&off);
                masks = without(self.ask_all(&[(view, prompt)], &mut |_| Ok(()))?.remove(0), &off);
            }
            if !masks.0.is_empty() {
                found.push((view, masks));
            }
        }
        Ok(found)
    }

    /// Returns the positions at which a view sees spots that nothing hides.
    fn places_of(&mut self, view: usize, spots: &[Spot]) -> Result<Vec<PhotoPoint>> {
        let mut places = Vec::new();
        for spot in spots {
            places.extend(self.place_of(view, spot.point)?);
        }
        Ok(places)
    }

    /// Queries views for the object as currently rendered, and returns the masks that confirm it.
    fn confirmed(
        &mut self,
        views: &[usize],
        question: &Question,
        observe: ProgressObserver,
    ) -> Result<Vec<(usize, LabelMap)>> {
        let (mut maps, mut prompts) = (Vec::new(), Vec::new());
        for &view in views {
            observe(Progress::Asked { done: 0, all: prompts.len(), left: None })?;
            let map = label_map(&mut self.engine, &self.photos.views[view].camera, self.near)?;
            let Some(mut prompt) = prompt_of(&map) else { continue };
            prompt.off = self.places_of(view, &question.others)?;
            prompt.area = self.area(view, question).or(prompt.area);
            maps.push(map);
            prompts.push((view, prompt));
        }
        let answers = self.ask_all(&prompts, observe)?;
        let best = |((masks, map), (_, prompt)): ((Masks, &LabelMap), &(usize, Prompt))| {
            let found = without(masks, &prompt.off).0.into_iter().map(|mask| (iou(&mask, map), mask));
            found.max_by(|a, b| a.0.total_cmp(&b.0)).filter(|(iou, _)| *iou >= CONFIRMING_IOU_MIN)
        };
        let found = answers.into_iter().zip(&maps).zip(&prompts).map(best).zip(prompts.iter());
        Ok(found.filter_map(|(best, (view, _))| Some((*view, best?.1))).collect())
    }

    /// Returns the box in the drawn view, if it belongs to this view.
    fn area(&self, view: usize, question: &Question) -> Option<[PhotoPoint; 2]> {
        let [x0, y0, x1, y1] = question.area().filter(|area| area.view == view)?.corners.map(|at| at as f32);
        Some([self.photos.drawn(view, [x0, y0]), self.photos.drawn(view, [x1, y1])])
    }

    /// Returns surface points of the object in the box, from its centre outwards; empty without a box.
    fn anchors(&mut self, question: &Question) -> Result<Vec<DVec3>> {
        let Some(Area { view, .. }) = question.area() else { return Ok(Vec::new()) };
        let Some(prompt) = self.prompt(view, question, &[])? else { return Ok(Vec::new()) };
        let answers = self.ask_without(vec![(view, prompt)], &question.others, &mut |_| Ok(()))?;
        let best = answers.iter().flat_map(|(_, (masks, qualities))| masks.iter().zip(qualities));
        let Some((mask, _)) = best.max_by(|a, b| a.1.total_cmp(b.1)) else { return Ok(Vec::new()) };
        let mut anchors = Vec::new();
        for place in places(mask) {
            anchors.extend(self.surface(view, place)?);
        }
        Ok(anchors)
    }

    /// Returns the prompt for a view that has the box or sees a point of the object.
    fn prompt(&mut self, view: usize, question: &Question, anchors: &[DVec3]) -> Result<Option<Prompt>> {
        let mut prompt = Prompt { area: self.area(view, question), ..Prompt::default() };
        if prompt.area.is_some() {
            return Ok(Some(prompt));
        }
        for point in question.point().iter().chain(anchors) {
            if !prompt.on.is_empty() {
                break;
            }
            prompt.on.extend(self.place_of(view, *point)?);
        }
        Ok((!prompt.on.is_empty()).then_some(prompt))
    }
}
