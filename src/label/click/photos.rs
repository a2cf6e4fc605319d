//! The photos that the network is queried with, and their coordinates.

use crate::error::{Error, Result};
use crate::files::resize::bounded_size;
use crate::scene::{Dataset, LabelMap, View};
use crate::segment::{Answer, FeatureCache, Network, PhotoPoint, PreparedPhoto, Prompt};
use std::path::Path;
use std::time::{Duration, Instant};

/// Longest side of the views in which objects are drawn and compared, px.
const DRAWN_SIDE_MAX_PX: u32 = 512;

/// The photos of a scene, and the segmentation network.
pub struct Photos {
    network: Network,
    cache: FeatureCache,
    /// Views at the size at which objects are drawn.
    pub(super) views: Vec<View>,
    /// Size of each view that the user's positions refer to.
    typed: Vec<(u32, u32)>,
}

/// Masks at the size of a view, and the network's score of each.
pub(super) type Masks = (Vec<LabelMap>, Vec<f64>);

impl Photos {
    /// Makes the photo set. The user's positions refer to the sizes of `typed`; `read` has the photos at the size that
    /// the network needs. Photo features are cached in `folder`, if given.
    pub fn new(network: Network, folder: Option<&Path>, typed: &Dataset, read: Dataset) -> Result<Self> {
        let sizes = typed.all();
        let mut views: Vec<View> = read.train.into_iter().chain(read.test).collect();
        views.sort_by(|a, b| a.name.cmp(&b.name));
        let size = |view: &View| {
            let same = sizes.iter().find(|other| other.name == view.name);
            let missing = || Error::Bug(format!("{} is read once only", view.name));
            same.map(|view| view.camera.size()).ok_or_else(missing)
        };
        let typed = views.iter().map(size).collect::<Result<_>>()?;
        for view in &mut views {
            let (width, height) = bounded_size(view.camera.size(), Some(DRAWN_SIDE_MAX_PX));
            view.camera = view.camera.resized(width, height);
        }
        let cache = FeatureCache::new(folder, &network);
        Ok(Self { network, cache, views, typed })
    }

    /// Returns the index of the view with exactly this name.
    pub fn index(&self, name: &str) -> Result<usize> {
        let missing = || Error::usage("view", format!("no photo is called {name}"));
        self.views.iter().position(|view| view.name == name).ok_or_else(missing)
    }

    /// Returns the name of a view.
    pub fn name(&self, view: usize) -> &str {
        &self.views[view].name
    }

    /// Returns the size that the user's positions in a view refer to, px.
    pub fn size(&self, view: usize) -> (u32, u32) {
        self.typed[view]
    }

    /// Converts a pixel corner from the user's size to the drawn view; add 0.5 to each coordinate for the pixel centre.
    pub(super) fn drawn(&self, view: usize, [x, y]: [f32; 2]) -> PhotoPoint {
        let ((width, height), to) = (self.typed[view], self.views[view].camera.size());
        [x * to.0 as f32 / width as f32, y * to.1 as f32 / height as f32]
    }

    /// Converts a position in the drawn view to a pixel in the user's size.
    pub(super) fn pixel(&self, view: usize, [x, y]: PhotoPoint) -> [u32; 2] {
        let ((width, height), from) = (self.typed[view], self.views[view].camera.size());
        let along = |at: f32, from: u32, to: u32| ((at * to as f32 / from as f32).max(0.0) as u32).min(to - 1);
        [along(x, from.0, width), along(y, from.1, height)]
    }

    /// Returns true if the network has not encoded the photo of a view yet.
    pub(super) fn is_new(&self, view: usize) -> Result<bool> {
        Ok(!self.cache.holds(&*self.views[view].photo()?))
    }

    /// Returns the network's features of a photo, and the time they took.
    pub(super) fn prepare(&self, view: usize) -> Result<(PreparedPhoto, Duration)> {
        let start = Instant::now();
        let features = self.cache.features(&self.network, &*self.views[view].photo()?)?;
        Ok((self.network.prepare(&features)?, start.elapsed()))
    }

    /// Queries masks at the size of the view.
    pub(super) fn ask(&self, view: usize, prepared: &PreparedPhoto, prompt: &Prompt) -> Result<Masks> {
        let (photo, size) = (prepared.frame.size, self.views[view].camera.size());
        let scale = [photo.0 as f32 / size.0 as f32, photo.1 as f32 / size.1 as f32];
        let Answer { masks, scores } = self.network.ask(prepared, &prompt.scaled(scale))?;
        let draw = |logits: &Vec<f32>| {
            let inside = prepared.frame.drawn(&|cell| logits[cell], size);
            LabelMap { width: size.0, height: size.1, ids: inside.into_iter().map(u16::from).collect() }
        };
        let scores = scores.iter().map(|score| f64::from(*score).clamp(0.0, 1.0)).collect();
        Ok((masks.iter().map(draw).collect(), scores))
    }
}
