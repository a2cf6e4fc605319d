//! Renders a model: colour, alpha, depth, and the main Gaussian of each pixel.
//!
//! [`render()`] draws the model of an [`Engine`] from a [`Camera`]. [`RenderOptions`] has near plane, background and
//! the [`Parts`] to read back. The result is a [`Rendered`]; [`write_pictures`] writes it as PNG or EXR.

pub(crate) mod pictures;

pub use pictures::{Format, Pictures, What, write_pictures, write_rgb};

use crate::engine::{Engine, ListKey};
use crate::error::{Error, Result};
use crate::scene::{Camera, LabelMap};

/// Default near plane, of 3DGS, world units.
pub const NEAR: f32 = crate::shaders::constants::NEAR;

/// The parts of a render to read back besides colour and alpha.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Parts {
    /// Depth.
    pub depth: bool,
    /// Main Gaussian and its weight.
    pub main: bool,
}

impl Parts {
    /// Colour and alpha only.
    pub const COLOUR: Self = Self { depth: false, main: false };
    /// Colour, alpha and depth.
    pub const DEPTH: Self = Self { depth: true, main: false };
    /// Colour, alpha and main Gaussians.
    pub const MAIN: Self = Self { depth: false, main: true };
    /// Everything.
    pub const ALL: Self = Self { depth: true, main: true };
}

/// The options of a render.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RenderOptions {
    /// Near plane, world units: nearer Gaussians are not drawn.
    pub near: f32,
    /// Colour behind the scene, r, g, b, 0 to 1.
    pub background: [f32; 3],
    /// Degree of the spherical harmonics; `None`: the degree of the model.
    pub sh_degree: Option<u32>,
    /// Parts to read back.
    pub parts: Parts,
}

impl Default for RenderOptions {
    fn default() -> Self {
        Self { near: NEAR, background: [0.0; 3], sh_degree: None, parts: Parts::ALL }
    }
}

impl RenderOptions {
    /// Makes options for some parts, on black.
    pub fn new(near: f32, parts: Parts) -> Self {
        Self { near, parts, ..Self::default() }
    }

    /// Makes options for main Gaussians only. Their colour does not matter, so the degree is 0.
    pub fn of_labels(near: f32) -> Self {
        Self { sh_degree: Some(0), ..Self::new(near, Parts::MAIN) }
    }
}

/// A rendered view, row-major. Parts that were not requested are empty.
#[derive(Clone, Debug, PartialEq)]
pub struct Rendered {
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
    /// Row of the Gaussian with the largest blending weight, -1 without any, `[H, W]`.
    pub top_id: Vec<i32>,
    /// Blending weight of that Gaussian, `[H, W]`.
    pub top_weight: Vec<f32>,
}

impl Rendered {
    /// Returns the label of the main Gaussian of each pixel (LabelGS, inference), 0 without any. `labels` has one label
    /// per Gaussian. Returns an error without [`Parts::main`].
    pub fn label_map(&self, labels: &[u32]) -> Result<LabelMap> {
        self.check_part(self.top_id.len(), "main Gaussians")?;
        let id = |&top: &i32| usize::try_from(top).map_or(0, |index| labels[index] as u16);
        Ok(LabelMap { width: self.width, height: self.height, ids: self.top_id.iter().map(id).collect() })
    }

    /// Returns depth divided by alpha, world units; 0 where alpha is below one half. Returns an error without
    /// [`Parts::depth`].
    pub fn mean_depth(&self) -> Result<Vec<f32>> {
        self.check_part(self.depth.len(), "depth")?;
        let mean = |(&depth, &alpha): (&f32, &f32)| if alpha >= 0.5 { depth / alpha } else { 0.0 };
        Ok(self.depth.iter().zip(&self.alpha).map(mean).collect())
    }

    fn check_part(&self, there: usize, part: &str) -> Result<()> {
        let is_there = there == self.rgb.len();
        is_there.then_some(()).ok_or_else(|| Error::Bug(format!("the picture was rendered without its {part}")))
    }
}

/// Renders the model in the engine; grows buffers as needed. The image of the camera must fit that of the engine
/// ([`Engine::grow_image`]), and nothing may be in flight.
pub fn render(engine: &mut Engine, camera: &Camera, options: &RenderOptions) -> Result<Rendered> {
    let uniforms = engine.view_uniforms(camera, options.near, options.background);
    engine.run(ListKey::Render(options.sh_degree.unwrap_or(engine.sh_degree())), &uniforms)?;
    let pixels = camera.width as usize * camera.height as usize;
    let Parts { depth, main } = options.parts;
    let image = engine.picture(pixels)?;
    let weight_depth = if depth || main { engine.weights_and_depths(pixels)? } else { Vec::new() };
    let pick = |asked: bool, part: usize| weight_depth.iter().filter(|_| asked).map(|pair| pair[part]).collect();
    Ok(Rendered {
        width: camera.width,
        height: camera.height,
        rgb: image.iter().map(|&[r, g, b, _]| [r, g, b]).collect(),
        alpha: image.iter().map(|pixel| 1.0 - pixel[3]).collect(),
        depth: pick(depth, 1),
        top_id: if main { engine.main_gaussians(pixels)? } else { Vec::new() },
        top_weight: pick(main, 0),
    })
}
