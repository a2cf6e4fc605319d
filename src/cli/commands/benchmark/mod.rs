//! `labelgs benchmark`: the scores of a published benchmark, with its masks, its choice of objects and its averages.

mod table;

use crate::cli::support::{
    Context, SceneArgs, ScoreArgs, TableArg, Watcher, near_plane, open_gpu_for_long, open_model, open_scene,
    require_labels,
};
use crate::engine::{Engine, EngineSize};
use crate::eval::lpips::Weights;
use crate::eval::protocol::bench::Bench;
use crate::eval::protocol::run::{picture_count, run as run_bench};
use crate::eval::protocol::score::Distance;
use crate::eval::protocol::{Layout, LayoutInput, Prompt, Protocol, SelectBy};
use crate::eval::subject::WholeModel;
use crate::files::label_table::LabelTable;
use crate::files::read;
use crate::scene::{Dataset, UNLABELLED, View};
use crate::scenes::truth::{files_below, read_truth};
use crate::words::did_you_mean;
use crate::{Error, Result};
use clap::Args;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use table::tables;

/// `labelgs benchmark`.
#[derive(Args, Clone, Debug)]
pub struct BenchmarkArgs {
    /// Model: a PLY, SPZ, GLB, SOG, USD or .splat file, or the output folder of `labelgs train`.
    #[arg(value_name = "MODEL")]
    pub model: PathBuf,
    /// Scene of the benchmark.
    #[arg(long, value_name = "SCENE")]
    pub scene: PathBuf,
    /// The benchmark.
    #[arg(long, value_name = "NAME", value_enum)]
    pub protocol: Protocol,
    /// Folder with the benchmark's masks of this scene.
    #[arg(long, value_name = "DIR")]
    pub truth: PathBuf,
    /// How to select the labels of an object. Default: name for lerf-mask and 3d-ovs, prompt for the others.
    #[arg(long, value_name = "HOW", value_enum)]
    pub by: Option<SelectBy>,
    /// Score only these objects, comma-separated names.
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub objects: Vec<String>,
    /// Reproduce the published scorer with its mistakes; only for labelgs and lerf-mask.
    #[arg(long)]
    pub compat: bool,
    #[command(flatten)]
    pub table: TableArg,
    #[command(flatten)]
    pub scoring: ScoreArgs,
    #[command(flatten)]
    pub reading: SceneArgs,
}

/// Runs the benchmark.
pub(crate) fn run(args: &BenchmarkArgs, context: &Context) -> Result<()> {
    let protocol = args.protocol;
    if args.compat && !protocol.has_scorer() {
        let name = protocol.name();
        let problem = format!("there is no published scorer of {name}; use this flag with labelgs or lerf-mask");
        return Err(Error::usage("--compat", problem));
    }
    let root = protocol.root(&args.truth);
    let by = args.by.unwrap_or(protocol.chooses_by());
    let mut layout = read_layout(protocol, &root, by, args)?;
    keep_objects(&mut layout, &args.objects)?;
    let names = read_names(args, &layout)?;
    let weights = args.scoring.lpips.as_deref().map(Weights::read).transpose()?;
    let model = open_model(&args.model)?;
    require_labels(&args.model, model.labels.is_some())?;
    let dataset = open_scene(&args.scene, &args.reading, None, [0.0; 3], true)?;
    let (views, test) = (dataset.all(), test_views(protocol, &dataset, &args.scene));
    let labels: BTreeSet<u32> = model.labels.iter().flatten().copied().filter(|&label| label != UNLABELLED).collect();
    let windows = crate::scenes::window::windows(&args.scene, &args.reading.read.lookup())?;
    let truth = |file: &Path, view: &View| read_truth(&root.join(file), view, &windows);
    let bench = Bench {
        protocol,
        compat: args.compat,
        near: near_plane(&args.model, args.scoring.near)?,
        views: &views,
        test: &test,
        names: names.as_ref(),
        labels: &labels,
        truth: &truth,
        lpips: weights.as_ref().map(|weights| weights as &dyn Distance),
    };
    bench.check(&layout, &root)?;
    let mut watcher = Watcher::new(picture_count(&layout), args.scoring.page.as_deref(), context)?;
    let sizes = views.iter().map(|view| (view.camera.width, view.camera.height));
    let size = EngineSize::for_model(&model, sizes);
    let mut engine = Engine::new(open_gpu_for_long(context)?, size, args.scoring.memory.options())?;
    let min_confidence = args.scoring.sure.min_confidence;
    let mut whole = WholeModel { engine: &mut engine, model: &model, min_confidence };
    let report = run_bench(&layout, &bench, &mut whole, &mut watcher)?;
    let tables = tables(&report);
    watcher.finish(&tables)?;
    args.scoring.json.put_out(&report, &tables.text(), context)?;
    report.check(args.scoring.min_psnr, args.scoring.min_iou)
}

fn read_layout(protocol: Protocol, root: &Path, by: SelectBy, args: &BenchmarkArgs) -> Result<Layout> {
    let files = files_below(root)?;
    let list = root.join("classes.txt");
    let classes = if list.is_file() { Some(read::text(&list)?) } else { None };
    // `--scene .` has no file name until it is resolved.
    let scene = std::fs::canonicalize(&args.scene).unwrap_or_else(|_| args.scene.clone());
    let scene = scene.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    protocol.layout(&files, classes.as_deref(), LayoutInput { truth: root, scene: &scene, by })
}

/// Keeps the objects of `--objects`.
fn keep_objects(layout: &mut Layout, wanted: &[String]) -> Result<()> {
    if wanted.is_empty() {
        return Ok(());
    }
    let there: Vec<String> = layout.tasks.iter().map(|task| task.object.clone()).collect();
    if let Some(unknown) = wanted.iter().find(|name| !there.contains(name)) {
        let cure = did_you_mean(unknown, there.iter().map(String::as_str));
        let cure = cure.unwrap_or_else(|| format!("it has {}", there.join(", ")));
        let problem = format!("the truth has no object {unknown}; {cure}");
        return Err(Error::usage("--objects", problem));
    }
    layout.tasks.retain(|task| wanted.contains(&task.object));
    Ok(())
}

/// Reads the names of the labels. Fails if objects are chosen by name and no name is known.
fn read_names(args: &BenchmarkArgs, layout: &Layout) -> Result<Option<LabelTable>> {
    let found = args.table.file(&args.model);
    let names = found.as_deref().map(LabelTable::read).transpose()?;
    let named: Vec<&str> =
        layout.tasks.iter().filter(|task| task.prompt == Prompt::Name).map(|task| task.object.as_str()).collect();
    let known =
        |name: &&str| name.parse::<u32>().is_ok() || names.as_ref().is_some_and(|names| names.id_of(name).is_some());
    if named.is_empty() || named.iter().any(known) {
        return Ok(names);
    }
    let Some((file, table)) = found.zip(names) else {
        let problem = "the model has no labels.json, and objects are chosen by name; write one, use --label-table FILE, or \
                       choose by masks with --by prompt";
        return Err(Error::data(&args.model, "", problem));
    };
    let own: Vec<&str> = table.labels.iter().filter_map(|entry| entry.name.as_deref()).collect();
    let problem = format!(
        "contains no object of the benchmark ({}); its names are {}",
        named.join(", "),
        if own.is_empty() { "none".to_owned() } else { own.join(", ") }
    );
    Err(Error::data(file, "", problem))
}

/// Returns the test views by name. If a benchmark lists its training photos in `images_train`, the others are test
/// views.
fn test_views<'a>(protocol: Protocol, dataset: &'a Dataset, scene: &Path) -> Vec<&'a View> {
    let train = scene.join("images_train");
    if !protocol.numbers_views() || !train.is_dir() {
        return dataset.test.iter().collect();
    }
    dataset.all().into_iter().filter(|view| !train.join(&view.name).is_file()).collect()
}
