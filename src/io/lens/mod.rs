//! Lens distortion: where a pixel of the ideal pinhole image lies in the photo.
//!
//! A lens is a file with its coefficients, how they are read, and how they bend rays ([`Distortion`]); then a kind of
//! [`Lens`], and in [`MODELS`] the names that files have for it.

mod distortion;
mod polynomial;

pub use distortion::Distortion;
pub use polynomial::Polynomial;

/// The lens of a photo.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Lens {
    /// None that would have to be undone.
    #[default]
    Pinhole,
    /// OpenCV's radial and tangential distortion.
    Polynomial(Polynomial),
}

impl Lens {
    /// What it does to rays; nothing for a pinhole.
    pub fn distortion(&self) -> Option<&dyn Distortion> {
        match self {
            Self::Pinhole => None,
            Self::Polynomial(lens) => Some(lens),
        }
    }

    /// True if nothing has to be undone.
    pub fn is_pinhole(&self) -> bool {
        self.distortion().is_none()
    }
}

impl From<Polynomial> for Lens {
    fn from(lens: Polynomial) -> Self {
        if lens == Polynomial::default() { Self::Pinhole } else { Self::Polynomial(lens) }
    }
}

/// A camera model that files name, and its parameters there.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CameraModel {
    /// COLMAP's name.
    pub(crate) name: &'static str,
    /// Focal lengths that COLMAP lists: 1, or 2 for x and y. The principal point follows.
    pub(crate) focals: usize,
    /// Coefficients of the lens that COLMAP lists behind them.
    pub(crate) coefficients: usize,
    /// The lens of that list.
    pub(crate) of_list: fn(&[f64]) -> Lens,
    /// The lens of coefficients by their names in `transforms.json`, 0 for those it lacks; `None` where it has no such
    /// model.
    pub(crate) of_names: Option<fn(&dyn Fn(&str) -> f64) -> Lens>,
}

const fn pinhole(name: &'static str, focals: usize) -> CameraModel {
    CameraModel { name, focals, coefficients: 0, of_list: |_| Lens::Pinhole, of_names: Some(|_| Lens::Pinhole) }
}

const fn polynomial(name: &'static str, focals: usize, coefficients: usize) -> CameraModel {
    let of_list = |list: &[f64]| Polynomial::of_list(list).into();
    CameraModel { name, focals, coefficients, of_list, of_names: Some(|value| Polynomial::of_names(value).into()) }
}

/// The camera models that can be undone to a pinhole.
pub(crate) const MODELS: [CameraModel; 6] = [
    pinhole("PINHOLE", 2),
    pinhole("SIMPLE_PINHOLE", 1),
    polynomial("SIMPLE_RADIAL", 1, 1),
    polynomial("RADIAL", 1, 2),
    polynomial("OPENCV", 2, 4),
    CameraModel { of_names: None, ..polynomial("FULL_OPENCV", 2, 8) },
];

/// The camera model of a name.
pub(crate) fn model(name: &str) -> Option<&'static CameraModel> {
    const ALL: &[CameraModel] = &MODELS;
    ALL.iter().find(|model| model.name == name)
}
