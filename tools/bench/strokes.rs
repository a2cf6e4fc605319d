//! Scores objects found by simulated strokes against true masks. Each object, and the background, gets a line through
//! its middle in the first training view that shows at least half as much of it as any view.

use crate::{device, measure::table};
use labelgs::edit::strokes::{GraphCut, Stroke};
use labelgs::formats::read_model;
use labelgs::label::strokes::seeds;
use labelgs::label::{VoteOptions, columns_of, label_by_votes, vote_engine};
use labelgs::render::{NEAR_DEFAULT, label_map};
use labelgs::run::model_file;
use labelgs::scene::{LabelMap, View};
use labelgs::scenes::{LoadOptions, open};
use labelgs::{Error, Result};
use std::cmp::Reverse;
use std::collections::{BTreeSet, BinaryHeap};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

/// Options of the simulated strokes.
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
    /// Longest side of the views, px.
    #[arg(long)]
    max_resolution: Option<u32>,
}

/// Prints for each object its stroke, and the IoU of the result over all pixels of held-out views and over all
/// Gaussians, beside the IoU of the votes of all masks, whose labels serve as ground truth for Gaussians.
pub fn run(options: &Options) -> Result<()> {
    let model = read_model(&model_file(&options.model)?)?.gaussians;
    let masks = Some(options.masks.clone());
    let load = LoadOptions { masks, max_resolution: options.max_resolution, photos: false, ..LoadOptions::default() };
    let dataset = open(&options.scene, &load)?;
    let masked = |views: &[View]| views.iter().filter(|view| view.mask.is_some()).cloned().collect::<Vec<View>>();
    let (train, test) = (masked(&dataset.train), masked(&dataset.test));
    let drawn = draw(&train)?;
    let strokes: Vec<(&Stroke, &View)> = drawn.iter().map(|(stroke, view)| (stroke, *view)).collect();
    let start = Instant::now();
    let hit = seeds(device::open()?, &model, &strokes, NEAR_DEFAULT, Path::new("the rule"))?;
    let shown = start.elapsed();
    let start = Instant::now();
    let mut cutting = GraphCut::new(&model)?;
    cutting.add(&hit);
    let found = cutting.cut()?;
    let (first, start) = (start.elapsed(), Instant::now());
    cutting.cut()?;
    println!("views {shown:.1?}, objects {first:.1?}, again {:.1?}", start.elapsed());

    let all: Vec<&View> = train.iter().collect();
    let mut engine = vote_engine(device::open()?, &model, &all, columns_of(&all))?;
    let mut voted = model.clone();
    label_by_votes(
        &mut engine,
        &mut voted,
        &all,
        &VoteOptions { near: NEAR_DEFAULT, mask_border: 0, min_confidence: 0.0 },
        &mut |_| (),
    )?;
    let voted = voted.labels.unwrap_or_default();
    let mut maps = |labels: &[u32]| -> Result<Vec<LabelMap>> {
        engine.set_labels(labels)?;
        test.iter().map(|view| label_map(&mut engine, &view.camera, NEAR_DEFAULT)).collect()
    };
    let (by_strokes, by_masks) = (maps(&found)?, maps(&voted)?);
    let truths: Vec<Arc<LabelMap>> =
        test.iter().map(View::mask).collect::<Result<Vec<_>>>()?.into_iter().flatten().collect();
    let pixels = |maps: &[LabelMap], id: u16| {
        let pairs = truths.iter().zip(maps).flat_map(|(truth, map)| truth.ids.iter().zip(&map.ids));
        iou(pairs.map(|(truth, found)| (*truth == id, *found == id)))
    };
    let head = ["object", "stroke", "px", "IoU of maps", "by all masks", "IoU of Gaussians"];
    let mut rows = vec![head.map(str::to_owned).to_vec()];
    let (mut sums, mut count) = ([0.0; 3], 0.0);
    for (stroke, view) in &strokes {
        let mut row = vec![stroke.label.to_string(), view.name.clone(), stroke.points.len().to_string()];
        if stroke.on {
            let id = stroke.label as u16;
            let gaussians =
                voted.iter().zip(&found).map(|(voted, found)| (*voted == stroke.label, *found == stroke.label));
            let scores = [pixels(&by_strokes, id), pixels(&by_masks, id), iou(gaussians)];
            row.extend(scores.map(|score| format!("{score:.3}")));
            sums.iter_mut().zip(scores).for_each(|(sum, score)| *sum += score);
            count += 1.0;
        }
        rows.push(row);
    }
    let means = sums.map(|sum| format!("{:.3}", sum / f64::max(count, 1.0)));
    rows.push(["mean".to_owned(), String::new(), String::new()].into_iter().chain(means).collect());
    println!("{}", table(&rows));
    Ok(())
}

/// Intersection over union.
fn iou(pairs: impl Iterator<Item = (bool, bool)>) -> f64 {
    let (both, either) =
        pairs.fold((0_u64, 0_u64), |(both, either), (a, b)| (both + u64::from(a && b), either + u64::from(a || b)));
    both as f64 / either.max(1) as f64
}

/// Draws a stroke for each object and one for the background.
fn draw(views: &[View]) -> Result<Vec<(Stroke, &View)>> {
    let masks: Vec<(Arc<LabelMap>, &View)> = views
        .iter()
        .map(|view| Ok(view.mask()?.map(|mask| (mask, view))))
        .collect::<Result<Vec<_>>>()?
        .into_iter()
        .flatten()
        .collect();
    let objects: BTreeSet<u16> = masks.iter().flat_map(|(mask, _)| mask.objects()).collect();
    let mut strokes = Vec::new();
    for id in std::iter::once(0).chain(objects) {
        let area = |mask: &LabelMap| mask.ids.iter().filter(|other| **other == id).count();
        let most = masks.iter().map(|(mask, _)| area(mask)).max().unwrap_or_default();
        let first = masks.iter().find(|(mask, _)| most > 0 && 2 * area(mask) >= most);
        let (mask, view) = first.ok_or_else(|| Error::usage("--masks", "no training view shows any background"))?;
        let points = medial_line(mask, id).into_iter().map(|at| at.map(f64::from)).collect();
        let (name, label) = (None, u32::from(id));
        strokes.push((Stroke { view: view.name.clone(), points, radius: 0.0, label, name, on: id != 0 }, *view));
    }
    Ok(strokes)
}

/// Returns the pixels of the longest line through the deepest part of an id: the path between the two ends that are
/// farthest apart, as far from the border as possible, without pixels nearer to an end than to the border.
fn medial_line(map: &LabelMap, id: u16) -> Vec<[u32; 2]> {
    let depths = map.depths(id);
    let at_most = |at: &usize| (depths[*at], Reverse(*at));
    let Some(deepest) = (0..depths.len()).filter(|&at| depths[at] > 0).max_by_key(at_most) else {
        return Vec::new();
    };
    let farthest = |from: usize| {
        let ways = ways(map, &depths, from, |_| 1).0;
        let reached = (0..ways.len()).filter(|&at| ways[at] < u64::MAX);
        reached.max_by_key(|&at| (ways[at], Reverse(at))).unwrap_or(from)
    };
    let first = farthest(deepest);
    let last = farthest(first);
    let most = u64::from(depths[deepest]);
    let narrow = |depth: u32| 1 + (1000 * most / u64::from(depth).max(1)).pow(2) / 1000;
    let before = ways(map, &depths, first, narrow).1;
    let mut line = vec![last];
    while let Some(&at) = line.last().filter(|&&at| at != first) {
        line.push(before[at]);
    }
    let is_middle = |(way, &at): (usize, &usize)| way >= depths[at] as usize;
    let start = line.iter().enumerate().position(is_middle).unwrap_or(line.len() / 2);
    let end = line.iter().rev().enumerate().position(is_middle).map_or(start, |way| line.len() - 1 - way);
    let middle = &line[start.min(end)..=start.max(end)];
    middle.iter().map(|&at| [at as u32 % map.width, at as u32 / map.width]).collect()
}

/// Returns the cost of the cheapest path from one pixel to each pixel of its part, and the previous pixel on that path.
/// `cost` maps a pixel's depth to its cost.
fn ways(map: &LabelMap, depths: &[u32], from: usize, cost: impl Fn(u32) -> u64) -> (Vec<u64>, Vec<usize>) {
    let (mut ways, mut before) = (vec![u64::MAX; depths.len()], vec![from; depths.len()]);
    let (width, height) = (map.width as usize, map.height as usize);
    ways[from] = 0;
    let mut open = BinaryHeap::from([Reverse((0, from))]);
    while let Some(Reverse((way, at))) = open.pop() {
        let (x, y) = (at % width, at / width);
        let beside = [
            (x > 0, at.wrapping_sub(1)),
            (x + 1 < width, at + 1),
            (y > 0, at.wrapping_sub(width)),
            (y + 1 < height, at + width),
        ];
        for (_, next) in beside.into_iter().filter(|&(is_there, next)| is_there && depths[next] > 0) {
            let further = way + cost(depths[next]);
            if way <= ways[at] && further < ways[next] {
                (ways[next], before[next]) = (further, at);
                open.push(Reverse((further, next)));
            }
        }
    }
    (ways, before)
}
