//! Scores removals: what a model shows in place of a removed object, compared with photos without that object.

mod score;

pub use score::{HoleScores, ObjectRemoval, RemovalScores, RuleScores};

use super::compared::{PictureObserver, ScoredPicture};
use crate::edit::fill::{Filled, Light, SIGHT_SIDE, Sight, fill};
use crate::engine::Engine;
use crate::error::Result;
use crate::label::vote::ballot::{Ballot, Sweep, Voter, sweep};
use crate::label::vote::model::{label_by_lift, objects_of};
use crate::render::{Parts, Render, RenderOptions, render};
use crate::scene::{Gaussians, Photo, View};
use score::{HoleSums, RemovalSite, RemovalSums};
use std::collections::BTreeMap;

/// Photos of the scene without an object.
pub trait RemovalTruth {
    /// Returns the photo of a view without object `id`, at the view's size; `None` if there is none.
    fn without(&self, id: u32, view: &View) -> Result<Option<Photo>>;

    /// Returns the same photo with the object's shadow.
    fn shadowed(&self, id: u32, view: &View) -> Result<Option<Photo>>;
}

/// Renders the engine's model in the training views, for [`fill`].
pub fn sights(engine: &mut Engine, views: &[&View], near: f32) -> Result<Vec<Sight>> {
    let sight = |view: &&View| {
        let (width, height) = (view.camera.width, view.camera.height);
        let shrink = f64::from(SIGHT_SIDE) / f64::from(width.max(height));
        let size = |side: u32| if shrink < 1.0 { (f64::from(side) * shrink).round().max(1.0) as u32 } else { side };
        let camera = view.camera.resized(size(width), size(height));
        let rendered = render(engine, &camera, &RenderOptions::new(near, Parts { depth: true, ..Parts::LABELS }))?;
        let (depth, labels) = (rendered.mean_depth()?, rendered.label_map()?);
        Ok(Sight { camera, rgb: rendered.rgb, depth, labels })
    };
    views.iter().map(sight).collect()
}

/// Returns the number of pictures that [`removals`] shows.
#[cfg(feature = "cli")]
pub(crate) fn picture_count(views: &[&View]) -> u64 {
    2 * views.iter().filter_map(|view| view.mask.as_ref()).map(|mask| mask.objects().len() as u64).sum::<u64>()
}

/// Removes each object of the masks from `model` and scores the result in `views`: by the model's labels, by the same
/// with filling, and by labels of the paper's rule. `train` are the training views with masks, for the last two.
/// `engine` has memory for votes ([`vote_engine`](crate::label::vote::model::vote_engine)); its model is replaced.
pub fn removals(
    engine: &mut Engine,
    model: &Gaussians,
    views: &[&View],
    train: &[&View],
    options: RenderOptions,
    truth: &dyn RemovalTruth,
    watch: &mut dyn PictureObserver,
) -> Result<RemovalScores> {
    engine.upload_model(model)?;
    let own = model.labels.clone().unwrap_or_else(|| vec![0; model.len()]);
    let sights = sights(engine, train, options.near)?;
    let light = Light::of(model, &sights)?;
    let mut paper = model.clone();
    label_by_lift(engine, &mut paper, train, options.near)?;
    let ballot = sweep(engine, &Voter::for_views(views), Sweep::new(options.near, 0))?;
    let mut objects = BTreeMap::new();
    for id in objects_of(views) {
        let places = views.iter().map(|view| RemovalSite::new(id, view, truth).transpose());
        let places: Vec<RemovalSite> = places.flatten().collect::<Result<_>>()?;
        let id = u32::from(id);
        let votes_left = |labels: &[u32]| weight_left(&ballot, id, labels);
        let rest = |labels: &[u32]| model.filtered(|row| labels[row] != id);
        let (mut plain, mut filled, mut main) =
            (RemovalSums::default(), RemovalSums::default(), RemovalSums::default());
        let mut draw = |part: &Gaussians,
                        tally: &mut RemovalSums,
                        what: &'static str,
                        watch: &mut dyn PictureObserver| {
            for place in &places {
                let rendered = drawn(engine, part, place.view, options)?;
                tally.add(place, &rendered);
                let Some(without) = place.truths[0].as_ref().filter(|_| what != MAIN_RULE_PICTURE) else { continue };
                watch.observe(&ScoredPicture {
                    object: Some(format!("{id} {what}")),
                    numbers: vec![("PSNR", place.psnr(&rendered))],
                    ..ScoredPicture::new(&place.view.name, without, &rendered.rgb)
                })?;
            }
            Ok::<(), crate::Error>(())
        };
        let without = rest(&own);
        draw(&without, &mut plain, "removed", watch)?;
        let closed = if own.contains(&id) && !without.is_empty() {
            Some(fill(model, &[id], &sights, light.as_ref())?)
        } else {
            None
        };
        let added: u64 = closed.as_ref().map_or(0, |closed| closed.added.values().sum());
        draw(closed.as_ref().map_or(&without, |closed| &closed.model), &mut filled, "filled", watch)?;
        let labels = paper.labels.as_deref().unwrap_or(&own);
        draw(&rest(labels), &mut main, MAIN_RULE_PICTURE, watch)?;
        let holes = match closed.filter(|_| added > 0) {
            Some(closed) => holes(engine, &closed, &places, options)?,
            None => HoleSums::default(),
        };
        let scores = ObjectRemoval {
            votes: plain.scores(votes_left(&own)),
            main: main.scores(votes_left(labels)),
            // Filled areas would count as leftovers.
            filled: RuleScores { leftover: None, ..filled.scores(None) },
            mean_colour: plain.mean_colour(),
            holes: holes.scores(),
            hole: plain.hole(),
            hole_filled: filled.hole(),
            added,
        };
        objects.insert(id, scores);
    }
    Ok(RemovalScores::new(objects))
}

/// Returns the share of a label's votes that went to Gaussians with other labels.
fn weight_left(ballot: &Ballot, id: u32, labels: &[u32]) -> Option<f64> {
    let sum = |rows: &dyn Fn(&usize) -> bool| -> f64 {
        (0..ballot.len()).filter(rows).map(|row| ballot.weight_on(row, id)).sum()
    };
    let all = sum(&|_| true);
    (all > 0.0).then(|| sum(&|&row| labels[row] != id) / all)
}

/// Scores the holes of a removal: the filled model, and the mean surrounding colour.
fn holes(engine: &mut Engine, closed: &Filled, places: &[RemovalSite], options: RenderOptions) -> Result<HoleSums> {
    let old = closed.model.len() as u64 - closed.added.values().sum::<u64>();
    let bare = closed.model.filtered(|row| (row as u64) < old);
    let mut holes = HoleSums::default();
    for place in places {
        let bare = drawn(engine, &bare, place.view, options)?;
        let rendered = drawn(engine, &closed.model, place.view, options)?;
        holes.add(place, &bare, &rendered);
    }
    Ok(holes)
}

/// Name of the picture by the paper's rule.
const MAIN_RULE_PICTURE: &str = "removed by main Gaussians";

/// Renders a part of the model, which may be empty.
fn drawn(engine: &mut Engine, part: &Gaussians, view: &View, options: RenderOptions) -> Result<Render> {
    engine.upload_model(part)?;
    render(engine, &view.camera, &RenderOptions { parts: Parts::COLOUR, ..options })
}
