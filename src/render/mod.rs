//! Pictures of a model: colour, alpha, depth, and the main Gaussian of each pixel.

pub(crate) mod pictures;

pub use pictures::{Format, Pictures, What, write_pictures, write_rgb};

use crate::engine::{Engine, ListKey};
use crate::error::{Error, Result};
use crate::scene::{Camera, LabelMap};

/// The near plane of 3DGS, world units: what a model is rendered with of which nothing is known.
pub const NEAR: f32 = crate::shaders::constants::NEAR;

/// What is read back of a picture besides colour and alpha.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Parts {
    /// Depth.
    pub depth: bool,
    /// The main Gaussians and their weights.
    pub main: bool,
}

impl Parts {
    /// Colour and alpha only.
    pub const COLOUR: Self = Self { depth: false, main: false };
    /// The same with depth.
    pub const DEPTH: Self = Self { depth: true, main: false };
    /// The same with the main Gaussians.
    pub const MAIN: Self = Self { depth: false, main: true };
    /// Everything.
    pub const ALL: Self = Self { depth: true, main: true };
}

/// How a picture is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RenderOptions {
    /// Gaussians nearer to the camera plane are not drawn, world units.
    pub near: f32,
    /// Colour behind the scene.
    pub background: [f32; 3],
    /// Degree of the spherical harmonics; none: the model's.
    pub sh_degree: Option<u32>,
    /// What is read back.
    pub parts: Parts,
}

impl Default for RenderOptions {
    fn default() -> Self {
        Self { near: NEAR, background: [0.0; 3], sh_degree: None, parts: Parts::ALL }
    }
}

impl RenderOptions {
    /// Some parts, on black.
    pub fn new(near: f32, parts: Parts) -> Self {
        Self { near, parts, ..Self::default() }
    }

    /// For main Gaussians only, whose colour does not matter.
    pub fn of_labels(near: f32) -> Self {
        Self { sh_degree: Some(0), ..Self::new(near, Parts::MAIN) }
    }
}

/// One rendered view, row-major. What was not asked for is empty.
#[derive(Clone, Debug, PartialEq)]
pub struct Rendered {
    /// Width, px.
    pub width: u32,
    /// Height, px.
    pub height: u32,
    /// Linear colour over the background, not clamped, [H, W, 3].
    pub rgb: Vec<[f32; 3]>,
    /// 1 - final transmittance, [H, W].
    pub alpha: Vec<f32>,
    /// Weighted sum of camera-space z, not normalised, [H, W].
    pub depth: Vec<f32>,
    /// Gaussian with the largest blending weight, -1 where none contributes, [H, W].
    pub top_id: Vec<i32>,
    /// That weight, [H, W].
    pub top_weight: Vec<f32>,
}

impl Rendered {
    /// Label of the main Gaussian of each pixel (LabelGS, inference), 0 where none contributes. An error without
    /// [`Parts::main`].
    pub fn label_map(&self, labels: &[u32]) -> Result<LabelMap> {
        self.check_part(self.top_id.len(), "main Gaussians")?;
        let id = |&top: &i32| usize::try_from(top).map_or(0, |index| labels[index] as u16);
        Ok(LabelMap { width: self.width, height: self.height, ids: self.top_id.iter().map(id).collect() })
    }

    /// Depth divided by alpha; 0 where alpha is below one half. An error without [`Parts::depth`].
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

/// Renders the engine's model; grows buffers as needed. The camera's image must fit the engine's
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
