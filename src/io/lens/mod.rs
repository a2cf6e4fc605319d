//! Lens distortion: the position in the photo of a pixel of the ideal pinhole image.
//!
//! To add a lens, add a file with its coefficients, their parsing and its [`Distortion`], a variant of [`Lens`], and
//! its names in `MODELS`.

mod distortion;
mod polynomial;

pub use distortion::Distortion;
pub use polynomial::Polynomial;

/// The lens of a photo.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Lens {
    /// No distortion.
    #[default]
    Pinhole,
    /// Radial and tangential distortion of OpenCV.
    Polynomial(Polynomial),
}

impl Lens {
    /// Returns the distortion; none for a pinhole.
    pub fn distortion(&self) -> Option<&dyn Distortion> {
        match self {
            Self::Pinhole => None,
            Self::Polynomial(lens) => Some(lens),
        }
    }

    /// Returns true for a lens without distortion.
    pub fn is_pinhole(&self) -> bool {
        self.distortion().is_none()
    }
}

impl From<Polynomial> for Lens {
    fn from(lens: Polynomial) -> Self {
        if lens == Polynomial::default() { Self::Pinhole } else { Self::Polynomial(lens) }
    }
}

/// A camera model as files name it, with its parameters.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CameraModel {
    /// Name in COLMAP.
    pub(crate) name: &'static str,
    /// Number of focal lengths in COLMAP's list: 1, or 2 for x and y. The principal point follows.
    pub(crate) focals: usize,
    /// Number of lens coefficients after them.
    pub(crate) coefficients: usize,
    /// Makes the lens from that list.
    pub(crate) of_list: fn(&[f64]) -> Lens,
    /// Makes the lens from the named coefficients of `transforms.json`, 0 for missing ones; `None` if that format lacks
    /// the model.
    pub(crate) of_names: Option<fn(&dyn Fn(&str) -> f64) -> Lens>,
}

const fn pinhole(name: &'static str, focals: usize) -> CameraModel {
    CameraModel { name, focals, coefficients: 0, of_list: |_| Lens::Pinhole, of_names: Some(|_| Lens::Pinhole) }
}

const fn polynomial(name: &'static str, focals: usize, coefficients: usize) -> CameraModel {
    let of_list = |list: &[f64]| Polynomial::of_list(list).into();
    CameraModel { name, focals, coefficients, of_list, of_names: Some(|value| Polynomial::of_names(value).into()) }
}

/// The camera models that can be undistorted to a pinhole.
pub(crate) const MODELS: [CameraModel; 6] = [
    pinhole("PINHOLE", 2),
    pinhole("SIMPLE_PINHOLE", 1),
    polynomial("SIMPLE_RADIAL", 1, 1),
    polynomial("RADIAL", 1, 2),
    polynomial("OPENCV", 2, 4),
    CameraModel { of_names: None, ..polynomial("FULL_OPENCV", 2, 8) },
];

pub(crate) fn model(name: &str) -> Option<&'static CameraModel> {
    const ALL: &[CameraModel] = &MODELS;
    ALL.iter().find(|model| model.name == name)
}
