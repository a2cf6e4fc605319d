//! The choice of labels: by id, by name, or by a mask, a point or a box in a view. The choices add up.

use crate::cli::support::args::{ReadArgs, SceneArgs};
use crate::cli::support::context::Context;
use crate::cli::support::model_drawer::Drawer;
use crate::cli::support::model_edit::{or_list, require_labels};
use crate::cli::support::parsers::{Picks, ViewBox, ViewPixel, near, picks, view_box, view_pixel};
use crate::cli::support::scene::{find_view, near_plane, open_gpu, open_scene};
use crate::edit::catalogue::{Catalogue, Pick};
use crate::edit::prompt::{Prompt, PromptArea, choose};
use crate::formats::ModelRef;
use crate::scene::{Camera, LabelMap};
use crate::scheduler::SchedulerOptions;
use crate::{Error, Result, Setting};
use clap::Args;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Labels by name and by place. Pixels count from 0 at the top left of the view, in the size of its photo or in the
/// smaller size of `--max-resolution`.
#[derive(Args, Clone, Debug, Default)]
#[command(next_help_heading = "Choice of labels")]
pub struct PromptArgs {
    /// Select the label with this name, ignoring case. Repeatable.
    #[arg(long = "name", value_name = "NAME")]
    pub names: Vec<String>,
    /// Select the label at pixel x,y of a view; 0,0 is the top left pixel of the photo, after --max-resolution.
    /// Repeatable.
    #[arg(long, value_name = "VIEW:x,y", value_parser = view_pixel, requires = "scene")]
    pub at: Vec<ViewPixel>,
    /// Exclude the label at this pixel. Repeatable.
    #[arg(long, value_name = "VIEW:x,y", value_parser = view_pixel, requires = "scene")]
    pub not_at: Vec<ViewPixel>,
    /// Select labels with more than half of their pixels inside a box: x0 <= x < x1 and y0 <= y < y1. Repeatable.
    #[arg(long = "box", value_name = "VIEW:x0,y0,x1,y1", value_parser = view_box, requires = "scene")]
    pub boxes: Vec<ViewBox>,
    /// Select labels with more than half of their pixels inside a mask of the view --view. Pixels above 0 are inside.
    #[arg(long, value_name = "FILE", requires = "view", requires = "scene")]
    pub mask: Option<PathBuf>,
    /// View that --mask belongs to.
    #[arg(long, value_name = "NAME", requires = "mask")]
    pub view: Option<String>,
    /// Near plane, world units; closer Gaussians are not drawn. Default: the value of the model's run, else 0.2.
    #[arg(long, value_name = "Z", value_parser = near, help_heading = "Rendering")]
    pub near: Option<f32>,
}

/// A choice of at least one label.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Choice of labels")]
#[command(group(clap::ArgGroup::new("choice").required(true).multiple(true)
    .args(["labels", "names", "at", "boxes", "mask"])))]
pub struct ChooseArgs {
    /// Select labels by id or name, such as 1,4-6,cup; 0 is Gaussians without a label.
    #[arg(long, value_name = "LABELS", value_parser = picks)]
    pub labels: Option<Picks>,
    /// The other ways.
    #[command(flatten)]
    pub prompts: PromptArgs,
    /// Scene with the views of --at, --box and --mask.
    #[arg(long, value_name = "SCENE")]
    pub scene: Option<PathBuf>,
    /// Longest side of a view, px. Default: the photo size.
    #[arg(long, value_name = "PX", value_parser = clap::value_parser!(u32).range(1..), help_heading = "Scene")]
    pub max_resolution: Option<u32>,
    #[command(flatten)]
    pub read: ReadArgs,
}

/// A model and the scene of its views.
pub(crate) struct LabelQuery<'a> {
    /// Path of the model.
    pub path: &'a Path,
    /// The model.
    pub model: ModelRef<'a>,
    /// Its labels.
    pub known: &'a Catalogue,
    /// Scene of the views.
    pub scene: Option<&'a Path>,
    /// How the scene is read.
    pub reading: SceneArgs,
    /// Memory for label maps.
    pub memory: SchedulerOptions,
}

impl ChooseArgs {
    /// Returns the chosen labels.
    pub(crate) fn labels<'a>(
        &'a self,
        path: &'a Path,
        model: impl Into<ModelRef<'a>>,
        known: &'a Catalogue,
        to: &Context,
    ) -> Result<BTreeSet<u32>> {
        let (scene, model, memory) = (self.scene.as_deref(), model.into(), SchedulerOptions::default());
        let asked = LabelQuery { path, model, known, scene, reading: self.read_as_typed(), memory };
        self.prompts.labels("--labels", self.labels.as_ref(), &asked, to)
    }

    /// Returns how the scene of a model is read: as its run did.
    pub(crate) fn reading(&self, model: &Path) -> Result<SceneArgs> {
        self.read_as_typed().of_run(model)
    }

    fn read_as_typed(&self) -> SceneArgs {
        SceneArgs { max_resolution: self.max_resolution, read: self.read.clone(), ..SceneArgs::default() }
    }
}

impl PromptArgs {
    /// Returns true if nothing was typed.
    pub fn is_empty(&self) -> bool {
        self.names.is_empty() && self.mask.is_none() && !self.has_points()
    }

    fn has_points(&self) -> bool {
        !self.at.is_empty() || !self.not_at.is_empty() || !self.boxes.is_empty()
    }

    /// Returns the chosen labels and those of `listed`, the value of the flag `argument`.
    pub(crate) fn labels(
        &self,
        argument: &str,
        listed: Option<&Picks>,
        asked: &LabelQuery,
        context: &Context,
    ) -> Result<BTreeSet<u32>> {
        let names: Vec<Pick> = self.names.iter().map(|name| Pick::Name(name.clone())).collect();
        let lists = [(argument, listed.map_or(&[][..], |picks| &picks.0)), ("--name", &names)];
        let mut chosen = BTreeSet::new();
        for (argument, picks) in lists.into_iter().filter(|(_, picks)| !picks.is_empty()) {
            chosen.extend(or_list(asked.known.resolve(argument, picks), asked.path)?);
        }
        let prompts = self.prompts()?;
        if prompts.is_empty() {
            return if chosen.is_empty() {
                or_list(asked.known.check(argument, &chosen), asked.path).map(|()| chosen)
            } else {
                Ok(chosen)
            };
        }
        let maps = self.label_maps(&prompts, asked, context)?;
        let map_of = |prompt: &Prompt| maps.get(&key(prompt)).cloned().ok_or_else(|| Error::Bug("no map".into()));
        choose(chosen, &prompts, asked.known, &mut { map_of })
    }

    fn prompts(&self) -> Result<Vec<Prompt>> {
        let point = |argument, away| {
            move |at: &ViewPixel| {
                let [x, y] = at.pixel;
                Prompt { argument, view: at.view.clone(), size: None, place: PromptArea::Point(x, y), away }
            }
        };
        let area = |boxed: &ViewBox| Prompt {
            argument: "--box",
            view: boxed.view.clone(),
            size: None,
            place: PromptArea::Box(boxed.corners),
            away: false,
        };
        let points = self.at.iter().map(point("--at", false)).chain(self.not_at.iter().map(point("--not-at", true)));
        let mut prompts: Vec<Prompt> = points.chain(self.boxes.iter().map(area)).collect();
        if let (Some(mask), Some(view)) = (&self.mask, &self.view) {
            let map = crate::masks::mask::read_mask(mask)?;
            let place = PromptArea::Mask(map.ids.iter().map(|&id| id != 0).collect());
            let size = Some((map.width, map.height));
            prompts.push(Prompt { argument: "--mask", view: view.clone(), size, place, away: false });
        }
        Ok(prompts)
    }

    /// Renders the label map of each view and size among the prompts, each once.
    fn label_maps(&self, prompts: &[Prompt], asked: &LabelQuery, context: &Context) -> Result<BTreeMap<Key, LabelMap>> {
        let Some(scene) = asked.scene else {
            return Err(Error::usage(
                prompts[0].argument,
                format!("needs the scene of the view: {}", Setting("scene").to("SCENE")),
            ));
        };
        require_labels(asked.path, asked.model.has_labels())?;
        let dataset = open_scene(scene, &asked.reading, None, [0.0; 3], false)?;
        let mut cameras: BTreeMap<Key, Camera> = BTreeMap::new();
        for prompt in prompts {
            let camera = &find_view(&dataset, &prompt.view)?.camera;
            let (width, height) = prompt.size.unwrap_or((camera.width, camera.height));
            cameras.insert(key(prompt), camera.resized(width, height));
        }
        let near = near_plane(asked.path, self.near)?;
        let sizes = cameras.values().map(|camera| (camera.width, camera.height));
        let mut drawer = Drawer::new(open_gpu(context)?, asked.model, sizes, asked.memory)?;
        let mut map = |(key, camera): (Key, Camera)| Ok((key, drawer.label_map(&camera, near)?));
        cameras.into_iter().map(&mut map).collect()
    }
}

/// A view and its size; `None` is the size of its camera.
type Key = (String, Option<(u32, u32)>);

fn key(prompt: &Prompt) -> Key {
    (prompt.view.clone(), prompt.size)
}
