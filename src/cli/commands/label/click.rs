//! `labelgs label --click` and `--box`: an object from places in photos.

use super::LabelArgs;
use crate::cli::support::parsers::{ViewBox, ViewPixel, view_box, view_pixel};
use crate::cli::support::scene::{find_view, open_photos};
use crate::cli::support::{Context, near_plane, open_gpu, open_model};
use crate::edit::add::add;
use crate::edit::merge::MergedLabels;
use crate::files::label_table::LabelTable;
use crate::formats::export_model;
use crate::label::click::{Area, Click, Hints, ObjectFinder, Photos, Progress};
use crate::scene::Dataset;
use crate::stage::Stage;
use crate::words::counted;
use crate::{Error, Result};
use clap::{ArgGroup, Args};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Clicks or a box instead of masks.
#[derive(Args, Clone, Debug, Default)]
#[command(next_help_heading = "Clicks")]
#[command(group = ArgGroup::new("places").args(["click", "area"]).multiple(true).requires("network").conflicts_with("masks"))]
pub struct ClickArgs {
    /// Label the object that a network finds at pixel x,y of a view, and keep all other labels; 0,0 is the top left
    /// pixel of the photo, after --max-resolution. Repeat it for more clicks on the same object, in any view.
    #[arg(long, value_name = "VIEW:x,y", value_parser = view_pixel)]
    pub click: Vec<ViewPixel>,
    /// Mark a pixel that does not belong to the object. Repeatable.
    #[arg(long, value_name = "VIEW:x,y", value_parser = view_pixel, requires = "places")]
    pub not: Vec<ViewPixel>,
    /// Label the object that a network finds in a box of a view: x0 <= x < x1 and y0 <= y < y1. You can combine it
    /// with clicks on the same object.
    #[arg(id = "area", long = "box", value_name = "VIEW:x0,y0,x1,y1", value_parser = view_box)]
    pub area: Option<ViewBox>,
    /// Folder of the segmentation network, as for `masks make`.
    #[arg(long, value_name = "DIR", requires = "places")]
    pub network: Option<PathBuf>,
    /// Name of the object.
    #[arg(long, value_name = "NAME", requires = "places")]
    pub name: Option<String>,
}

/// Labels one object.
pub(super) fn run(args: &LabelArgs, scene: &Path, context: &Context) -> Result<()> {
    let folder = args.clicks.network.as_ref().ok_or_else(|| Error::usage("--click", "needs --network"))?;
    let (model, near) = (open_model(&args.model)?, near_plane(&args.model, args.near)?);
    let (photos, typed) = open_photos((&args.model, &model), (scene, &args.reading), folder)?;
    let hints = hints(&args.clicks, &typed, &photos)?;
    let start = Instant::now();
    let mut clicking = ObjectFinder::new(open_gpu(context)?, &model, &photos, near)?;
    let stage = Stage::new("running the network", 0);
    let (mut questions, mut before) = (0, 0);
    let rows = clicking.object(&hints, &mut |progress| {
        if let Progress::Asked { done, .. } = progress {
            (before..done).for_each(|_| stage.count());
            questions += done.saturating_sub(before);
            before = done;
        }
        Ok(())
    })?;
    drop(stage);
    let table = LabelTable::find_for_model(&args.model).map(|path| LabelTable::read(&path)).transpose()?;
    let MergedLabels { model, table, into: label } = add(&model, table, &rows, args.clicks.name.as_deref())?;
    export_model(&args.output, &model, table.as_ref(), args.write.options(&args.model, &args.output)?)?;
    let count = rows.iter().filter(|is_in| **is_in).count();
    let (output, seconds) = (args.output.display().to_string(), start.elapsed().as_secs_f64());
    let name = args.clicks.name.as_ref().map_or(String::new(), |name| format!(" ({name})"));
    let text = format!(
        "{output}: {} are now object {label}{name}, after {} in {seconds:.1} s\n",
        counted(count, "Gaussian"),
        counted(questions, "prompt")
    );
    context.show(
        &json!({ "schema_version": 1, "output": output, "label": label, "gaussians": count, "seconds": seconds }),
        &text,
    )
}

/// Finds the views of clicks and box. `typed` has the size in which they were typed.
fn hints(args: &ClickArgs, typed: &Dataset, photos: &Photos) -> Result<Hints> {
    let in_view = |flag: &'static str, name: &str, [x, y]: [u32; 2]| {
        let view = find_view(typed, name)?;
        let (width, height) = view.camera.size();
        if x >= width || y >= height {
            let problem = format!("{x},{y} is outside of {}, which has {width} x {height} px", view.name);
            return Err(Error::usage(flag, problem));
        }
        photos.index(&view.name)
    };
    let on = args.click.iter().map(|at| ("--click", at));
    let click = |(flag, at): (&'static str, &ViewPixel)| {
        Ok(Click { view: in_view(flag, &at.view, at.pixel)?, pixel: at.pixel, is_on: flag == "--click" })
    };
    let clicks = on.chain(args.not.iter().map(|at| ("--not", at))).map(click).collect::<Result<_>>()?;
    let area = |ViewBox { view, corners }: &ViewBox| {
        let last = [corners[2] - 1, corners[3] - 1];
        Ok(Area { view: in_view("--box", view, last)?, corners: *corners })
    };
    Ok(Hints { clicks, area: args.area.as_ref().map(area).transpose()? })
}
