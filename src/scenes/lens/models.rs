//! The camera models named in files, with the order of their parameters.

use super::{Division, Equirectangular, Eucm, Fisheye, Fov, Lens, Polynomial, RadTan};

/// A camera model with its parameters.
#[derive(Clone, Copy, Debug)]
pub struct CameraModel {
    /// Name in COLMAP.
    pub name: &'static str,
    /// Number of focal lengths in COLMAP's list: 1, or 2 for x and y, followed by the principal point; 0 if the list
    /// starts with the size of the photo instead.
    pub focals: usize,
    /// Number of lens coefficients after them.
    pub coefficients: usize,
    /// Creates the lens from the coefficients.
    pub from_list: fn(&[f64]) -> Lens,
    /// Creates the lens from the named coefficients of `transforms.json`, 0 for missing ones; `None` if that format
    /// does not have the model.
    pub from_names: Option<fn(&dyn Fn(&str) -> f64) -> Lens>,
}

impl CameraModel {
    /// Returns fx, fy, cx and cy of a list with the right number of parameters. For a panorama, computes them from its
    /// size.
    pub fn intrinsics(&self, list: &[f64]) -> [f64; 4] {
        match self.focals {
            0 => Equirectangular::intrinsics(list[0], list[1]),
            focals => [list[0], list[focals - 1], list[focals], list[focals + 1]],
        }
    }

    /// Returns the number of parameters before the coefficients: focal lengths and principal point, or the size.
    pub fn before(&self) -> usize {
        self.focals + 2
    }
}

const fn pinhole(name: &'static str, focals: usize) -> CameraModel {
    CameraModel { name, focals, coefficients: 0, from_list: |_| Lens::Pinhole, from_names: Some(|_| Lens::Pinhole) }
}

const fn polynomial(name: &'static str, focals: usize, coefficients: usize) -> CameraModel {
    let from_list = |list: &[f64]| Polynomial::from_list(list).into();
    CameraModel {
        name,
        focals,
        coefficients,
        from_list,
        from_names: Some(|value| Polynomial::from_names(value).into()),
    }
}

const fn fisheye(name: &'static str, focals: usize, coefficients: usize) -> CameraModel {
    let from_list = |list: &[f64]| Lens::Fisheye(Fisheye::from_radial(list));
    let from_names: fn(&dyn Fn(&str) -> f64) -> Lens =
        |value| Lens::Fisheye(Fisheye::from_radial(&["k1", "k2", "k3", "k4"].map(value)));
    CameraModel { name, focals, coefficients, from_list, from_names: Some(from_names) }
}

const fn other(name: &'static str, focals: usize, coefficients: usize, from_list: fn(&[f64]) -> Lens) -> CameraModel {
    CameraModel { name, focals, coefficients, from_list, from_names: None }
}

const fn division(name: &'static str, focals: usize) -> CameraModel {
    other(name, focals, 1, |list| if list[0] == 0.0 { Lens::Pinhole } else { Lens::Division(Division { k: list[0] }) })
}

/// COLMAP's camera models; the index is COLMAP's number.
pub const CAMERA_MODELS: [CameraModel; 18] = [
    pinhole("SIMPLE_PINHOLE", 1),
    pinhole("PINHOLE", 2),
    polynomial("SIMPLE_RADIAL", 1, 1),
    polynomial("RADIAL", 1, 2),
    polynomial("OPENCV", 2, 4),
    fisheye("OPENCV_FISHEYE", 2, 4),
    CameraModel { from_names: Some(full), ..polynomial("FULL_OPENCV", 2, 8) },
    other("FOV", 2, 1, |list| Lens::Fov(Fov { angle: list[0] })),
    fisheye("SIMPLE_RADIAL_FISHEYE", 1, 1),
    fisheye("RADIAL_FISHEYE", 1, 2),
    CameraModel {
        from_names: Some(thin_prism),
        ..other("THIN_PRISM_FISHEYE", 2, 8, |list| Lens::Fisheye(Fisheye::from_thin_prism(list)))
    },
    other("RAD_TAN_THIN_PRISM_FISHEYE", 2, 12, |list| Lens::RadTan(RadTan::from_list(list))),
    division("SIMPLE_DIVISION", 1),
    division("DIVISION", 2),
    fisheye("SIMPLE_FISHEYE", 1, 0),
    fisheye("FISHEYE", 2, 0),
    other("EUCM", 2, 2, |list| Lens::Eucm(Eucm { alpha: list[0], beta: list[1] })),
    CameraModel {
        from_names: Some(|_| Lens::Equirectangular),
        ..other("EQUIRECTANGULAR", 0, 0, |_| Lens::Equirectangular)
    },
];

fn full(value: &dyn Fn(&str) -> f64) -> Lens {
    Polynomial::from_list(&["k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"].map(value)).into()
}

fn thin_prism(value: &dyn Fn(&str) -> f64) -> Lens {
    let (radial, tangential) = (["k1", "k2", "k3", "k4"].map(value), ["p1", "p2"].map(value));
    Lens::Fisheye(Fisheye { radial, tangential, prism: ["sx1", "sy1"].map(value), skew: 0.0 })
}

/// Returns the model with a name.
pub fn model(name: &str) -> Option<&'static CameraModel> {
    all().iter().find(|model| model.name == name)
}

/// Returns the model with COLMAP's number.
pub fn colmap_model(number: usize) -> Option<&'static CameraModel> {
    all().get(number)
}

fn all() -> &'static [CameraModel] {
    const ALL: &[CameraModel] = &CAMERA_MODELS;
    ALL
}
