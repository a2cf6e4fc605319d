//! `labelgs label --strokes`: objects from lines over photos.

use super::LabelArgs;
use crate::cli::support::scene::find_view;
use crate::cli::support::{Context, near_plane, open_gpu, open_model, open_scene, warn_of_misfit};
use crate::edit::select::summarise;
use crate::edit::strokes::{GraphCut, Stroke, StrokesFile, claim, stroke_title};
use crate::files::label_table::LabelTable;
use crate::formats::export_model;
use crate::label::strokes::seeds;
use crate::scene::View;
use crate::stage::Stage;
use crate::words::counted;
use crate::{Error, Result};
use serde_json::json;
use std::path::Path;
use std::time::Instant;

/// Labels the objects of the strokes of a file.
pub(super) fn run(args: &LabelArgs, (scene, path): (&Path, &Path), context: &Context) -> Result<()> {
    let file = StrokesFile::read(path)?;
    let (model, near) = (open_model(&args.model)?, near_plane(&args.model, args.near)?);
    let dataset = open_scene(scene, &args.reading, None, [0.0; 3], false)?;
    let views = (1..).zip(&file.strokes).map(|(number, stroke)| match find_view(&dataset, &stroke.view) {
        Err(Error::Usage { problem, .. }) => Err(Error::data(path, stroke_title(number), problem)),
        view => Ok((stroke, view?)),
    });
    let strokes: Vec<(&Stroke, &View)> = views.collect::<Result<_>>()?;
    warn_of_misfit(&args.model, &model, &dataset)?;
    let start = Instant::now();
    let hit = seeds(open_gpu(context)?, &model, &strokes, near, path)?;
    let stage = Stage::new("cutting objects", 0);
    let mut cutting = GraphCut::new(&model)?;
    cutting.add(&hit);
    let (found, labels) = (cutting.cut()?, cutting.labels());
    drop(stage);
    let table = LabelTable::find_for_model(&args.model).map(|path| LabelTable::read(&path)).transpose()?;
    let (model, table) = claim(&model, table, &found, &labels, &file.names(path)?)?;
    export_model(&args.output, &model, Some(&table), args.write.options(&args.model, &args.output)?)?;
    let (output, seconds) = (args.output.display().to_string(), start.elapsed().as_secs_f64());
    let mut rows = summarise(&model);
    rows.retain(|row| labels.contains(&row.label));
    let text = format!(
        "{output}: {} belong to {}, from {} in {seconds:.1} s\n",
        counted(rows.iter().map(|row| row.count).sum::<u64>(), "Gaussian"),
        counted(rows.len(), "object"),
        counted(strokes.len(), "stroke")
    );
    let result = json!({
        "schema_version": 1, "output": output, "strokes": strokes.len(), "seconds": seconds, "gaussians": model.len(),
        "labels": rows,
    });
    context.show(&result, &text)
}
