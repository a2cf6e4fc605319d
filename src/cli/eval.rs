//! `labelgs eval`.

use super::Context;
use super::args::EvalArgs;
use super::log::Progress;
use super::scene::{near_plane, open_gpu, open_scene, pick_views, render_engine};
use super::{open_model, stdout};
use crate::infer::evaluate::{Rendering, evaluate, picture_count};
use crate::infer::scores::Scores;
use crate::io::{atomic, mask::read_mask};
use crate::scene::View;
use crate::{Error, Result};
use std::path::Path;

/// Scores a model.
pub fn run(args: &EvalArgs, context: &Context) -> Result<()> {
    let model = open_model(&args.model)?;
    let dataset = open_scene(&args.scene, &args.reading, args.masks.clone(), args.background, true)?;
    let views = pick_views(&dataset, &args.views)?;
    let gpu = open_gpu(context)?;
    let sizes = views.iter().map(|view| (view.camera.width, view.camera.height));
    let mut engine = render_engine(gpu, &model, sizes)?;
    let amodal = args.amodal.clone().or_else(|| Some(args.scene.join("amodal")).filter(|folder| folder.is_dir()));
    if let Some(folder) = args.amodal.as_ref().filter(|folder| !folder.is_dir()) {
        return Err(Error::data(folder, "", "is no folder; --amodal needs a folder with ID/NAME.png"));
    }
    let how = Rendering { near: near_plane(&args.model, args.near)?, background: args.background };
    let outline = |id, view: &View| match &amodal {
        Some(folder) => read_outline(folder, id, view),
        None => Ok(None),
    };
    let mut progress = Progress::new(picture_count(&views), "pictures", &context.global);
    let mut done = 0;
    let scores = evaluate(&mut engine, &model, &views, how, &outline, &mut || {
        done += 1;
        progress.set(done, String::new);
    })?;
    drop(progress);
    match &args.json {
        Some(Some(file)) => write_json(file, &scores)?,
        Some(None) => stdout::print_json(&scores)?,
        None if context.json => stdout::print_json(&scores)?,
        None => {}
    }
    if !context.json && !matches!(args.json, Some(None)) {
        stdout::print(&table(&scores))?;
    }
    scores.check(args.min_psnr, args.min_iou)
}

/// Writes scores as JSON.
pub fn write_json(file: &Path, scores: &impl serde::Serialize) -> Result<()> {
    let text = serde_json::to_string_pretty(scores).map_err(|error| Error::Bug(format!("JSON: {error}")))?;
    atomic::write(file, |out| out.write_all(text.as_bytes()))
}

/// The whole outline of an object in a view: `ID/NAME.png`, sized like the view by nearest pixels.
pub fn read_outline(folder: &Path, id: u32, view: &View) -> Result<Option<Vec<bool>>> {
    let file = folder.join(id.to_string()).join(Path::new(&view.name).with_extension("png"));
    if !file.is_file() {
        return Ok(None);
    }
    let map = read_mask(&file)?;
    let (width, height) = (view.camera.width, view.camera.height);
    let nearest = |at: u32, size: u32, from: u32| ((f64::from(at) + 0.5) * f64::from(from) / f64::from(size)) as u32;
    let pixel = |(x, y)| map.at(nearest(x, width, map.width), nearest(y, height, map.height)) != 0;
    Ok(Some((0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(pixel).collect()))
}

fn table(scores: &Scores) -> String {
    let number = |value: Option<f64>, digits: usize| value.map_or("-".to_owned(), |value| format!("{value:.digits$}"));
    let mut text = format!("{:>10} {:>8} {:>8}\n", "view", "PSNR", "SSIM");
    for (name, view) in &scores.views {
        text += &format!("{name:>10} {:>8.2} {:>8.4}\n", view.psnr, view.ssim);
    }
    text += &format!("{:>10} {:>8} {:>8}\n", "mean", number(scores.mean.psnr, 2), number(scores.mean.ssim, 4));
    if scores.objects.is_empty() {
        return text;
    }
    text +=
        &format!("\n{:>10} {:>8} {:>10} {:>9} {:>11}\n", "object", "iou_map", "iou_object", "paper_iou", "object_psnr");
    let rows = scores.objects.iter().map(|(id, scores)| (id.to_string(), scores));
    for (name, row) in rows.chain([("mean".to_owned(), &scores.mean.objects)]) {
        text += &format!(
            "{name:>10} {:>8} {:>10} {:>9} {:>11}\n",
            number(row.iou_map, 4),
            number(row.iou_object, 4),
            number(row.paper_iou, 4),
            number(row.object_psnr, 2)
        );
    }
    text
}
