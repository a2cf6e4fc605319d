//! `labelgs masks make`.

use super::{files_of_photos, write_mask};
use crate::cli::support::nested_masks::{NESTED_FOLDER, OBJECTS_FOLDER};
use crate::cli::support::parsers::share;
use crate::cli::support::{Context, FileArgs, Progress, ReadArgs, quoted};
use crate::files::resize::bounded_size;
use crate::files::{atomic, read};
use crate::masks::nested;
use crate::records::pipeline_file::user_cache;
use crate::scene::{LabelMap, View};
use crate::scenes::{self, LoadOptions};
use crate::segment::{FeatureCache, Level, Network, PhotoMasks, Search, masks_of_photo, threads_for};
use crate::words::counted;
use crate::{Error, Result};
use clap::Args;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// File that says how the masks of a folder were made.
const MASKS_RECORD: &str = "masks.json";
/// Longest side of a mask, px: twice the grid of the network, so that outlines are as smooth as it draws them.
const MASK_SIDE_MAX: u32 = 512;

/// Defaults of the flags.
const GRID_DEFAULT: u16 = 12;
const SCORE_MIN_DEFAULT: f32 = 0.7;
const STABILITY_MIN_DEFAULT: f32 = 0.5;

/// The levels of nested masks, and the folders of their id images.
const LEVEL_FOLDERS: [(Level, &str); 3] =
    [(Level::Objects, OBJECTS_FOLDER), (Level::Parts, "parts"), (Level::Wholes, "wholes")];

/// `labelgs masks make`.
#[derive(Args, Clone, Debug)]
pub struct MakeArgs {
    /// Scene with the photos.
    #[arg(value_name = "SCENE")]
    pub scene: PathBuf,
    /// Folder of the segmentation network with `encoder.onnx` and `decoder.onnx`, exported from Segment Anything,
    /// MobileSAM, EdgeSAM or SAM 2.
    #[arg(long, value_name = "DIR")]
    pub network: PathBuf,
    /// Folder to write: nested/ gets all masks of each photo, and objects/, parts/ and wholes/ get an id image per
    /// level. Photos that have masks there are skipped, so you can resume an interrupted run.
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    /// Number of prompt points along each side of a photo.
    #[arg(long, value_name = "N", default_value_t = GRID_DEFAULT, value_parser = clap::value_parser!(u16).range(1..=128))]
    pub grid: u16,
    /// Minimum mask quality, as predicted by the network.
    #[arg(long, value_name = "SHARE", default_value_t = SCORE_MIN_DEFAULT, value_parser = share)]
    pub min_score: f32,
    /// Minimum stability of a mask: its area at a strict threshold divided by its area at a loose threshold.
    #[arg(long, value_name = "SHARE", default_value_t = STABILITY_MIN_DEFAULT, value_parser = share)]
    pub min_stability: f32,
    /// Number of threads. Default: one per CPU core, fewer if memory is short. A photo takes about 400 MB, and each
    /// thread 60 MB.
    #[arg(long, value_name = "N")]
    pub threads: Option<usize>,
    #[command(flatten)]
    pub read: ReadArgs,
}

impl MakeArgs {
    /// Makes the arguments with their defaults.
    pub(in crate::cli) fn new(scene: &Path, network: &Path, output: PathBuf, files: FileArgs) -> Self {
        Self {
            scene: scene.to_owned(),
            network: network.to_owned(),
            output,
            grid: GRID_DEFAULT,
            min_score: SCORE_MIN_DEFAULT,
            min_stability: STABILITY_MIN_DEFAULT,
            threads: None,
            read: ReadArgs { files, poses: None },
        }
    }
}

/// Record of the options that masks were made with, stored beside them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct MaskRecord {
    schema_version: u32,
    network: String,
    grid: u16,
    min_score: f32,
    min_stability: f32,
}

/// Makes the masks and says what comes next.
pub(crate) fn run(args: &MakeArgs, context: &Context) -> Result<()> {
    let (json, text) = make(args, context)?;
    let [scene, output] = [&args.scene, &args.output].map(|path| quoted(&path.to_string_lossy()));
    let next = format!(
        "{text}next:\n  labelgs train {scene} -o plain\n  labelgs label plain --scene {scene} --masks {output} -o labelled.ply\n"
    );
    context.show(&json, &next)
}

/// Opens the network, and the folder for masks that are made by it.
pub(in crate::cli) fn opened(args: &MakeArgs) -> Result<Network> {
    let threads = args.threads.unwrap_or_else(|| threads_for(rayon::current_num_threads(), read::free_memory()));
    let network = Network::open(&args.network, threads)?;
    remember(args, &network)?;
    Ok(network)
}

/// Makes the masks. Returns what was done, as JSON and in words.
pub(in crate::cli) fn make(args: &MakeArgs, context: &Context) -> Result<(Value, String)> {
    let network = opened(args)?;
    let options = LoadOptions { undistort: false, max_resolution: Some(network.side()), ..LoadOptions::default() };
    let dataset = scenes::open_logged(&args.scene, &args.read.options(LoadOptions { test_every: None, ..options }))?;
    let views = dataset.all();
    let files = files_of_photos(views.iter().map(|view| view.name.as_str()), &BTreeMap::new(), &args.scene)?;
    let cache = FeatureCache::new(user_cache().as_deref(), &network);
    let mut progress = Progress::new(files.len() as u64, "photos", &context.global);
    let (mut made, mut masks, mut empty) = (0, 0, Vec::new());
    for (done, (file, of)) in files.iter().enumerate() {
        let list = args.output.join(NESTED_FOLDER).join(file).with_extension("json");
        if !list.is_file() {
            let view = views[of[0]];
            let found = of_photo(args, &network, &cache, view)?;
            for ((_, folder), map) in LEVEL_FOLDERS.iter().zip(&found.levels) {
                write_mask(&args.output.join(folder).join(file), map)?;
            }
            // Written last: its presence means that the photo is done.
            nested::write(&list, size_of(&found.levels), &found.masks)?;
            if found.masks.is_empty() {
                empty.push(view.name.as_str());
            }
            (made, masks) = (made + 1, masks + found.masks.len());
        }
        progress.set(done as u64 + 1, String::new);
    }
    drop(progress);
    if !empty.is_empty() {
        tracing::warn!("no masks found in {}: {}", counted(empty.len(), "photo"), empty.join(", "));
    }
    let output = args.output.display().to_string();
    let left = files.len() - made;
    let text = format!("{output}: {} in {}; {left} were done before\n", counted(masks, "mask"), counted(made, "photo"));
    Ok((json!({ "schema_version": 1, "output": output, "photos": made, "left": left, "masks": masks }), text))
}

/// Writes how the masks are made, or refuses a folder whose masks were made otherwise.
fn remember(args: &MakeArgs, network: &Network) -> Result<()> {
    let made = MaskRecord {
        schema_version: 1,
        network: network.digest.clone(),
        grid: args.grid,
        min_score: args.min_score,
        min_stability: args.min_stability,
    };
    let path = args.output.join(MASKS_RECORD);
    if !path.is_file() {
        atomic::require_empty("--output", &args.output)?;
        return atomic::write_json(&path, &made);
    }
    let before: MaskRecord = read::json(&path, "how masks were made")?;
    if before != made {
        let problem = "these masks were made by another network or with other options; use a new folder";
        return Err(Error::data(&path, "", problem));
    }
    Ok(())
}

fn of_photo(args: &MakeArgs, network: &Network, cache: &FeatureCache, view: &View) -> Result<PhotoMasks> {
    let search = Search { grid: usize::from(args.grid), min_score: args.min_score, min_stability: args.min_stability };
    let photo = view.photo()?;
    let features = cache.features(network, &photo)?;
    let size = bounded_size(features.photo, Some(MASK_SIDE_MAX));
    masks_of_photo(network, &features, &search, &LEVEL_FOLDERS.map(|(level, _)| level), size)
}

fn size_of(levels: &[LabelMap]) -> (u32, u32) {
    levels.first().map_or((0, 0), |map| (map.width, map.height))
}
