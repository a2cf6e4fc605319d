//! Sizes that an engine allocates memory for.

use crate::error::{Error, Result, Setting};
use crate::pass::KernelShape;
use crate::scene::Gaussians;

/// Sizes of the label buffers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LabelSize {
    /// Largest id in a step's masks; 0 without object layers.
    pub max_label: u32,
    /// Maximum number of objects sampled in one step.
    pub layers: u32,
    /// Labels that votes are counted for, including the background; 0 without votes. Many labels and Gaussians take
    /// several sweeps (`Engine::vote_columns`).
    pub vote_columns: u32,
}

/// Sizes that an engine allocates memory for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct EngineSize {
    /// Gaussians.
    pub gaussians: u64,
    /// Largest image, px.
    pub image: (u32, u32),
    /// True to allocate optimiser state and gradients.
    pub trained: bool,
    /// Sizes for labels; `None` for a scene without masks, which then has no label buffers.
    pub labels: Option<LabelSize>,
    /// Rows of four shared parameters.
    pub shared_rows: u32,
    /// Frozen Gaussians at the end of the model: drawn, not trained, and without optimiser state.
    pub frozen: u32,
    /// True to allocate memory for known photo depths.
    pub depths: bool,
    /// True to pack both moments of a parameter into one word, 16 bits each (glsl/include/moments_store.glsl).
    pub half_moments: bool,
}

impl EngineSize {
    /// Sizes for rendering this many Gaussians in images of up to `image` px.
    pub const fn new(gaussians: u64, image: (u32, u32)) -> Self {
        Self {
            gaussians,
            image,
            trained: false,
            labels: None,
            shared_rows: 0,
            frozen: 0,
            depths: false,
            half_moments: false,
        }
    }

    /// Sizes for rendering a model, and its labels if it has some, in images of up to the largest of `sizes`, px.
    pub fn for_model(model: &Gaussians, sizes: impl Iterator<Item = (u32, u32)>) -> Self {
        let image = sizes.reduce(|a, b| (a.0.max(b.0), a.1.max(b.1))).unwrap_or((1, 1));
        let labels = model.labels.as_ref().map(|_| LabelSize::default());
        Self::new((model.len() as u64).max(1), image).with_labels(labels)
    }

    /// Adds optimiser state and gradients.
    pub const fn for_training(self) -> Self {
        Self { trained: true, ..self }
    }

    /// Sets the sizes for labels, if any.
    pub const fn with_labels(self, labels: Option<LabelSize>) -> Self {
        Self { labels, ..self }
    }

    /// Sets the number of rows of four shared parameters.
    #[doc(hidden)]
    pub const fn with_shared_rows(self, shared_rows: u32) -> Self {
        Self { shared_rows, ..self }
    }

    /// Sets the number of Gaussians at the end that are not trained.
    #[doc(hidden)]
    pub const fn with_frozen(self, frozen: u32) -> Self {
        Self { frozen, ..self }
    }

    /// Sets whether there is room for known depths.
    pub(crate) const fn with_depths(self, depths: bool) -> Self {
        Self { depths, ..self }
    }

    /// Sets whether both moments of a parameter share a word.
    #[doc(hidden)]
    pub const fn with_half_moments(self, half_moments: bool) -> Self {
        Self { half_moments, ..self }
    }

    /// Returns the most tiles, and tile rows, that the device's kernels can process; `None` without a limit.
    fn most_rounds(&self, shape: &KernelShape) -> Option<u32> {
        // A splat may touch every tile twice, once in its object's layer. One loop visits the tiles, another the rows.
        let times = if self.labels.is_some_and(|labels| labels.layers > 0) { 2 } else { 1 };
        shape.loop_rounds.map(|rounds| rounds / times)
    }

    /// Returns the most picture rows that one list can draw; `None` without a limit.
    pub(crate) fn band(&self, shape: &KernelShape) -> Option<u32> {
        let rounds = shape.tiles(self.image.0, 1).0 + 1;
        self.most_rounds(shape).map(|most| (most / rounds).max(1) * shape.tile_height)
    }

    /// Limits the image to one band ([`Engine::bands`](super::Engine::bands)).
    pub(crate) fn in_bands(self, shape: &KernelShape) -> Self {
        let most = self.band(shape).unwrap_or(u32::MAX);
        Self { image: (self.image.0, self.image.1.min(most)), ..self }
    }

    /// Fails if the image has more tiles than the kernels can process.
    pub(crate) fn check(&self, shape: &KernelShape) -> Result<()> {
        let (width, height) = self.image;
        let (tiles_x, tiles_y) = shape.tiles(width, height);
        let rounds = (u64::from(tiles_x) + 1) * u64::from(tiles_y);
        let Some(most) = self.most_rounds(shape).filter(|&most| rounds > u64::from(most)) else { return Ok(()) };
        let problem = format!(
            "{width} x {height} px make {tiles_x} x {tiles_y} tiles, at most {most} tiles and rows are supported on \
            this \
             device; choose a smaller size"
        );
        Err(Error::usage(Setting("max_resolution"), problem))
    }

    /// Fails if the image is larger than the buffers.
    pub fn check_image(&self, width: u32, height: u32) -> Result<()> {
        if width <= self.image.0 && height <= self.image.1 {
            return Ok(());
        }
        let problem = format!(
            "the image has {width} x {height} px, but the engine has memory for {} x {} px; call Engine::grow_image \
            first",
            self.image.0, self.image.1
        );
        Err(Error::usage("camera", problem))
    }
}
