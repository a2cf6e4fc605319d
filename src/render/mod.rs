//! Pictures of a model: colour, alpha, depth, and the main Gaussian of each pixel.

pub mod pictures;

use crate::engine::uniforms::view_uniforms;
use crate::engine::{Engine, ListKey};
use crate::error::Result;
use crate::scene::{Camera, LabelMap};
use crate::scheduler::plan::Buf;

/// One rendered view, row-major.
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
    /// Label of the main Gaussian of each pixel (LabelGS, inference), 0 where none contributes.
    pub fn label_map(&self, labels: &[u32]) -> LabelMap {
        let id = |&top: &i32| usize::try_from(top).map_or(0, |index| labels[index] as u16);
        LabelMap { width: self.width, height: self.height, ids: self.top_id.iter().map(id).collect() }
    }

    /// Depth divided by alpha; 0 where alpha is below one half.
    pub fn mean_depth(&self) -> Vec<f32> {
        self.depth
            .iter()
            .zip(&self.alpha)
            .map(|(&depth, &alpha)| if alpha >= 0.5 { depth / alpha } else { 0.0 })
            .collect()
    }
}

/// Renders the engine's model; grows buffers as needed.
pub fn render(
    engine: &mut Engine,
    camera: &Camera,
    near: f32,
    background: [f32; 3],
    sh_degree: u32,
) -> Result<Rendered> {
    loop {
        engine.sched().wait_all()?;
        let uniforms =
            view_uniforms(camera, engine.origin(), engine.shape(), near, background, engine.gaussian_count());
        let list = engine.list(ListKey::Render(sh_degree))?;
        let sched = engine.sched_mut();
        sched.upload(Buf::STEP, 0, 0, &[uniforms])?;
        sched.run(list, 0)?;
        let report = engine.report(0)?;
        if !engine.recover(&report)? {
            break;
        }
    }
    let pixels = (camera.width * camera.height) as usize;
    let sched = engine.sched_mut();
    let image = sched.download::<[f32; 4]>(Buf::IMAGE, 0, 0, pixels)?;
    let main = sched.download::<i32>(Buf::MAIN_GAUSSIAN, 0, 0, pixels)?;
    let weight_depth = sched.download::<[f32; 2]>(Buf::MAIN_WEIGHT_DEPTH, 0, 0, pixels)?;
    Ok(Rendered {
        width: camera.width,
        height: camera.height,
        rgb: image.iter().map(|&[r, g, b, _]| [r, g, b]).collect(),
        alpha: image.iter().map(|pixel| 1.0 - pixel[3]).collect(),
        depth: weight_depth.iter().map(|pair| pair[1]).collect(),
        top_id: main,
        top_weight: weight_depth.iter().map(|pair| pair[0]).collect(),
    })
}
