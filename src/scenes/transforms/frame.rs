//! Converts a frame to a view: photo, lens, intrinsics, pose.

use super::file::{Frame, Intrinsics};
use crate::lens::{self, Equirectangular, Lens};
use crate::listing::{ListedPhoto, check_camera, invert_pose, rotation_of, side, with_extension};
use glam::{DAffine3, DMat3, DVec3};
use labelgs_files::image;
use labelgs_scene::{Camera, Error, Result};
use std::path::{Path, PathBuf};

/// Creates the view of a frame whose photo has `name` below the scene; `None` if the photo does not exist and its size
/// is unknown.
pub(super) fn listed(
    (path, place): (&Path, &str),
    (frame, file): (&Frame, &Intrinsics),
    (name, photo): (String, Option<PathBuf>),
) -> Result<Option<ListedPhoto>> {
    let intrinsics = frame.intrinsics.or(file);
    let lens = lens(path, place, &intrinsics)?;
    let size = match (intrinsics.w, intrinsics.h, &photo) {
        (Some(w), Some(h), _) => (side(path, place, w)?, side(path, place, h)?),
        (_, _, Some(photo)) => image::photo_size(photo)?,
        _ => return Ok(None),
    };
    let (rotation, translation) = pose(path, place, frame, &intrinsics)?;
    let mut camera = match lens {
        Lens::Equirectangular => {
            Camera::at_origin(Equirectangular::intrinsics(f64::from(size.0), f64::from(size.1)), size)
        }
        _ => camera(path, place, &intrinsics, size)?,
    };
    (camera.rotation, camera.translation) = (rotation, translation);
    check_camera(path, place, &camera, &lens)?;
    let name = with_extension(name, photo.as_deref());
    Ok(Some(ListedPhoto { name, photo, camera, lens, test: None }))
}

fn lens(path: &Path, place: &str, i: &Intrinsics) -> Result<Lens> {
    let named = match (i.is_fisheye, i.camera_model.as_deref()) {
        // instant-ngp's flag.
        (Some(true), None) => "OPENCV_FISHEYE",
        (Some(true), Some(other)) if !other.contains("FISHEYE") => {
            let problem = format!("camera_model is {other}, but is_fisheye is true; remove the wrong one");
            return Err(Error::data(path, place, problem));
        }
        (_, Some("PERSPECTIVE")) => "PINHOLE",
        (_, None) if i.latlong == Some(true) => "EQUIRECTANGULAR",
        (_, None) if i.ftheta_p0.is_some_and(|value| value != 0.0) => "ftheta",
        // Only OpenCV's full model has these two coefficients.
        (_, None | Some("OPENCV")) if [i.k5, i.k6].iter().flatten().any(|&value| value != 0.0) => "FULL_OPENCV",
        (_, named) => named.unwrap_or("OPENCV"),
    };
    let Some(from_names) = lens::model(named).and_then(|model| model.from_names) else {
        let known = lens::CAMERA_MODELS.iter().filter(|model| model.from_names.is_some()).map(|model| model.name);
        let problem = format!(
            "camera model {named} is not supported (supported: {}); undistort the photos first, or pose them with COLMAP",
            known.collect::<Vec<_>>().join(", ")
        );
        return Err(Error::data(path, place, problem));
    };
    let mut all = [
        ("k1", i.k1),
        ("k2", i.k2),
        ("k3", i.k3),
        ("k4", i.k4),
        ("p1", i.p1),
        ("p2", i.p2),
        ("k5", i.k5),
        ("k6", i.k6),
        ("sx1", i.sx1),
        ("sy1", i.sy1),
    ];
    if let Some(listed) = &i.distortion_params {
        if listed.len() != 6 {
            let problem = format!("distortion_params has {} numbers; expected k1, k2, k3, k4, p1, p2", listed.len());
            return Err(Error::data(path, place, problem));
        }
        all.iter_mut().zip(listed).for_each(|(known, &value)| known.1 = Some(value));
    }
    Ok(from_names(&|name| all.iter().find(|known| known.0 == name).and_then(|known| known.1).unwrap_or(0.0)))
}

/// Creates the intrinsics, at an identity pose. Focal lengths come from `fl_x`, `fl_y` or the fields of view; a missing
/// one equals the other. The default principal point is the image centre.
fn camera(path: &Path, place: &str, i: &Intrinsics, size: (u32, u32)) -> Result<Camera> {
    let (w, h) = (f64::from(size.0), f64::from(size.1));
    // The tangent is periodic: degrees, for example, would be accepted as an angle in radians.
    for (name, angle) in [("camera_angle_x", i.camera_angle_x), ("camera_angle_y", i.camera_angle_y)] {
        if let Some(angle) = angle.filter(|angle| !(*angle > 0.0 && *angle < std::f64::consts::PI)) {
            let problem = format!("{name} is {angle} and gives no focal length; expected radians between 0 and pi");
            return Err(Error::data(path, place, problem));
        }
    }
    let from_angle = |side: f64, angle: f64| side / 2.0 / (angle / 2.0).tan();
    let fx = i.fl_x.or(i.camera_angle_x.map(|angle| from_angle(w, angle)));
    // If only fl_x is given, fy equals it. An angle only counts if its side has no length.
    let fy = i.fl_y.or(if i.fl_x.is_none() { i.camera_angle_y.map(|angle| from_angle(h, angle)) } else { None });
    let (fx, fy) = match (fx, fy) {
        (Some(fx), Some(fy)) => (fx, fy),
        (Some(f), None) | (None, Some(f)) => (f, f),
        (None, None) => {
            let problem = "has no focal length: neither `fl_x` nor `camera_angle_x` is given";
            return Err(Error::data(path, place, problem));
        }
    };
    Ok(Camera::at_origin([fx, fy, i.cx.unwrap_or(w / 2.0), i.cy.unwrap_or(h / 2.0)], size))
}

/// Converts the rows of a 3x4 or 4x4 matrix.
pub fn affine(rows: &[Vec<f64>]) -> Option<DAffine3> {
    if !(3..=4).contains(&rows.len()) || rows.iter().any(|row| row.len() != 4 || row.iter().any(|v| !v.is_finite())) {
        return None;
    }
    let column = |index: usize| DVec3::new(rows[0][index], rows[1][index], rows[2][index]);
    Some(DAffine3 { matrix3: DMat3::from_cols(column(0), column(1), column(2)), translation: column(3) })
}

/// Returns true for a 4 x 4 matrix in column-major order: the position is in the last row.
pub(super) fn is_transposed(rows: &[Vec<Option<f64>>]) -> bool {
    let at = |row: usize, column: usize| rows.get(row).and_then(|row| row.get(column).copied().flatten());
    let is_zero = |value: Option<f64>| value == Some(0.0);
    let has_no_column = (0..3).all(|row| is_zero(at(row, 3))) && at(3, 3) == Some(1.0);
    has_no_column && (0..3).any(|column| at(3, column).is_some_and(|value| value != 0.0))
}

fn pose(path: &Path, place: &str, frame: &Frame, i: &Intrinsics) -> Result<(DMat3, DVec3)> {
    let problem = "transform_matrix is not a camera-to-world pose: 4 x 4 numbers, the upper left 3 x 3 a rotation";
    let refuse = || Error::data(path, place, problem);
    let number = |value: &Option<f64>| value.unwrap_or(f64::NAN);
    let mut rows: Vec<Vec<f64>> = frame.transform_matrix.iter().map(|row| row.iter().map(number).collect()).collect();
    if is_transposed(&frame.transform_matrix) {
        rows = (0..4).map(|column| rows.iter().filter_map(|row| row.get(column).copied()).collect()).collect();
    }
    let matrix = affine(&rows).ok_or_else(refuse)?;
    let rotation = rotation_of(matrix.matrix3).ok_or_else(refuse)?;
    // OpenCV looks along z with y down; OpenGL along -z with y up; Mitsuba along z with y up and x to the left.
    let axes = if i.from_mitsuba == Some(true) { [-1.0, -1.0, 1.0] } else { [1.0, -1.0, -1.0] };
    Ok(invert_pose(rotation * DMat3::from_diagonal(DVec3::from_array(axes)), matrix.translation))
}
