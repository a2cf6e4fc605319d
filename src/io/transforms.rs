//! `transforms.json` in the styles of Blender, instant-ngp and nerfstudio.
//!
//! Poses are camera-to-world with OpenGL axes (y up, looking along -z) and become camera-from-world with OpenCV axes.
//! The world is that of `transform_matrix`, which already includes nerfstudio's `applied_transform`.

use super::lens::{self, Equirectangular, Lens};
use super::listed_path::Place;
use super::listing::{FAR, Listed, Listing, check_camera, invert_pose, rotation_of, side, with_extension};
use super::{image, ply};
use crate::error::{Error, Result};
use crate::io::read;
use crate::scene::{Camera, Point};
use glam::{DAffine3, DMat3, DVec3};
use serde::Deserialize;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

const EXPECTED: &str = "expected an object with \"frames\", each with \"file_path\" and \"transform_matrix\", as Blender, \
                        instant-ngp and nerfstudio write it";

/// Intrinsics of the whole file or of one frame.
#[derive(Clone, Debug, Default, Deserialize)]
struct Intrinsics {
    camera_angle_x: Option<f64>,
    camera_angle_y: Option<f64>,
    fl_x: Option<f64>,
    fl_y: Option<f64>,
    cx: Option<f64>,
    cy: Option<f64>,
    w: Option<f64>,
    h: Option<f64>,
    k1: Option<f64>,
    k2: Option<f64>,
    k3: Option<f64>,
    k4: Option<f64>,
    p1: Option<f64>,
    p2: Option<f64>,
    sx1: Option<f64>,
    sy1: Option<f64>,
    /// k1, k2, k3, k4, p1 and p2, which nerfstudio reads before those of their names.
    distortion_params: Option<Vec<f64>>,
    camera_model: Option<String>,
    is_fisheye: Option<bool>,
}

impl Intrinsics {
    /// Returns the values of the frame, completed by those of the file.
    fn or(&self, file: &Self) -> Self {
        macro_rules! merged {
            ($($field:ident)*) => { Self { $($field: self.$field.clone().or(file.$field.clone())),* } };
        }
        merged!(camera_angle_x camera_angle_y fl_x fl_y cx cy w h k1 k2 k3 k4 p1 p2 sx1 sy1 distortion_params
            camera_model is_fisheye)
    }
}

#[derive(Debug, Deserialize)]
struct Frame {
    file_path: String,
    transform_matrix: Vec<Vec<f64>>,
    mask_path: Option<String>,
    #[serde(flatten)]
    intrinsics: Intrinsics,
}

#[derive(Debug, Deserialize)]
#[serde(expecting = "an object")]
struct Transforms {
    frames: Vec<Frame>,
    ply_file_path: Option<String>,
    applied_transform: Option<Vec<Vec<f64>>>,
    #[serde(flatten)]
    intrinsics: Intrinsics,
}

/// Reads the scene, if it has transforms: `transforms_train.json` and `transforms_test.json` with their split, else
/// `transforms.json`, else `transforms_train.json` alone.
pub(crate) fn list(scene: &Place) -> Result<Option<Listing>> {
    let file = |name: &str| Some(scene.root.join(name)).filter(|path| path.is_file());
    let (train, test) = (file("transforms_train.json"), file("transforms_test.json"));
    let files = match (train, test, file("transforms.json")) {
        (Some(train), Some(test), _) => vec![(train, Some(false)), (test, Some(true))],
        (_, _, Some(all)) => vec![(all, None)],
        (Some(train), None, None) => vec![(train, None)],
        _ => return Ok(None),
    };
    let mut listing = Listing { source: files[0].0.clone(), ..Listing::default() };
    for (path, test) in files {
        read(scene, &path, test, &mut listing)?;
    }
    strip_folder(&mut listing);
    Ok(Some(listing))
}

pub(crate) fn list_file(scene: &Place, path: &Path) -> Result<Listing> {
    let mut listing = Listing { source: path.to_owned(), ..Listing::default() };
    read(scene, path, None, &mut listing)?;
    strip_folder(&mut listing);
    Ok(listing)
}

fn read(scene: &Place, path: &Path, test: Option<bool>, listing: &mut Listing) -> Result<()> {
    let transforms: Transforms = read::json(path, EXPECTED)?;
    let mut seen: HashMap<String, Option<PathBuf>> = HashMap::new();
    let mut repeated = 0;
    let first = listing.views.len();
    for (index, frame) in transforms.frames.iter().enumerate() {
        let place = format!("frame {index} (`{}`)", frame.file_path);
        let view = match listed(scene, path, &place, frame, &transforms.intrinsics)? {
            Found::View(view) => *view,
            Found::Nothing => {
                listing.missing.push(frame.file_path.clone());
                continue;
            }
            Found::Bad(error) => {
                listing.bad.push(error);
                continue;
            }
        };
        match seen.get(&view.name) {
            None => {
                seen.insert(view.name.clone(), view.photo.clone());
                listing.views.push(Listed { test, ..view });
            }
            Some(photo) if *photo == view.photo => repeated += 1,
            Some(_) => {
                let problem = format!("another photo is called `{}` too; rename one of them", view.name);
                return Err(Error::data(path, place, problem));
            }
        }
    }
    if repeated > 0 {
        listing
            .notes
            .push(format!("{repeated} frames of {} list a photo a second time and are skipped", path.display()));
    }
    if transforms.frames.iter().any(|frame| frame.mask_path.is_some()) {
        listing.notes.push("`mask_path` of the frames is not used; id masks come from a folder of masks".into());
    }
    if let Some(name) = &transforms.ply_file_path {
        let points = scene.root.join(scene.resolve(path, name)?.path);
        if points.is_file() {
            let read = ply::read_points(&points)?;
            let applied = transforms.applied_transform.as_deref();
            let (views, notes) = (&listing.views[first..], &mut listing.notes);
            listing.points.extend(in_the_frame_of(views, read, path, applied, notes)?);
        } else {
            listing.notes.push(format!("ply_file_path names {}, which does not exist", points.display()));
        }
    }
    Ok(())
}

/// The result for a frame.
enum Found {
    View(Box<Listed>),
    /// The photo does not exist, and its size is unknown.
    Nothing,
    /// The photo exists and gives no size.
    Bad(Error),
}

/// Makes the view of a frame.
fn listed(scene: &Place, path: &Path, place: &str, frame: &Frame, file: &Intrinsics) -> Result<Found> {
    let resolved = scene.resolve(path, &frame.file_path)?;
    let photo = scene.photos.find(&[".", "images"], &resolved.path);
    let intrinsics = frame.intrinsics.or(file);
    let lens = lens(path, place, &intrinsics)?;
    let size = match (intrinsics.w, intrinsics.h, &photo) {
        (Some(w), Some(h), _) => (side(path, place, w)?, side(path, place, h)?),
        (_, _, Some(photo)) => match image::photo_size(photo) {
            Ok(size) => size,
            Err(error) => return Ok(Found::Bad(error)),
        },
        _ => return Ok(Found::Nothing),
    };
    let (rotation, translation) = pose(path, place, &frame.transform_matrix)?;
    let mut camera = match lens {
        Lens::Equirectangular => panorama(size),
        _ => camera(path, place, &intrinsics, size)?,
    };
    (camera.rotation, camera.translation) = (rotation, translation);
    check_camera(path, place, &camera, &lens)?;
    let name = with_extension(resolved.name, photo.as_deref());
    Ok(Found::View(Box::new(Listed { name, photo, camera, lens, test: None })))
}

fn lens(path: &Path, place: &str, i: &Intrinsics) -> Result<Lens> {
    let named = match (i.is_fisheye, i.camera_model.as_deref()) {
        // instant-ngp's flag.
        (Some(true), None) => "OPENCV_FISHEYE",
        (Some(true), Some(other)) if !other.contains("FISHEYE") => {
            let problem = format!("camera_model is {other} and is_fisheye true; remove the one that is wrong");
            return Err(Error::data(path, place, problem));
        }
        (_, Some("PERSPECTIVE")) => "PINHOLE",
        (_, named) => named.unwrap_or("OPENCV"),
    };
    let Some(of_names) = lens::model(named).and_then(|model| model.of_names) else {
        let known = lens::MODELS.iter().filter(|model| model.of_names.is_some()).map(|model| model.name);
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
    Ok(of_names(&|name| all.iter().find(|known| known.0 == name).and_then(|known| known.1).unwrap_or(0.0)))
}

/// Makes the intrinsics of a panorama, which follow from its size.
fn panorama((width, height): (u32, u32)) -> Camera {
    let [fx, fy, cx, cy] = Equirectangular::intrinsics(f64::from(width), f64::from(height));
    Camera { rotation: DMat3::IDENTITY, translation: DVec3::ZERO, fx, fy, cx, cy, width, height }
}

/// Makes the intrinsics, at an identity pose. Focal lengths come from `fl_x`, `fl_y` or the fields of view; a missing
/// one equals the other. The default principal point is the image centre.
fn camera(path: &Path, place: &str, i: &Intrinsics, (width, height): (u32, u32)) -> Result<Camera> {
    let (w, h) = (f64::from(width), f64::from(height));
    // The tangent is periodic: degrees, for example, would pass as some angle in radians.
    for (name, angle) in [("camera_angle_x", i.camera_angle_x), ("camera_angle_y", i.camera_angle_y)] {
        if let Some(angle) = angle.filter(|angle| !(*angle > 0.0 && *angle < std::f64::consts::PI)) {
            let problem = format!("{name} is {angle}, which gives no focal length; expected radians between 0 and pi");
            return Err(Error::data(path, place, problem));
        }
    }
    let from_angle = |side: f64, angle: f64| side / 2.0 / (angle / 2.0).tan();
    let fx = i.fl_x.or(i.camera_angle_x.map(|angle| from_angle(w, angle)));
    // If only fl_x is given, fy equals it. An angle counts only if its side has no length.
    let fy = i.fl_y.or(if i.fl_x.is_none() { i.camera_angle_y.map(|angle| from_angle(h, angle)) } else { None });
    let (fx, fy) = match (fx, fy) {
        (Some(fx), Some(fy)) => (fx, fy),
        (Some(f), None) | (None, Some(f)) => (f, f),
        (None, None) => {
            let problem = "no focal length: neither `fl_x` nor `camera_angle_x` is given";
            return Err(Error::data(path, place, problem));
        }
    };
    let (cx, cy) = (i.cx.unwrap_or(w / 2.0), i.cy.unwrap_or(h / 2.0));
    Ok(Camera { rotation: DMat3::IDENTITY, translation: DVec3::ZERO, fx, fy, cx, cy, width, height })
}

/// Converts the rows of a 3x4 or 4x4 matrix.
pub(crate) fn affine(rows: &[Vec<f64>]) -> Option<DAffine3> {
    if !(3..=4).contains(&rows.len()) || rows.iter().any(|row| row.len() != 4 || row.iter().any(|v| !v.is_finite())) {
        return None;
    }
    let column = |index: usize| DVec3::new(rows[0][index], rows[1][index], rows[2][index]);
    Some(DAffine3 { matrix3: DMat3::from_cols(column(0), column(1), column(2)), translation: column(3) })
}

fn pose(path: &Path, place: &str, rows: &[Vec<f64>]) -> Result<(DMat3, DVec3)> {
    let problem = "transform_matrix is not a camera-to-world pose: 4 x 4 numbers, the upper left 3 x 3 a rotation";
    let refuse = || Error::data(path, place, problem);
    let matrix = affine(rows).ok_or_else(refuse)?;
    let rotation = rotation_of(matrix.matrix3).ok_or_else(refuse)?;
    // OpenGL looks along -z with y up, OpenCV along z with y down.
    let rotation = rotation * DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0));
    Ok(invert_pose(rotation, matrix.translation))
}

/// Returns the points in the world of the poses. nerfstudio writes them there, but its early versions wrote them before
/// `applied_transform`. The variant in which the cameras see more points is right.
fn in_the_frame_of(
    views: &[Listed],
    points: Vec<Point>,
    path: &Path,
    applied: Option<&[Vec<f64>]>,
    notes: &mut Vec<String>,
) -> Result<Vec<Point>> {
    let Some(rows) = applied else { return Ok(points) };
    let Some(matrix) = affine(rows) else {
        return Err(Error::data(path, "applied_transform", "is not a 3 x 4 or 4 x 4 matrix of numbers"));
    };
    let moved = points.iter().map(|p| Point { position: matrix.transform_point3(p.position), ..*p });
    let moved: Vec<Point> = moved.collect();
    if !moved.iter().all(|point| point.position.abs().max_element() <= FAR) {
        let problem = format!("moves points beyond {FAR:e}; expected a rotation and a moderate scale");
        return Err(Error::data(path, "applied_transform", problem));
    }
    if seen(views, &moved) as f64 > 1.2 * seen(views, &points) as f64 {
        notes.push("applied_transform was applied to the points, because they fit the cameras better with it".into());
        return Ok(moved);
    }
    Ok(points)
}

/// Counts the points in the views, over samples of both.
fn seen(views: &[Listed], points: &[Point]) -> usize {
    let some_views: Vec<&Camera> = views.iter().step_by(views.len() / 50 + 1).map(|view| &view.camera).collect();
    let some_points = points.iter().step_by(points.len() / 2000 + 1);
    let inside = |camera: &&&Camera, point: &Point| {
        let at = camera.to_camera(point.position);
        let pixel = camera.project(at);
        at.z > 0.0
            && (0.0..f64::from(camera.width)).contains(&pixel.x)
            && (0.0..f64::from(camera.height)).contains(&pixel.y)
    };
    some_points.map(|point| some_views.iter().filter(|camera| inside(camera, point)).count()).sum()
}

/// Removes a leading `images/` if all names have it, so that names are the same as in a COLMAP scene.
fn strip_folder(listing: &mut Listing) {
    let stripped = listing.views.iter().map(|view| view.name.strip_prefix("images/").map(str::to_owned));
    if let Some(names) = stripped.collect::<Option<Vec<String>>>() {
        listing.views.iter_mut().zip(names).for_each(|(view, name)| view.name = name);
    }
}
