//! Reads the points of a scene of transforms.

use super::file::Transforms;
use super::frame::affine;
use crate::listed_path::SceneFolder;
use crate::listing::{DISTANCE_MAX, ListedPhoto};
use crate::points;
use labelgs_scene::{Camera, Error, Point, Result};
use std::path::Path;

/// Files in which nerfstudio and trainers store points without naming them in a key.
const UNNAMED_FILES: [&str; 2] = ["sparse_pc.ply", "points3D.ply"];

/// Reads the points that belong to `views`.
pub(super) fn read(
    scene: &SceneFolder,
    path: &Path,
    transforms: &Transforms,
    views: &[ListedPhoto],
    notes: &mut Vec<String>,
) -> Result<Vec<Point>> {
    let points = match &transforms.ply_file_path {
        Some(name) => {
            let points = scene.root.join(scene.resolve(path, name)?.path);
            if !points.is_file() {
                notes.push(format!("ply_file_path names {}, which does not exist", points.display()));
                return Ok(Vec::new());
            }
            points
        }
        None => {
            let mut files = UNNAMED_FILES.iter().map(|name| scene.root.join(name));
            let Some(points) = files.find(|path| path.is_file()) else { return Ok(Vec::new()) };
            notes.push(format!("the points come from {}, which no ply_file_path names", points.display()));
            points
        }
    };
    in_the_frame_of(views, points::read_points(&points)?, path, transforms.applied_transform.as_deref(), notes)
}

/// Returns the points in the world of the poses. Early versions of nerfstudio wrote points before `applied_transform`,
/// later ones in the world. The variant with more points in the cameras' images is right.
fn in_the_frame_of(
    views: &[ListedPhoto],
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
    if !moved.iter().all(|point| point.position.abs().max_element() <= DISTANCE_MAX) {
        let problem = format!("moves points beyond {DISTANCE_MAX:e}; expected a rotation and a moderate scale");
        return Err(Error::data(path, "applied_transform", problem));
    }
    if seen(views, &moved) as f64 > 1.2 * seen(views, &points) as f64 {
        notes.push("applied_transform was applied to the points, because they fit the cameras better with it".into());
        return Ok(moved);
    }
    Ok(points)
}

/// Counts the points inside the views, over samples of both.
fn seen(views: &[ListedPhoto], points: &[Point]) -> usize {
    let some_views: Vec<&Camera> = views.iter().step_by(views.len() / 50 + 1).map(|view| &view.camera).collect();
    let some_points = points.iter().step_by(points.len() / 2000 + 1);
    let count = |point: &Point| some_views.iter().filter(|camera| camera.sees(point.position).is_some()).count();
    some_points.map(count).sum()
}
