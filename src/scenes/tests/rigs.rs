//! Small scenes in memory: cameras around a position, photos by a rule.

use glam::{DMat3, DVec3};
use labelgs_scene::{Camera, Dataset, Photo, Point, View};

pub fn point(x: f64, y: f64, z: f64) -> Point {
    Point { position: DVec3::new(x, y, z), colour: [255, 0, 51] }
}

/// A camera at `centre` that looks at `target`.
pub fn looking(centre: DVec3, target: DVec3) -> Camera {
    let forward = (target - centre).normalize();
    let right = forward.cross(DVec3::Y).normalize();
    let rotation = DMat3::from_cols(right, forward.cross(right), forward).transpose();
    Camera {
        rotation,
        translation: -(rotation * centre),
        fx: 60.0,
        fy: 60.0,
        cx: 32.0,
        cy: 24.0,
        width: 64,
        height: 48,
    }
}

pub fn dataset(cameras: impl IntoIterator<Item = Camera>, shade: impl Fn(&Camera, DVec3) -> [u8; 3]) -> Dataset {
    let view = |(index, camera): (usize, Camera)| {
        let ray = |x: u32, y: u32| {
            let (x, y) = (f64::from(x) + 0.5, f64::from(y) + 0.5);
            let ray = DVec3::new((x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy, 1.0);
            (camera.rotation.transpose() * ray).normalize()
        };
        let texel = |x, y| {
            let [r, g, b] = shade(&camera, ray(x, y));
            [r, g, b, 255]
        };
        let rgba =
            (0..camera.height).flat_map(|y| (0..camera.width).map(move |x| (x, y))).map(|(x, y)| texel(x, y)).collect();
        let photo = Some(Photo { width: camera.width, height: camera.height, rgba });
        View { name: format!("{index:02}"), camera, photo: photo.map(Into::into), mask: None }
    };
    Dataset { train: cameras.into_iter().enumerate().map(view).collect(), ..Dataset::default() }
}

pub fn ring(count: usize) -> impl Iterator<Item = Camera> {
    (0..count).map(move |index| {
        let angle = std::f64::consts::TAU * index as f64 / count as f64;
        let height = if index % 2 == 0 { 1.0 } else { -0.5 };
        looking(DVec3::new(1.0 + 4.0 * angle.cos(), height, 4.0 * angle.sin()), DVec3::new(1.0, 0.0, 0.0))
    })
}
