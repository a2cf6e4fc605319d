//! `labelgs masks repair`.

use super::{files_of_photos, write_mask};
use crate::cli::support::nested_masks::{MaskFolders, choose_objects};
use crate::cli::support::parsers::near;
use crate::cli::support::{Context, Progress, SceneArgs, near_plane, open_gpu, open_model, open_scene, warn_of_misfit};
use crate::files::atomic;
use crate::files::label_table::{FILE_NAME, LabelEntry, LabelTable};
use crate::label::masks::agree::{Agreement, OBJECT_VIEWS_MIN, agree, follow};
use crate::label::masks::names::carried;
use crate::label::masks::repair::Repairs;
use crate::label::vote::model::{columns_of, vote_engine};
use crate::scene::{LabelMap, View};
use crate::scenes::window::{ids_of_photo, windows};
use crate::{Error, Result};
use clap::Args;
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// `labelgs masks repair`.
#[derive(Args, Clone, Debug)]
pub struct RepairArgs {
    /// Folder of id masks. From the folder of `masks make`, or from Segment Anything's mask lists, the objects are
    /// chosen among the nested masks by agreement of all views.
    #[arg(value_name = "MASKS")]
    pub masks: PathBuf,
    /// Model of the scene, of any trainer, with or without labels. It tells which masks show the same object.
    #[arg(long, value_name = "MODEL")]
    pub model: PathBuf,
    /// Scene of the masks.
    #[arg(long, value_name = "SCENE")]
    pub scene: PathBuf,
    /// Folder to write; must be new or empty.
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// Treat the ids of each view as independent. Use it for masks of a single-image segmenter.
    #[arg(long)]
    pub per_view: bool,
    /// Minimum number of views with a mask of an object; other objects are dropped. Default: 2, or 3 with nested
    /// masks.
    #[arg(long, value_name = "N")]
    pub min_views: Option<usize>,
    /// Also make masks for photos without one, except held-out photos.
    #[arg(long)]
    pub make_missing: bool,
    /// Near plane, world units; closer Gaussians are ignored. Default: the value of the model's run, else 0.2.
    #[arg(long, value_name = "Z", value_parser = near, help_heading = "Rendering")]
    pub near: Option<f32>,
    /// How the scene is read. Masks of test views decide nothing; they get the ids of the objects and keep their
    /// outlines.
    #[command(flatten)]
    pub reading: SceneArgs,
}

impl RepairArgs {
    /// Makes the arguments with their defaults, for a model and its scene.
    pub(in crate::cli) fn new(masks: &Path, of: (&Path, &Path), output: PathBuf, reading: SceneArgs) -> Self {
        let [masks, model, scene] = [masks, of.0, of.1].map(Path::to_owned);
        Self { masks, model, scene, output, per_view: false, min_views: None, make_missing: false, near: None, reading }
    }
}

/// Writes masks whose ids agree in all views, and says what changed.
pub(crate) fn run(args: &RepairArgs, context: &Context) -> Result<()> {
    let (json, text) = repair(args, context)?;
    context.show(&json, &text)
}

/// Writes masks whose ids agree in all views. Returns what changed, as JSON and in words.
pub(in crate::cli) fn repair(args: &RepairArgs, context: &Context) -> Result<(Value, String)> {
    atomic::require_empty("--output", &args.output)?;
    let model = open_model(&args.model)?;
    let folders = MaskFolders::from_folder(&args.masks)?;
    let mut dataset = open_scene(&args.scene, &args.reading, folders.pictures.clone(), [0.0; 3], true)?;
    let (gpu, near) = (open_gpu(context)?, near_plane(&args.model, args.near)?);
    if let Some(lists) = &folders.lists {
        choose_objects(lists, (&args.scene, &args.reading), &gpu, (&model, near, args.min_views), &mut dataset.train)?;
    }
    let views: Vec<&View> = dataset.train.iter().collect();
    if views.iter().all(|view| view.mask.is_none()) {
        return Err(Error::data(
            &args.masks,
            "",
            "no training view has a mask in this folder; check the names of the masks and --test-every",
        ));
    }
    warn_of_misfit(&args.model, &model, &dataset)?;
    let held_out: Vec<&View> = dataset.test.iter().collect();
    let all: Vec<&View> = views.iter().chain(&held_out).copied().collect();
    let windows = windows(&args.scene, &args.reading.read.lookup())?;
    let photos = files_of_photos(all.iter().map(|view| view.name.as_str()), &windows, &args.scene)?;
    let mut engine = vote_engine(gpu, &model, &all, columns_of(&views))?;
    let mut progress = Progress::new((2 * views.len() + held_out.len()) as u64, "views", &context.global);
    let mut done = 0;
    let mut tick = || {
        done += 1;
        progress.set(done, String::new);
    };
    let min_views = args.min_views.unwrap_or(OBJECT_VIEWS_MIN);
    let how = Agreement { near, ids: folders.ids(args.per_view), min_views, make_missing: args.make_missing };
    let (mut masks, mut repairs) = agree(&mut engine, &model, &views, how, &mut tick)?;
    let others = follow(&mut engine, &held_out, how, (&masks, &mut repairs), &mut tick)?;
    masks.extend(others);
    drop(progress);
    let table = table(&args.masks, args.per_view, &all, &masks)?;
    // Masks belong to the photos as they are stored, whatever their lenses.
    for (file, views_of) in &photos {
        let parts = views_of.iter().filter_map(|&at| Some((windows.get(&all[at].name)?, masks[at].as_ref()?)));
        if let Some(mask) = ids_of_photo(&parts.collect::<Vec<_>>()) {
            write_mask(&args.output.join(file), &mask)?;
        }
    }
    table.write(&args.output.join(FILE_NAME))?;
    Ok(report(&all, &masks, &repairs, args))
}

/// Makes the label table of repaired masks from the table of their folder. With ids per view, an object gets the name
/// of most of its pixels; otherwise each id keeps its entry.
pub(in crate::cli) fn table(
    folder: &Path,
    per_view: bool,
    views: &[&View],
    masks: &[Option<LabelMap>],
) -> Result<LabelTable> {
    let mut entries: BTreeMap<u16, LabelEntry> = BTreeMap::new();
    let known = LabelTable::read_in_folder(folder)?;
    let names = match &known {
        Some(known) if per_view => {
            let mut pairs = Vec::new();
            for (view, mask) in views.iter().zip(masks) {
                pairs.extend(view.mask()?.zip(mask.as_ref()));
            }
            carried(known, pairs.iter().map(|(before, after)| (&**before, *after)))
        }
        _ => BTreeMap::new(),
    };
    for mask in masks.iter().flatten() {
        for id in mask.objects() {
            let new = LabelEntry { name: names.get(&id).cloned(), ..LabelEntry::new(u32::from(id)) };
            let old = known.as_ref().filter(|_| !per_view).and_then(|table| table.entry(u32::from(id)).cloned());
            let blank = || LabelEntry { pixels: 0, views: 0, ..old.unwrap_or(new) };
            let entry = entries.entry(id).or_insert_with(blank);
            entry.views += 1;
            entry.pixels += mask.ids.iter().filter(|&&found| found == id).count() as u64;
        }
    }
    Ok(LabelTable::new(entries.into_values().collect()))
}

fn report(views: &[&View], masks: &[Option<LabelMap>], repairs: &Repairs, args: &RepairArgs) -> (Value, String) {
    let name = |view: usize| views[view].name.as_str();
    let masks_with_id = |found: &[(usize, u16)]| -> Vec<Value> {
        found.iter().map(|&(view, id)| json!({ "view": name(view), "id": id })).collect()
    };
    let Repairs { renamed, divided, left_out, filled, made } = repairs;
    let objects: BTreeSet<u16> = masks.iter().flatten().flat_map(LabelMap::objects).collect();
    let renamed_json = renamed.iter().map(|&((view, id), new)| json!({ "view": name(view), "id": id, "new": new }));
    let divided_json =
        divided.iter().map(|((view, id), parts)| json!({ "view": name(*view), "id": id, "parts": parts }));
    let result = json!({
        "schema_version": 1,
        "output": args.output.display().to_string(),
        "objects": objects,
        "renamed": renamed_json.collect::<Vec<_>>(),
        "divided": divided_json.collect::<Vec<_>>(),
        "left_out": masks_with_id(left_out),
        "filled": masks_with_id(filled),
        "made": made.iter().map(|&view| name(view)).collect::<Vec<_>>(),
    });
    let mut text = String::new();
    // Ids of single views mean nothing, so that nearly all of them change.
    for &((view, id), new) in renamed.iter().filter(|_| !args.per_view) {
        text += &format!("{}: id {id} becomes {new}\n", name(view));
    }
    for ((view, id), parts) in divided {
        let parts: Vec<String> = parts.iter().map(u16::to_string).collect();
        text += &format!("{}: id {id} is divided into {}\n", name(*view), parts.join(" and "));
    }
    for &(view, id) in left_out.iter().filter(|_| !args.per_view) {
        let least = args.min_views.unwrap_or(OBJECT_VIEWS_MIN);
        text += &format!("{}: id {id} is dropped, fewer than {least} views show the object\n", name(view));
    }
    for &(view, id) in filled {
        text += &format!("{}: id {id} is filled in\n", name(view));
    }
    text += &format!(
        "{}: {} objects in {} masks; {} masks renamed, {} divided, {} dropped, {} filled in, {} new masks\n",
        args.output.display(),
        objects.len(),
        masks.iter().flatten().count(),
        renamed.len(),
        divided.len(),
        left_out.len(),
        filled.len(),
        made.len()
    );
    (result, text)
}
