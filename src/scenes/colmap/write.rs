//! Writes a reconstruction as COLMAP text files, without tracks.

use glam::DQuat;
use labelgs_files::atomic;
use labelgs_scene::{Camera, Error, Point, Result};
use std::fmt::Write;
use std::path::Path;

/// Writes `cameras.txt`, `images.txt` and `points3D.txt` to a folder. Each view gets its own pinhole camera.
pub fn model(folder: &Path, views: &[(&str, &Camera)], points: &[Point]) -> Result<()> {
    std::fs::create_dir_all(folder).map_err(Error::write(folder))?;
    let (mut cameras, mut images, mut cloud) = (String::new(), String::new(), String::new());
    for (index, (name, camera)) in views.iter().enumerate() {
        let (id, q, t) = (index + 1, DQuat::from_mat3(&camera.rotation), camera.translation);
        let Camera { width, height, fx, fy, cx, cy, .. } = camera;
        // Writing to a string cannot fail. The second line of an image is the list of its points.
        let _ = writeln!(cameras, "{id} PINHOLE {width} {height} {fx} {fy} {cx} {cy}");
        let _ = writeln!(images, "{id} {} {} {} {} {} {} {} {id} {name}\n", q.w, q.x, q.y, q.z, t.x, t.y, t.z);
    }
    for (index, point) in points.iter().enumerate() {
        let (p, [r, g, b]) = (point.position, point.colour);
        let _ = writeln!(cloud, "{} {} {} {} {r} {g} {b} 0", index + 1, p.x, p.y, p.z);
    }
    for (name, text) in [("cameras.txt", cameras), ("images.txt", images), ("points3D.txt", cloud)] {
        atomic::write(folder.join(name), |out| out.write_all(text.as_bytes()))?;
    }
    Ok(())
}
