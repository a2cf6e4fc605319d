//! Scores by the masks of the scene: photos, visible masks, whole outlines, objects without occluders.

use super::EvalArgs;
use super::table::tables;
use crate::blocks::Seams;
use crate::cli::support::{
    Context, TableArg, Watcher, largest, near_plane, open_gpu, open_model, open_scene, pick_views, warn_of_misfit,
};
use crate::engine::{Engine, EngineSize};
use crate::eval::evaluate::{AmodalTruth, Rendering, evaluate, picture_count};
use crate::eval::lpips::Weights;
use crate::eval::protocol::score::Distance;
use crate::eval::removal::{self, RemovalTruth, removals};
use crate::eval::score_by_place;
use crate::eval::scores::Scores;
use crate::eval::subject::{Subject, WholeModel};
use crate::files::image::read_rgba;
use crate::files::label_table::LabelTable;
use crate::formats::ModelRef;
use crate::gpu::Gpu;
use crate::label::vote::model::{columns_of, limited_vote_engine};
use crate::masks::mask::read_mask;
use crate::render::RenderOptions;
use crate::render::large::{GaussianIndex, Painter, fits};
use crate::run::models;
use crate::scene::{Camera, Dataset, Photo, View};
use crate::scheduler::SchedulerOptions;
use crate::train::aligned;
use crate::{Error, Result};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Scores a model and prints the scores.
pub(crate) fn run(args: &EvalArgs, context: &Context) -> Result<()> {
    let scores = score(args, context)?;
    let tables = tables(&scores, names(args)?.as_ref());
    args.scoring.json.put_out(&scores, &tables.text(), context)?;
    scores.check(args.scoring.min_psnr, args.scoring.min_iou)
}

/// Returns the names of the labels: those of the model, or of the masks if it has none.
fn names(args: &EvalArgs) -> Result<Option<LabelTable>> {
    let own = models::open_lazily(&args.model)?.names().cloned();
    let of_model = TableArg::default().open(&args.model, own)?;
    let of_masks = || args.masks.as_deref().map_or(Ok(None), LabelTable::read_in_folder);
    if of_model.is_some() { Ok(of_model) } else { of_masks() }
}

/// Scores a model.
pub(crate) fn score(args: &EvalArgs, context: &Context) -> Result<Scores> {
    let source = models::open_lazily(&args.model)?;
    let reading = args.reading.of_run(&args.model)?;
    let dataset = open_scene(&args.scene, &reading, args.masks.clone(), args.background, true)?;
    let views = pick_views(&dataset, &args.views)?;
    let near = near_plane(&args.model, args.scoring.near)?;
    let weights = args.scoring.lpips.as_deref().map(Weights::read).transpose()?;
    let how = Rendering {
        options: RenderOptions {
            near,
            background: args.background,
            clear_labels: reading.masked_only,
            ..RenderOptions::default()
        },
        train: &dataset.train,
        by_main: args.compat,
        lpips: weights.as_ref().map(|weights| weights as &dyn Distance),
    };
    let job = Job { args, context, wholes: Folders::find(args)?, dataset: &dataset, how };
    if args.masks.is_some() {
        job.wholes.tell();
    }
    let (gpu, memory) = (open_gpu(context)?, args.scoring.memory.options());
    let image = largest(views.iter().map(|view| (view.camera.width, view.camera.height)));
    let scores = if fits(&gpu, source.view(), image, memory)? {
        job.score_whole(&gpu, views, memory)?
    } else {
        job.score_parts(&gpu, source.view(), &views, memory)?
    };
    scores.warn_of_odd_view(near);
    Ok(scores)
}

/// A scoring task.
struct Job<'a> {
    args: &'a EvalArgs,
    context: &'a Context,
    wholes: Folders,
    dataset: &'a Dataset,
    how: Rendering<'a>,
}

impl Job<'_> {
    /// Scores a model that fits into the memory of the device.
    fn score_whole(&self, gpu: &Arc<Gpu>, views: Vec<&View>, memory: SchedulerOptions) -> Result<Scores> {
        let (args, how) = (self.args, self.how);
        let model = open_model(&args.model)?;
        warn_of_misfit(&args.model, &model, self.dataset)?;
        if args.removal && model.labels.is_none() {
            let problem = "has no labels, and --removal needs them; train it with masks, or run `labelgs label`";
            return Err(Error::data(&args.model, "", problem));
        }
        let train = if args.removal { train_with_masks(args, self.dataset)? } else { Vec::new() };
        let pictures = picture_count(&views) + if args.removal { removal::picture_count(&views) } else { 0 };
        let mut watcher = Watcher::new(pictures, args.scoring.page.as_deref(), self.context)?;
        let refined = match args.refine_poses {
            true => aligned(gpu, &model, &views, (how.options.near, args.background), memory)?,
            false => Vec::new(),
        };
        let views = if args.refine_poses { refined.iter().collect() } else { views };
        let sizes = views.iter().map(|view| (view.camera.width, view.camera.height));
        let mut engine = Engine::new(gpu.clone(), EngineSize::for_model(&model, sizes), memory)?;
        let mut whole =
            WholeModel { engine: &mut engine, model: &model, min_confidence: args.scoring.sure.min_confidence };
        let mut scores =
            Scores { refined_poses: args.refine_poses, ..self.evaluate(&mut whole, &views, &mut watcher)? };
        if args.removal {
            drop(engine);
            let all: Vec<&View> = views.iter().chain(&train).copied().collect();
            let mut engine = limited_vote_engine(gpu.clone(), &model, &all, columns_of(&all), memory)?;
            let (options, truth) = (how.options, &self.wholes);
            scores.removal = Some(removals(&mut engine, &model, &views, &train, options, truth, &mut watcher)?);
        }
        watcher.finish(&tables(&scores, names(args)?.as_ref()))?;
        Ok(scores)
    }

    /// Scores a model of which each image takes a part.
    fn score_parts(
        &self,
        gpu: &Arc<Gpu>,
        model: ModelRef,
        views: &[&View],
        memory: SchedulerOptions,
    ) -> Result<Scores> {
        let args = self.args;
        for (flag, typed) in [("--removal", args.removal), ("--refine-poses", args.refine_poses)] {
            if typed {
                let problem = "needs the whole model in device memory, and the model does not fit; omit this flag";
                return Err(Error::usage(flag, problem));
            }
        }
        let mut watcher = Watcher::new(picture_count(views), args.scoring.page.as_deref(), self.context)?;
        let (index, notes) = GaussianIndex::new(model, args.scoring.sure.min_confidence, |_, _| true)?;
        models::log_notes(&args.model, &notes);
        let mut painter = Painter::new(Arc::clone(gpu), model, index, memory);
        let scores = self.evaluate(&mut painter, views, &mut watcher)?;
        watcher.finish(&tables(&scores, names(args)?.as_ref()))?;
        Ok(scores)
    }

    fn evaluate(&self, subject: &mut dyn Subject, views: &[&View], watcher: &mut Watcher) -> Result<Scores> {
        let mut scores = evaluate(subject, views, self.how, &self.wholes, watcher)?;
        if let Some(seams) = Seams::for_model(&self.args.model)? {
            subject.show(None)?;
            let draw = &mut |camera: &Camera, options: &RenderOptions| subject.render(camera, options);
            scores.places = score_by_place(draw, views, self.how.options, &seams)?;
        }
        Ok(scores)
    }
}

/// Returns the training views with masks, which scores of removals need.
fn train_with_masks<'a>(args: &EvalArgs, dataset: &'a Dataset) -> Result<Vec<&'a View>> {
    let train: Vec<&View> = dataset.train.iter().filter(|view| view.mask.is_some()).collect();
    if train.is_empty() {
        let problem = "no training view has a mask; --removal needs masks for the paper's rule";
        return Err(Error::data(args.masks.clone().unwrap_or_default(), "", problem));
    }
    Ok(train)
}

/// Reads a photo without an object, `ID/NAME.png` in a folder that need not exist.
fn without(folder: &Path, id: u32, view: &View) -> Result<Option<Photo>> {
    let Some(file) = file_of(folder, id, view) else { return Ok(None) };
    let picture = read_rgba(&file)?;
    let (width, height) = (view.camera.width, view.camera.height);
    if (picture.width, picture.height) != (width, height) {
        let problem = format!(
            "has {} x {} px, and view {} has {width} x {height} px; they must be equal, so score without \
             --max-resolution",
            picture.width, picture.height, view.name
        );
        return Err(Error::data(file, "", problem));
    }
    Ok(Some(picture))
}

/// Folders of ground truth about whole objects, `ID/NAME.png` in each.
struct Folders {
    scene: PathBuf,
    /// Outlines.
    amodal: Option<PathBuf>,
    /// Images without occluders.
    objects: Option<PathBuf>,
}

impl Folders {
    fn find(args: &EvalArgs) -> Result<Self> {
        if let Some(folder) = args.amodal.as_ref().filter(|folder| !folder.is_dir()) {
            return Err(Error::data(folder, "", "is not a folder; --amodal needs a folder with ID/NAME.png"));
        }
        let inside = |name: &str| Some(args.scene.join(name)).filter(|folder| folder.is_dir());
        let amodal = args.amodal.clone().or_else(|| inside("amodal"));
        Ok(Self { amodal, objects: inside("objects"), scene: args.scene.clone() })
    }

    /// Logs what objects are compared with: hidden parts cost a score that counts them.
    fn tell(&self) {
        match &self.amodal {
            Some(folder) => tracing::info!("whole objects are scored against the outlines in {}", folder.display()),
            None => {
                tracing::info!("objects are scored against their visible masks; use --amodal DIR for whole outlines")
            }
        }
    }
}

impl AmodalTruth for Folders {
    fn outline(&self, id: u32, view: &View) -> Result<Option<Vec<bool>>> {
        self.amodal.as_deref().map_or(Ok(None), |folder| read_outline(folder, id, view))
    }

    fn alone(&self, id: u32, view: &View) -> Result<Option<Vec<[u8; 4]>>> {
        let Some(file) = self.objects.as_deref().and_then(|folder| file_of(folder, id, view)) else { return Ok(None) };
        let picture = read_rgba(&file)?;
        Ok(Some(at_view(view, (picture.width, picture.height), |index| picture.rgba[index])))
    }
}

impl RemovalTruth for Folders {
    fn without(&self, id: u32, view: &View) -> Result<Option<Photo>> {
        without(&self.scene.join("without"), id, view)
    }

    fn shadowed(&self, id: u32, view: &View) -> Result<Option<Photo>> {
        without(&self.scene.join("shadowed"), id, view)
    }
}

/// Reads the whole outline of an object in a view from `ID/NAME.png`, scaled to the view by nearest pixels.
pub(crate) fn read_outline(folder: &Path, id: u32, view: &View) -> Result<Option<Vec<bool>>> {
    let Some(file) = file_of(folder, id, view) else { return Ok(None) };
    let map = read_mask(&file)?;
    Ok(Some(at_view(view, (map.width, map.height), |index| map.ids[index] != 0)))
}

/// Returns the path of `ID/NAME.png` if the file exists.
fn file_of(folder: &Path, id: u32, view: &View) -> Option<PathBuf> {
    let file = folder.join(id.to_string()).join(Path::new(&view.name).with_extension("png"));
    file.is_file().then_some(file)
}

/// Scales an image of `size` to the view by nearest pixels.
fn at_view<T>(view: &View, size: (u32, u32), value: impl Fn(usize) -> T) -> Vec<T> {
    let (width, height) = (view.camera.width, view.camera.height);
    let nearest = |at: u32, side: u32, from: u32| ((f64::from(at) + 0.5) * f64::from(from) / f64::from(side)) as usize;
    let pixel = |(x, y)| value(nearest(y, height, size.1) * size.0 as usize + nearest(x, width, size.0));
    (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(pixel).collect()
}
