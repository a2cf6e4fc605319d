//! Lenses: the image position of a direction.
//!
//! A lens maps a direction to a point of the image plane at focal length 1; [`Optics`] adds focal lengths and principal
//! point. Sources of the formulas: COLMAP's camera models, and the papers cited in each file.
//!
//! To add a lens, add a file with its coefficients and its [`Projection`], a variant of [`Lens`], and its names in
//! `models.rs`.

mod division;
mod equirectangular;
mod eucm;
mod fisheye;
mod fov;
mod models;
mod optics;
mod polynomial;
mod projection;
mod rad_tan;

pub use division::Division;
pub use equirectangular::Equirectangular;
pub use eucm::Eucm;
pub use fisheye::Fisheye;
pub use fov::Fov;
pub use models::{CAMERA_MODELS, CameraModel, colmap_model, model};
pub use optics::Optics;
pub use polynomial::Polynomial;
pub use projection::Projection;
pub use rad_tan::RadTan;

/// The lens of a photo.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Lens {
    /// No distortion.
    #[default]
    Pinhole,
    /// OpenCV's radial and tangential distortion.
    Polynomial(Polynomial),
    /// Angles instead of tangents, with a polynomial.
    Fisheye(Fisheye),
    /// Project Aria's fisheye.
    RadTan(RadTan),
    /// The arc tangent of a single angle.
    Fov(Fov),
    /// The division model.
    Division(Division),
    /// The enhanced unified camera model.
    Eucm(Eucm),
    /// A panorama of all directions.
    Equirectangular,
}

impl Lens {
    /// Returns the projection; `None` for a pinhole.
    pub fn projection(&self) -> Option<&dyn Projection> {
        match self {
            Self::Pinhole => None,
            Self::Polynomial(lens) => Some(lens),
            Self::Fisheye(lens) => Some(lens),
            Self::RadTan(lens) => Some(lens),
            Self::Fov(lens) => Some(lens),
            Self::Division(lens) => Some(lens),
            Self::Eucm(lens) => Some(lens),
            Self::Equirectangular => Some(&Equirectangular),
        }
    }

    /// Returns true for a lens without distortion.
    pub fn is_pinhole(&self) -> bool {
        matches!(self, Self::Pinhole)
    }
}

impl From<Polynomial> for Lens {
    fn from(lens: Polynomial) -> Self {
        if lens == Polynomial::default() { Self::Pinhole } else { Self::Polynomial(lens) }
    }
}
