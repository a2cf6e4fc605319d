//! `labelgs edit`.

use crate::Result;
use crate::cli::commands::extract_remove::scene_sights;
use crate::cli::support::parsers::near;
use crate::cli::support::{Context, EditArgs, EditResult, SceneArgs, near_plane};
use crate::edit::fill::Sight;
use crate::edit::{Document, EditsFile};
use crate::error::{Error, Setting};
use crate::scene::Gaussians;
use clap::Args;
use serde_json::json;
use std::path::{Path, PathBuf};

/// `labelgs edit`.
#[derive(Args, Clone, Debug)]
pub struct ReplayArgs {
    #[command(flatten)]
    pub edit: EditArgs,
    /// Edits to replay: the .edits.json file that the viewer saved for this model.
    #[arg(long, value_name = "EDITS.json")]
    pub replay: PathBuf,
    /// Scene of the model; needed if an edit fills a hole.
    #[arg(long, value_name = "SCENE")]
    pub scene: Option<PathBuf>,
    /// Near plane, world units; closer Gaussians are not drawn. Default: the value of the model's run, else 0.2.
    #[arg(long, value_name = "Z", value_parser = near, help_heading = "Rendering")]
    pub near: Option<f32>,
    #[command(flatten)]
    pub reading: SceneArgs,
}

/// Makes the changes of a list and writes the model.
pub(crate) fn run(args: &ReplayArgs, context: &Context) -> Result<()> {
    let (model, known) = args.edit.open()?;
    let of = model.len();
    let list = EditsFile::read(&args.replay)?;
    let mut draw = |model: &Gaussians| sights_of(args, model, context);
    let first = Document { model, table: known.table };
    let Document { model, table } = list.replay(&args.replay, first, &mut draw)?;
    let labels = model.labels.iter().flatten().copied().collect();
    let added = (model.len() as u64).saturating_sub(of as u64);
    let edited = EditResult { added, ..EditResult::new(&model, table, of, labels) };
    args.edit.finish(context, &edited, json!({ "edits": list.edits.len() }))
}

/// Draws a model from the training views of the scene.
fn sights_of(args: &ReplayArgs, model: &Gaussians, context: &Context) -> Result<Vec<Sight>> {
    let none = || Error::usage(Setting("scene"), "is missing: an edit in the list fills a hole");
    let scene: &Path = args.scene.as_deref().ok_or_else(none)?;
    let reading = args.reading.of_run(&args.edit.model)?;
    scene_sights((scene, &reading), (model, near_plane(&args.edit.model, args.near)?), context)
}
