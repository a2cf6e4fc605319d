//! Scores objects found by simulated clicks against true masks. The first click is in the view that shows most of the
//! object, at the point farthest from its border. While the object is incomplete, each further click is where the error
//! in any view is farthest from its border.

use crate::{device, measure::table};
use labelgs::engine::Engine;
use labelgs::formats::read_model;
use labelgs::label::click::{Click, Hints, ObjectFinder, Photos, Progress};
use labelgs::label::vote_engine;
use labelgs::render::{NEAR_DEFAULT, label_map};
use labelgs::run::model_file;
use labelgs::scene::{LabelMap, View};
use labelgs::scenes::{LoadOptions, open};
use labelgs::segment::Network;
use labelgs::{Error, Result};
use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
    sync::Arc,
    time::Instant,
};

/// An object with at least this IoU needs no further click.
const IOU_ENOUGH: f64 = 0.9;

/// Options of the simulated clicks.
#[derive(clap::Args, Clone, Debug)]
pub struct Options {
    /// Model, a PLY or the folder of a run.
    model: PathBuf,
    /// Its scene.
    #[arg(long)]
    scene: PathBuf,
    /// True masks.
    #[arg(long)]
    masks: PathBuf,
    /// Folder of the segmentation network.
    #[arg(long)]
    network: PathBuf,
    /// Longest side of the views that are compared, px.
    #[arg(long)]
    max_resolution: Option<u32>,
    /// Most clicks on an object.
    #[arg(long, default_value_t = 3)]
    clicks: usize,
}

/// A view with its mask.
struct Truth<'a> {
    view: &'a View,
    mask: Arc<LabelMap>,
    is_held_out: bool,
}

/// Prints a row per object: its clicks, the IoU after each of them over all pixels of held-out views, and seconds.
pub fn run(options: &Options) -> Result<()> {
    let model = read_model(&model_file(&options.model)?)?.gaussians;
    let network = Network::open(&options.network, rayon::current_num_threads())?;
    let load = |max_resolution, photos| LoadOptions { max_resolution, photos, ..LoadOptions::default() };
    let photos = open(&options.scene, &load(Some(network.side()), true))?;
    let masks = Some(options.masks.clone());
    let typed = open(&options.scene, &LoadOptions { masks, ..load(options.max_resolution, false) })?;
    let photos = Photos::new(network, Some(Path::new("target/bench")), &typed, photos)?;
    let mut truths = Vec::new();
    for (views, is_held_out) in [(&typed.train, false), (&typed.test, true)] {
        for view in views {
            truths.extend(view.mask()?.map(|mask| Truth { view, mask, is_held_out }));
        }
    }
    let gpu = device::open()?;
    let mut shown =
        vote_engine(Arc::clone(&gpu), &model, &truths.iter().map(|truth| truth.view).collect::<Vec<_>>(), 2)?;
    let mut clicking = ObjectFinder::new(gpu, &model, &photos, NEAR_DEFAULT)?;
    let objects: BTreeSet<u16> = truths.iter().flat_map(|truth| truth.mask.objects()).collect();
    let mut rows = vec![["object", "click", "IoU", "first answer, s", "last, s"].map(str::to_owned).to_vec()];
    for id in objects {
        let (mut hints, mut iou) = (Hints::default(), 0.0);
        let largest = truths.iter().max_by_key(|truth| truth.mask.ids.iter().filter(|other| **other == id).count());
        let deepest = |truth: &Truth, wrong: &LabelMap| {
            let (at, depth) = (0..).zip(wrong.depths(1)).max_by_key(|(_, depth)| *depth).unwrap_or_default();
            let pixel = [at % wrong.width, at / wrong.width];
            let is_on = truth.mask.at(pixel[0], pixel[1]) == id;
            Ok::<_, Error>((depth, Click { view: photos.index(&truth.view.name)?, pixel, is_on }))
        };
        let mut next =
            Vec::from_iter(largest.map(|truth| deepest(truth, &where_differ(&truth.mask, id, None))).transpose()?);
        while let Some((_, click)) = next.pop().filter(|_| hints.clicks.len() < options.clicks && iou < IOU_ENOUGH) {
            hints.clicks.push(click);
            let (start, mut first) = (Instant::now(), None);
            let found = clicking.object(&hints, &mut |progress| {
                if matches!(progress, Progress::First(_)) {
                    first.get_or_insert(start.elapsed());
                }
                Ok(())
            });
            // Where the model shows nothing, click the next best position.
            if matches!(found, Err(Error::Usage { .. })) && !next.is_empty() {
                hints.clicks.pop();
                continue;
            }
            let (found, last) = (found?, start.elapsed().as_secs_f64());
            let maps = maps(&mut shown, &truths, &found)?;
            iou = iou_of(&truths, &maps, id);
            let wrong =
                truths.iter().zip(&maps).map(|(truth, map)| deepest(truth, &where_differ(&truth.mask, id, Some(map))));
            next = wrong.collect::<Result<_>>()?;
            next.sort_by_key(|(depth, _)| *depth);
            let [x, y] = click.pixel;
            let typed = format!("--{} {}:{x},{y}", if click.is_on { "click" } else { "not" }, photos.name(click.view));
            let first = first.map_or_else(String::new, |first| format!("{:.1}", first.as_secs_f64()));
            rows.push(vec![id.to_string(), typed, format!("{iou:.3}"), first, format!("{last:.1}")]);
        }
        clicking.forget();
    }
    println!("{}", table(&rows));
    Ok(())
}

/// Returns 1 where a map of one object differs from the true object, or everywhere on the true object without a map.
fn where_differ(mask: &LabelMap, id: u16, map: Option<&LabelMap>) -> LabelMap {
    let found = |at: usize| map.is_some_and(|map| map.ids[at] != 0);
    let ids = mask.ids.iter().enumerate().map(|(at, other)| u16::from((*other == id) != found(at))).collect();
    LabelMap { ids, ..mask.clone() }
}

/// Renders an object in each view.
fn maps(engine: &mut Engine, truths: &[Truth], rows: &[bool]) -> Result<Vec<LabelMap>> {
    engine.set_labels(&rows.iter().map(|is_in| u32::from(*is_in)).collect::<Vec<_>>())?;
    truths.iter().map(|truth| label_map(engine, &truth.view.camera, NEAR_DEFAULT)).collect()
}

/// Returns the intersection over union over all pixels of held-out views.
fn iou_of(truths: &[Truth], maps: &[LabelMap], id: u16) -> f64 {
    let held_out = truths.iter().zip(maps).filter(|(truth, _)| truth.is_held_out);
    let pixels = held_out.flat_map(|(truth, map)| truth.mask.ids.iter().map(move |other| *other == id).zip(&map.ids));
    let (both, either) = pixels.fold((0_u64, 0_u64), |(both, either), (is_true, found)| {
        (both + u64::from(is_true && *found != 0), either + u64::from(is_true || *found != 0))
    });
    both as f64 / either.max(1) as f64
}
