//! Lenses of a synthetic scene's cameras.

use super::SynthOptions;
use labelgs_scene::{Camera, Error, Result, Setting};
use labelgs_scenes::lens::{self, CAMERA_MODELS, CameraModel, Lens, Optics};
use std::fmt::{self, Display};
use std::str::FromStr;

/// Typical lens coefficients for each of COLMAP's camera models, in COLMAP's order.
const LENS_COEFFICIENTS: [&[f64]; CAMERA_MODELS.len()] = [
    &[],
    &[],
    &[-0.08],
    &[-0.1, 0.02],
    &[-0.12, 0.03, 0.001, -0.0015],
    &[0.03, -0.01, 0.002, -0.0005],
    &[0.1, 0.02, 0.001, -0.001, 0.002, 0.2, 0.03, 0.004],
    &[0.9],
    &[-0.02],
    &[-0.02, 0.003],
    &[0.02, -0.01, 0.001, -0.0015, 0.002, -0.0004, 0.001, -0.001],
    &[0.02, -0.01, 0.003, -0.001, 0.0003, -0.00005, 0.001, -0.0008, 0.0005, -0.0003, 0.0004, -0.0002],
    &[-0.15],
    &[-0.15],
    &[],
    &[],
    &[0.6, 1.1],
    &[],
];

/// The lens of all cameras: one of COLMAP's camera models, by number, with typical coefficients.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SynthLens(usize);

impl Default for SynthLens {
    fn default() -> Self {
        Self::PINHOLE
    }
}

impl FromStr for SynthLens {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        let known =
            || format!("is not a camera model; expected one of {}", CAMERA_MODELS.map(|model| model.name).join(", "));
        CAMERA_MODELS.iter().position(|model| model.name == name).map(Self).ok_or_else(known)
    }
}

impl Display for SynthLens {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        to.write_str(self.model().name)
    }
}

impl SynthLens {
    /// Without distortion.
    pub const PINHOLE: Self = Self(1);

    /// Returns all lenses.
    pub fn all() -> impl Iterator<Item = Self> {
        (0..CAMERA_MODELS.len()).map(Self)
    }

    /// Returns COLMAP's number of the camera model.
    pub(super) fn number(self) -> u32 {
        self.0 as u32
    }

    fn model(self) -> &'static CameraModel {
        lens::colmap_model(self.0).unwrap_or(&CAMERA_MODELS[0])
    }

    fn lens(self) -> Lens {
        (self.model().from_list)(LENS_COEFFICIENTS[self.0])
    }

    /// Returns COLMAP's parameters for a camera with this lens.
    pub(super) fn parameters(self, camera: &Camera) -> Vec<f64> {
        let Camera { fx, fy, cx, cy, width, height, .. } = *camera;
        let first = match self.model().focals {
            0 => vec![f64::from(width), f64::from(height)],
            1 => vec![fx, cx, cy],
            _ => vec![fx, fy, cx, cy],
        };
        [&first, LENS_COEFFICIENTS[self.0]].concat()
    }
}

/// Mounts the lens on a pinhole camera. The image is as wide as the camera's, or as the requested field of view; a
/// panorama shows everything.
pub(super) fn mounted(options: &SynthOptions, camera: &Camera) -> Optics {
    let lens = options.lens.lens();
    let half = match options.fov {
        Some(degrees) => f64::from(degrees).to_radians() / 2.0,
        None => (camera.cx / camera.fx).atan(),
    };
    let mut camera = camera.clone();
    if lens == Lens::Equirectangular {
        let size = [f64::from(camera.width), f64::from(camera.height)];
        [camera.fx, camera.fy, camera.cx, camera.cy] = options.lens.model().intrinsics(&size);
    } else if let Some(projection) = lens.projection() {
        camera.fx = camera.cx / projection.radius(half);
        camera.fy = camera.fx;
    } else if options.fov.is_some() {
        camera.fx = camera.cx / half.tan();
        camera.fy = camera.fx;
    }
    Optics::new(camera, lens)
}

/// Refuses a field of view that the lens does not support.
pub(super) fn check(options: &SynthOptions) -> Result<()> {
    let lens = options.lens.lens();
    let Some(degrees) = options.fov.filter(|_| lens != Lens::Equirectangular) else { return Ok(()) };
    let reach = lens.projection().map_or(80.0, |lens| lens.reach().to_degrees());
    if degrees == 0 || f64::from(degrees) >= 2.0 * reach {
        let problem = format!("{degrees} degrees; {} shows 1 to {:.0}", options.lens, 2.0 * reach - 1.0);
        return Err(Error::usage(Setting("fov"), problem));
    }
    Ok(())
}
