//! Shows a finished model, and changes its labels.

use super::chosen::Selection;
use super::drawing::{Drawing, Visibility};
use super::edits::Work;
use super::finder::Finder;
use super::object::Object;
use super::painter::Painter;
use super::portraits::Portraits;
use super::session::Session;
use super::views::Views;
use super::{ProgramCommands, Viewer};
use crate::engine::Engine;
use crate::error::Result;
use crate::files::label_table::LabelTable;
use crate::formats::{FirstView, formats};
use crate::gpu::Gpu;
use crate::label::click::Photos;
use crate::render::RenderOptions;
use crate::scene::overview::likely_up;
use crate::scene::spread::quantiles;
use crate::scene::{Dataset, Gaussians, Overview};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

/// Maximum wait for a request.
const WORK_WAIT_MAX: Duration = Duration::from_millis(200);

/// A finished model to show.
pub struct FinishedModel<'a> {
    /// The model as it was typed.
    pub path: &'a Path,
    /// The model.
    pub model: Gaussians,
    /// Names of its labels.
    pub table: Option<LabelTable>,
    /// Views with photos, and masks to score with; may be empty.
    pub dataset: &'a Dataset,
    /// Near plane and background.
    pub options: RenderOptions,
    /// Commands to show.
    pub words: &'a dyn ProgramCommands,
    /// Photos that are asked for an object that a page points at; without them pages cannot point at objects.
    pub photos: Option<Photos>,
    /// Where the model is seen from at first, if its file or its run says it.
    pub first_view: Option<FirstView>,
}

/// Serves a finished model until `goes_on` says no. Changes that are in no file yet are saved then; returns their file.
/// As long as that fails, it says why and goes on, so that they can be saved from the page.
///
/// # Errors
///
/// A device that fails. Errors in requests are reported to the page.
pub fn show(
    viewer: &Viewer,
    finished: FinishedModel,
    gpu: Arc<Gpu>,
    goes_on: &dyn Fn() -> bool,
) -> Result<Option<PathBuf>> {
    let views = Arc::new(Views::new(finished.dataset));
    let sizes = views.list.iter().map(|posed| (posed.view.camera.width, posed.view.camera.height));
    let (hub, is_cpu) = (&*viewer.hub, gpu.is_cpu());
    let frame = views.frame().unwrap_or_else(|| frame_of(&finished.model, finished.first_view));
    let name = gpu.capabilities().name.clone();
    hub.set_views(Arc::clone(&views));
    let mut scene = scene(&views, frame, &finished.path.display().to_string(), (&name, false));
    // Views are seen from their own places.
    let from = finished.first_view.filter(|_| views.list.is_empty());
    scene["from"] = json!(from.map(|view| (view.eye - frame.target).to_array()));
    scene["finds"] = finished.photos.is_some().into();
    scene["fills"] = finished.dataset.train.iter().any(|view| view.photo.is_some()).into();
    scene["formats"] = json!(formats());
    let near = finished.options.near;
    let finder = finished.photos.map(|photos| Finder::new(Arc::clone(&gpu), photos, near, Arc::clone(&viewer.hub)));
    let frame_up = frame.up;
    let of_views = views.list.first().map(|first| FirstView { up: frame.up, eye: first.view.camera.centre() });
    let engine = Engine::for_model(gpu, &finished.model, sizes.chain([(1, 1)]))?;
    let mut session = Session {
        hub,
        painter: Painter::new(Arc::clone(&views), is_cpu),
        background: finished.options.background,
        drawing: Drawing::new(engine, finished.options, &finished.model),
        chosen: Selection::new(&finished.model),
        work: Work::new(finished.path, finished.model, finished.table, finished.words).seen_from(finished.first_view),
        object: finder.map(Object::new),
        object_label: None,
        shown: Visibility::default(),
        told: None,
        portraits: Portraits::default(),
        scores: Vec::new(),
        views: finished.dataset.train.iter().filter(|view| view.photo.is_some()).collect(),
        up: frame_up,
        first_view: of_views.or(finished.first_view),
        scene,
    };
    hub.set_folder(session.work.folder().join("opened"));
    hub.publish("scene", &session.scene);
    session.publish();
    let mut is_refused = false;
    loop {
        if !goes_on() {
            match session.work.save() {
                Ok(file) => return Ok(file),
                Err(error) if !is_refused => {
                    is_refused = true;
                    tracing::error!(
                        "cannot save the edits: {error}. The page keeps running; press Ctrl-C again to exit without saving"
                    );
                }
                Err(_) => {}
            }
        }
        match hub.next(WORK_WAIT_MAX) {
            Some((id, message)) => session.hear(id, message)?,
            None => session.use_pause()?,
        }
    }
}

/// Returns what a page has to know of the scene.
pub(super) fn scene(
    views: &Views,
    Overview { up, target, distance }: Overview,
    title: &str,
    (device, is_training): (&str, bool),
) -> serde_json::Value {
    json!({
        "kind": "scene",
        "title": title,
        "training": is_training,
        "device": device,
        "views": views.describe(),
        "up": up.to_array(),
        "target": target.to_array(),
        "distance": distance,
        "masks": views.list.iter().any(|posed| posed.view.mask.is_some()),
        "version": env!("CARGO_PKG_VERSION"),
    })
}

/// Returns where to see a model from that has no views: half of it is in the middle.
pub(super) fn frame_of(model: &Gaussians, first_view: Option<FirstView>) -> Overview {
    let places = (0..model.len()).map(|row| model.world(row));
    let [low, middle, high] = quantiles(places.clone(), [0.1, 0.5, 0.9]);
    let size = (high - low).max_element().max(1e-3);
    let up = first_view.map_or_else(|| likely_up(places), |view| view.up);
    Overview { up, target: middle, distance: 1.5 * size }
}
