//! Renders a model: colour, alpha, depth, label and main Gaussian of each pixel.
//!
//! [`render()`] draws the model of an [`Engine`] from a [`Camera`]. [`RenderOptions`] has near plane, background and
//! the [`Parts`] to read back. The result is a [`Render`]; [`write_pictures`] writes it as PNG or EXR.

pub mod large;
pub mod mesh;
pub(crate) mod pictures;
#[cfg(feature = "viewer")]
pub(crate) mod portrait;

pub use pictures::{Format, PictureKind, write_pictures, write_rgb};

use crate::engine::{Engine, ListKey};
use crate::error::{Error, Result};
use crate::scene::{Camera, LABEL_MAX, LabelMap, UNLABELLED};
use crate::shaders::structs::StepUniforms;

/// Default near plane, world units (3DGS).
pub const NEAR_DEFAULT: f32 = crate::shaders::constants::NEAR;

/// Alpha below which a pixel shows no surface.
const SURFACE_ALPHA_MIN: f32 = 0.5;

/// The parts of a render to read back besides colour and alpha.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Parts {
    /// Depth.
    pub depth: bool,
    /// Main Gaussian and its weight.
    pub main: bool,
    /// Label.
    pub labels: bool,
}

impl Parts {
    /// Colour and alpha only.
    pub const COLOUR: Self = Self { depth: false, main: false, labels: false };
    /// Colour, alpha and depth.
    pub const DEPTH: Self = Self { depth: true, ..Self::COLOUR };
    /// Colour, alpha and main Gaussians.
    pub const MAIN: Self = Self { main: true, ..Self::COLOUR };
    /// Colour, alpha and labels.
    pub const LABELS: Self = Self { labels: true, ..Self::COLOUR };
    /// Everything.
    pub const ALL: Self = Self { depth: true, main: true, labels: true };
}

/// The options of a render.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RenderOptions {
    /// Near plane, world units; closer Gaussians are not drawn.
    pub near: f32,
    /// Colour behind the scene, r, g, b, 0 to 1.
    pub background: [f32; 3],
    /// Degree of the spherical harmonics; `None`: the degree of the model.
    pub sh_degree: Option<u32>,
    /// Parts to read back.
    pub parts: Parts,
    /// Pixels with an opacity below one half have no label, for objects that were trained alone.
    pub clear_labels: bool,
}

/// Opacity below which a pixel is clear.
const CLEAR_OPACITY_MAX: f32 = 0.5;

impl Default for RenderOptions {
    fn default() -> Self {
        Self { near: NEAR_DEFAULT, background: [0.0; 3], sh_degree: None, parts: Parts::ALL, clear_labels: false }
    }
}

impl RenderOptions {
    /// Makes options for some parts, on black.
    pub fn new(near: f32, parts: Parts) -> Self {
        Self { near, parts, ..Self::default() }
    }

    /// Makes options for main Gaussians only. Their colour does not matter, so the degree is 0.
    pub fn for_main(near: f32) -> Self {
        Self { sh_degree: Some(0), ..Self::new(near, Parts::MAIN) }
    }

    /// Makes options for depth only, also at degree 0.
    pub fn for_depth(near: f32) -> Self {
        Self { sh_degree: Some(0), ..Self::new(near, Parts::DEPTH) }
    }
}

/// A rendered view, row-major. Parts that were not requested are empty.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Render {
    /// Width, px.
    pub width: u32,
    /// Height, px.
    pub height: u32,
    /// Linear colour over the background, not clamped, `[H, W, 3]`.
    pub rgb: Vec<[f32; 3]>,
    /// 1 - final transmittance, `[H, W]`.
    pub alpha: Vec<f32>,
    /// Weighted sum of camera-space z, not normalised, world units, `[H, W]`.
    pub depth: Vec<f32>,
    /// Row of the Gaussian with the largest blending weight, -1 if there is none, `[H, W]`.
    pub top_id: Vec<i32>,
    /// Blending weight of that Gaussian, `[H, W]`.
    pub top_weight: Vec<f32>,
    /// Label with the largest sum of blending weights, `[H, W]`; ties go to the smaller. 0 competes like other labels,
    /// and is the label of pixels without a Gaussian.
    pub labels: Vec<u32>,
}

impl Render {
    /// Returns the label of each pixel: the one with the largest sum of blending weights. Returns an error
    /// without [`Parts::labels`], or for a label above [`LABEL_MAX`].
    pub fn label_map(&self) -> Result<LabelMap> {
        self.check_part(self.labels.len(), "labels")?;
        as_mask((self.width, self.height), self.labels.iter().copied())
    }

    /// Returns the label of each pixel's main Gaussian (LabelGS, inference), 0 if there is none. `labels` has one label
    /// per Gaussian. Returns an error without [`Parts::main`], or for a label above [`LABEL_MAX`].
    pub fn main_label_map(&self, labels: &[u32]) -> Result<LabelMap> {
        self.check_part(self.top_id.len(), "main Gaussians")?;
        let id = |&top: &i32| usize::try_from(top).map_or(UNLABELLED, |index| labels[index]);
        as_mask((self.width, self.height), self.top_id.iter().map(id))
    }

    /// Returns depth divided by alpha, world units; 0 where alpha is below one half. Returns an error without
    /// [`Parts::depth`].
    pub fn mean_depth(&self) -> Result<Vec<f32>> {
        self.check_part(self.depth.len(), "depth")?;
        Ok((0..self.depth.len()).map(|pixel| self.depth_at(pixel).unwrap_or(0.0)).collect())
    }

    /// Returns the depth of the surface at a pixel of a picture with [`Parts::depth`], world units; `None` where alpha
    /// is below one half.
    pub(crate) fn depth_at(&self, pixel: usize) -> Option<f32> {
        (self.alpha[pixel] >= SURFACE_ALPHA_MIN).then(|| self.depth[pixel] / self.alpha[pixel])
    }

    /// Appends this picture below another one of the same width, if there is one.
    fn below(self, above: Option<Self>) -> Self {
        let Some(mut whole) = above else { return self };
        whole.height += self.height;
        whole.rgb.extend(self.rgb);
        whole.alpha.extend(self.alpha);
        whole.depth.extend(self.depth);
        whole.top_id.extend(self.top_id);
        whole.top_weight.extend(self.top_weight);
        whole.labels.extend(self.labels);
        whole
    }

    fn check_part(&self, there: usize, part: &str) -> Result<()> {
        let is_there = there == self.rgb.len();
        is_there.then_some(()).ok_or_else(|| Error::Bug(format!("the picture was rendered without its {part}")))
    }
}

/// Renders the model in the engine; grows buffers as needed. The image of the camera must fit that of the engine
/// ([`Engine::grow_image`]), and nothing may be in flight.
pub fn render(engine: &mut Engine, camera: &Camera, options: &RenderOptions) -> Result<Render> {
    let mut whole: Option<Render> = None;
    for band in engine.bands(camera) {
        let uniforms = engine.band_uniforms(camera, band, options.near, options.background);
        whole = Some(render_band(engine, &uniforms, options)?.below(whole));
    }
    whole.ok_or_else(|| Error::usage("camera", "has an image of 0 rows"))
}

/// Draws the rows of the uniforms.
fn render_band(engine: &mut Engine, uniforms: &StepUniforms, options: &RenderOptions) -> Result<Render> {
    let sh_degree = options.sh_degree.unwrap_or(engine.sh_degree());
    let Parts { depth, main, labels } = options.parts;
    let has_labels = engine.size().labels.is_some();
    if labels && has_labels {
        engine.run_labels(|label_rounds| ListKey::Render { sh_degree, label_rounds }, uniforms)?;
    } else {
        engine.run(ListKey::Render { sh_degree, label_rounds: 0 }, uniforms)?;
    }
    let (width, height) = (uniforms.width, uniforms.height);
    let pixels = width as usize * height as usize;
    let image = engine.picture(pixels)?;
    let weight_depth = if depth || main { engine.weights_and_depths(pixels)? } else { Vec::new() };
    let pick = |asked: bool, part: usize| weight_depth.iter().filter(|_| asked).map(|pair| pair[part]).collect();
    let mut rendered = Render {
        width,
        height,
        rgb: image.iter().map(|&[r, g, b, _]| [r, g, b]).collect(),
        alpha: image.iter().map(|pixel| 1.0 - pixel[3]).collect(),
        depth: pick(depth, 1),
        top_id: if main { engine.main_gaussians(pixels)? } else { Vec::new() },
        top_weight: pick(main, 0),
        labels: match (labels, has_labels) {
            (false, _) => Vec::new(),
            (true, true) => engine.label_map(pixels)?,
            (true, false) => vec![UNLABELLED; pixels],
        },
    };
    if options.clear_labels {
        let clear = rendered.labels.iter_mut().zip(&rendered.alpha).filter(|(_, alpha)| **alpha < CLEAR_OPACITY_MAX);
        clear.for_each(|(label, _)| *label = UNLABELLED);
    }
    Ok(rendered)
}

/// Returns labels as a map like those of masks.
fn as_mask((width, height): (u32, u32), labels: impl Iterator<Item = u32>) -> Result<LabelMap> {
    let id = |label| {
        let problem = || {
            format!(
                "the picture shows label {label}, but masks have ids up to {LABEL_MAX}; give the label a smaller id, \
                 or choose labels by id or name"
            )
        };
        u16::try_from(label).map_err(|_| Error::usage("labels", problem()))
    };
    Ok(LabelMap { width, height, ids: labels.map(id).collect::<Result<_>>()? })
}

/// Renders the label map of the engine's model without a picture, in about half the time. Fails for labels above
/// [`LABEL_MAX`]. Labels come from [`Engine::upload_model`] or [`Engine::set_labels`]; without them, all are 0.
pub fn label_map(engine: &mut Engine, camera: &Camera, near: f32) -> Result<LabelMap> {
    let pixels = camera.width as usize * camera.height as usize;
    let mut ids = Vec::with_capacity(pixels);
    if engine.size().labels.is_some() {
        for band in engine.bands(camera) {
            let uniforms = engine.band_uniforms(camera, band, near, [0.0; 3]);
            engine.run_labels(ListKey::LabelMap, &uniforms)?;
            ids.extend(engine.label_map(band.pixels(camera.width).len())?);
        }
    }
    ids.resize(pixels, UNLABELLED);
    as_mask((camera.width, camera.height), ids.into_iter())
}
