//! Converts a camera to shader uniforms.

use crate::pass::KernelShape;
use crate::scene::Camera;
use crate::shaders::constants::exact::JACOBIAN_MARGIN;
use crate::shaders::structs::StepUniforms;
use bytemuck::Zeroable;
use glam::DVec3;

/// Returns a part's uniforms with the slope limits of the whole picture, so that parts fit together.
pub(crate) fn with_slopes_of(part: StepUniforms, whole: &StepUniforms) -> StepUniforms {
    let &StepUniforms { clamp_y_min, clamp_y_max, .. } = whole;
    StepUniforms { clamp_y_min, clamp_y_max, ..part }
}

/// Returns the camera's part of the uniforms; all other fields are 0. Positions on the device are relative to `origin`.
pub(crate) fn view_uniforms(
    camera: &Camera,
    origin: DVec3,
    shape: &KernelShape,
    near: f32,
    background: [f32; 3],
    count: u32,
) -> StepUniforms {
    let (width, height) = (f64::from(camera.width), f64::from(camera.height));
    let (margin_x, margin_y) = (JACOBIAN_MARGIN * 0.5 * width / camera.fx, JACOBIAN_MARGIN * 0.5 * height / camera.fy);
    let (tiles_x, tiles_y) = shape.tiles(camera.width, camera.height);
    let row = |index| camera.rotation.row(index).as_vec3().to_array();
    StepUniforms {
        view_row0: row(0),
        view_row1: row(1),
        view_row2: row(2),
        camera_centre: camera.relative_to(origin).centre().as_vec3().to_array(),
        fx: camera.fx as f32,
        fy: camera.fy as f32,
        cx: camera.cx as f32,
        cy: camera.cy as f32,
        clamp_x_min: (-camera.cx / camera.fx - margin_x) as f32,
        clamp_x_max: ((width - camera.cx) / camera.fx + margin_x) as f32,
        clamp_y_min: (-camera.cy / camera.fy - margin_y) as f32,
        clamp_y_max: ((height - camera.cy) / camera.fy + margin_y) as f32,
        near,
        width: camera.width,
        height: camera.height,
        tiles_x,
        tile_count: tiles_x * tiles_y,
        gaussian_count: count,
        background,
        ..StepUniforms::zeroed()
    }
}
