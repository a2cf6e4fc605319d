//! `labelgs label --click`: an object from places in photos.

use super::LabelArgs;
use crate::cli::support::parsers::{At, at};
use crate::cli::support::{Context, near_plane, open_gpu, open_model, open_scene, warn_of_misfit};
use crate::files::label_table::{LabelEntry, LabelTable};
use crate::files::resize::bounded_size;
use crate::formats::export_model;
use crate::label::click::{Click, Clicking};
use crate::label::vote::model::vote_engine;
use crate::records::pipeline_file::user_cache;
use crate::scene::{Dataset, Gaussians, UNLABELLED, View};
use crate::scenes::{self, LoadOptions};
use crate::segment::{FeatureCache, Network};
use crate::stage::Stage;
use crate::words::counted;
use crate::{Error, Result};
use clap::Args;
use serde_json::json;
use std::path::PathBuf;
use std::time::Instant;

/// Longest side of the views in which an object is drawn and compared, px.
const DRAWN_PX: u32 = 512;

/// Clicks instead of masks.
#[derive(Args, Clone, Debug, Default)]
#[command(next_help_heading = "Clicks")]
pub struct ClickArgs {
    /// Label what a network sees at pixel x,y of a view, and keep all other labels; 0,0 is the top left pixel of the photo, or of
    /// the smaller photo that --max-resolution makes. More clicks, also in other views, are on the same object.
    #[arg(long, value_name = "VIEW:x,y", value_parser = at, requires = "network", conflicts_with = "masks")]
    pub click: Vec<At>,
    /// A pixel that does not belong to the object. May be given several times.
    #[arg(long, value_name = "VIEW:x,y", value_parser = at, requires = "click")]
    pub not: Vec<At>,
    /// Folder with the segmentation network, as for `masks make`.
    #[arg(long, value_name = "DIR", requires = "click")]
    pub network: Option<PathBuf>,
    /// Name of the object.
    #[arg(long, value_name = "NAME", requires = "click")]
    pub name: Option<String>,
}

/// Labels one object.
pub(super) fn run(args: &LabelArgs, context: &Context) -> Result<()> {
    let folder = args.clicks.network.as_ref().ok_or_else(|| Error::usage("--click", "needs --network"))?;
    let (mut model, near) = (open_model(&args.model)?, near_plane(&args.model, args.near)?);
    let network = Network::open(folder, rayon::current_num_threads())?;
    let asked = open_scene(&args.scene, &args.reading, None, [0.0; 3], false)?;
    let options = LoadOptions { max_resolution: Some(network.side()), ..LoadOptions::default() };
    let mut dataset = scenes::open_logged(&args.scene, &args.reading.read.options(options))?;
    warn_of_misfit(&args.model, &model, &dataset)?;
    let clicks = clicks(args, &asked, &dataset)?;
    let views = dataset.train.iter_mut().chain(&mut dataset.test);
    views.for_each(|view| {
        let (width, height) = bounded_size(view.camera.size(), Some(DRAWN_PX));
        view.camera = view.camera.resized(width, height);
    });
    let views = dataset.all();
    let cache = FeatureCache::new(user_cache().as_deref(), &network);
    let features = |view: &View| cache.of(&network, &*view.photo()?);
    let start = Instant::now();
    let mut engine = vote_engine(open_gpu(context)?, &model, &views, 2)?;
    let stage = Stage::new("asking the network", 0);
    let mut photos = 0;
    let mut clicking =
        Clicking { engine: &mut engine, model: &model, views: &views, near, network: &network, features: &features };
    let rows = clicking.object(&clicks, &mut || {
        photos += 1;
        stage.count();
    })?;
    drop(stage);
    let table = LabelTable::find_for_model(&args.model).map(|path| LabelTable::read(&path)).transpose()?;
    let (label, table) = label(&mut model, &rows, table, args.clicks.name.clone())?;
    export_model(&args.output, &model, Some(&table), args.write.options(&args.model, &args.output)?)?;
    let count = rows.iter().filter(|is_in| **is_in).count() as u64;
    let (output, seconds) = (args.output.display().to_string(), start.elapsed().as_secs_f64());
    let name = table.name(label).map_or(String::new(), |name| format!(" ({name})"));
    let text = format!(
        "{output}: {} are object {label}{name}, by {} in {seconds:.1} s\n",
        counted(count as usize, "Gaussian"),
        counted(photos, "question")
    );
    context.show(
        &json!({ "schema_version": 1, "output": output, "label": label, "gaussians": count, "seconds": seconds }),
        &text,
    )
}

/// Finds the views of the clicks, and their places at the size at which objects are drawn. `asked` has the size in which they were
/// typed.
fn clicks(args: &LabelArgs, asked: &Dataset, dataset: &Dataset) -> Result<Vec<Click>> {
    let all = dataset.all();
    let typed = args.clicks.click.iter().map(|at| (at, true)).chain(args.clicks.not.iter().map(|at| (at, false)));
    let click = |(at, is_on): (&At, bool)| {
        let flag = if is_on { "--click" } else { "--not" };
        let view = crate::cli::support::scene::find_view(asked, &at.view)?;
        let (width, height) = view.camera.size();
        if at.pixel[0] >= width || at.pixel[1] >= height {
            let [x, y] = at.pixel;
            return Err(Error::usage(
                flag,
                format!("{x},{y} is outside of {}, which has {width} x {height} px", view.name),
            ));
        }
        let index = all.iter().position(|other| other.name == view.name);
        let index = index.ok_or_else(|| Error::Bug(format!("{} is read once only", view.name)))?;
        let size = bounded_size(all[index].camera.size(), Some(DRAWN_PX));
        let along = |axis: usize, from: u32, to: u32| (at.pixel[axis] as f32 + 0.5) * to as f32 / from as f32;
        Ok(Click { view: index, place: [along(0, width, size.0), along(1, height, size.1)], is_on })
    };
    typed.map(click).collect()
}

/// Gives some Gaussians a label of their own; returns it, and the names with its entry.
fn label(
    model: &mut Gaussians,
    rows: &[bool],
    table: Option<LabelTable>,
    name: Option<String>,
) -> Result<(u32, LabelTable)> {
    if !rows.contains(&true) {
        return Err(Error::usage(
            "--click",
            "the network found nothing there that the model shows; click in another view",
        ));
    }
    let count = model.len();
    let labels = model.labels.get_or_insert_with(|| vec![UNLABELLED; count]);
    let mut entries = table.map(|table| table.labels).unwrap_or_default();
    let used = labels.iter().copied().chain(entries.iter().map(|entry| entry.id)).max().unwrap_or(0);
    let new = used + 1;
    labels.iter_mut().zip(rows).filter(|(_, is_in)| **is_in).for_each(|(label, _)| *label = new);
    if let Some(confidence) = &mut model.label_confidence {
        confidence.iter_mut().zip(rows).filter(|(_, is_in)| **is_in).for_each(|(share, _)| *share = 1.0);
    }
    entries.push(LabelEntry { name, ..LabelEntry::new(new) });
    Ok((new, LabelTable::new(entries)))
}
