//! Masks of a command: id images, or nested masks among which all views together choose objects.

use crate::cli::support::SceneArgs;
use crate::engine::Engine;
use crate::gpu::Gpu;
use crate::label::masks::agree::Ids;
use crate::label::masks::nested::{NestedMasks, objects, painted};
use crate::masks::nested::{files_of_photos, read};
use crate::scene::{Gaussians, View};
use crate::scenes::resample::resample_ids;
use crate::scenes::window::{Window, windows};
use crate::stage::Stage;
use crate::words::counted;
use crate::{Error, Result, Setting};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Folders in the output of `masks make`: nested masks, and the id images whose outlines held-out views keep.
pub(crate) const NESTED_FOLDER: &str = "nested";
pub(crate) const OBJECTS_FOLDER: &str = "objects";

/// Where masks are.
#[derive(Clone, Debug)]
pub(crate) struct MaskFolders {
    /// Id images.
    pub pictures: Option<PathBuf>,
    /// Nested masks.
    pub lists: Option<PathBuf>,
}

impl MaskFolders {
    /// Detects the kind of a folder: the output of `masks make`, Segment Anything's mask lists, or id images.
    pub(crate) fn from_folder(folder: &Path) -> Result<Self> {
        let (lists, objects) = (folder.join(NESTED_FOLDER), folder.join(OBJECTS_FOLDER));
        if lists.is_dir() {
            return Ok(Self { pictures: objects.is_dir().then_some(objects), lists: Some(lists) });
        }
        let is_lists = crate::masks::nested::has_lists(folder)?;
        let folder = folder.to_owned();
        Ok(if is_lists {
            Self { pictures: None, lists: Some(folder) }
        } else {
            Self { pictures: Some(folder), lists: None }
        })
    }

    /// Returns what the ids of the views' masks mean, once objects are chosen among nested ones.
    pub(crate) fn ids(&self, per_view: bool) -> Ids {
        match self.lists {
            Some(_) => Ids::Chosen,
            None if per_view => Ids::PerView,
            None => Ids::Shared,
        }
    }
}

/// Gives views the masks of the objects that all of them together choose among nested masks; none to views without any.
/// Objects in fewer than `min_views` views are left out.
pub(crate) fn choose_objects(
    lists: &Path,
    (scene, reading): (&Path, &SceneArgs),
    gpu: &Arc<Gpu>,
    (model, near, min_views): (&Gaussians, f32, Option<usize>),
    views: &mut [View],
) -> Result<()> {
    let windows = windows(scene, &reading.read.lookup())?;
    let photo = |view: &View| windows.get(&view.name).map_or(view.name.clone(), |window| window.photo.clone());
    let names: Vec<String> = views.iter().map(photo).collect();
    let mut unique: Vec<&str> = names.iter().map(String::as_str).collect();
    unique.sort_unstable();
    unique.dedup();
    let files: BTreeMap<&str, PathBuf> = match files_of_photos(lists, &unique)? {
        Some(files) => unique.iter().zip(files).filter_map(|(name, file)| Some((*name, file?))).collect(),
        None => {
            let problem = "no training view has nested masks in this folder; check the file names";
            return Err(Error::data(lists, "", problem));
        }
    };
    let stage = Stage::new("reading masks", views.len());
    let of_view = |(view, name): (&View, &String)| -> Result<Option<NestedMasks>> {
        let Some(file) = files.get(name.as_str()) else { return Ok(None) };
        let masks = stage.counted(|| read(file))?;
        let stored = Window::stored(&view.name, &view.camera);
        let window = windows.get(&view.name).unwrap_or(&stored);
        let size = (view.camera.width, view.camera.height);
        let layers = masks.layers.iter().map(|layer| resample_ids(layer, window, size)).collect();
        Ok(Some(NestedMasks { layers, ..masks }))
    };
    let nested: Vec<Option<NestedMasks>> = views.iter().zip(&names).map(of_view).collect::<Result<_>>()?;
    drop(stage);
    let sizes = views.iter().map(|view| (view.camera.width, view.camera.height));
    let mut engine = Engine::for_model(Arc::clone(gpu), model, sizes)?;
    let stage = Stage::new("choosing objects", views.len());
    let pairs: Vec<(&View, Option<&NestedMasks>)> =
        views.iter().zip(&nested).map(|(view, masks)| (view, masks.as_ref())).collect();
    let found = objects(&mut engine, model, &pairs, (near, min_views), &mut || stage.count())?;
    if found.is_empty() {
        let problem = match min_views {
            Some(least) => format!("no object has masks in {}; lower {}", counted(least, "view"), Setting("min_views")),
            None => {
                "no object that several views confirm; run `masks make` with a larger --grid or a lower --min-score"
                    .into()
            }
        };
        return Err(Error::data(lists, "", problem));
    }
    for (index, (view, masks)) in views.iter_mut().zip(&nested).enumerate() {
        view.mask = masks.as_ref().and_then(|masks| painted(&found, index, masks)).map(Into::into);
    }
    Ok(())
}
