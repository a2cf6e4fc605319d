//! Poses and points that share a frame, outlier poses, other conventions, and points of something else.

use super::fixtures::Scene;
use super::{all, noted};
use glam::{DMat3, DQuat, DVec3};
use image::{Rgb, RgbImage};
use labelgs_scene::{Camera, Dataset, SceneProblem};
use labelgs_scenes::{self as scenes, LoadOptions, Lookup};

const PHOTO_SIZE: u32 = 64;
const VIEW_COUNT: usize = 10;
const POINT_COUNT: usize = 400;

/// Points on a ball, each with a different colour.
fn points() -> Vec<(DVec3, [u8; 3])> {
    (0..POINT_COUNT)
        .map(|index| {
            let height = 1.0 - 2.0 * (index as f64 + 0.5) / POINT_COUNT as f64;
            let (angle, radius) = (index as f64 * 2.4, (1.0 - height * height).sqrt());
            let at = DVec3::new(radius * angle.cos(), radius * angle.sin(), height);
            (at, [0, 1, 2].map(|axis| (127.0 + 120.0 * at[axis]) as u8))
        })
        .collect()
}

/// World-to-camera pose of a view that looks at the ball.
fn pose(view: usize) -> (DMat3, DVec3) {
    let angle = std::f64::consts::TAU * view as f64 / VIEW_COUNT as f64;
    let centre = 4.0 * DVec3::new(angle.cos(), angle.sin(), 0.3);
    let forward = -centre.normalize();
    let right = forward.cross(DVec3::Z).normalize();
    let rotation = DMat3::from_cols(right, forward.cross(right), forward).transpose();
    (rotation, -(rotation * centre))
}

fn camera((rotation, translation): (DMat3, DVec3)) -> Camera {
    let side = f64::from(PHOTO_SIZE);
    Camera {
        rotation,
        translation,
        fx: side,
        fy: side,
        cx: side / 2.0,
        cy: side / 2.0,
        width: PHOTO_SIZE,
        height: PHOTO_SIZE,
    }
}

/// Writes a COLMAP scene of the ball. `stored` changes the written pose of a view.
fn ball(stored: impl Fn(usize, (DMat3, DVec3)) -> (DQuat, DVec3)) -> Scene {
    let scene = Scene::new();
    let side = f64::from(PHOTO_SIZE);
    scene.write(
        "sparse/0/cameras.txt",
        format!("1 PINHOLE {PHOTO_SIZE} {PHOTO_SIZE} {side} {side} {} {}\n", side / 2.0, side / 2.0),
    );
    let mut images = String::new();
    for view in 0..VIEW_COUNT {
        let (q, t) = stored(view, pose(view));
        images += &format!("{} {} {} {} {} {} {} {} 1 {view:02}.png\n\n", view + 1, q.w, q.x, q.y, q.z, t.x, t.y, t.z);
        let seen = camera(pose(view));
        let mut photo = RgbImage::from_pixel(PHOTO_SIZE, PHOTO_SIZE, Rgb([90; 3]));
        let mut near: Vec<(f64, u32, u32, [u8; 3])> = Vec::new();
        for (at, colour) in points() {
            let pixel = seen.sees(at).expect("in the picture");
            near.push((seen.to_camera(at).z, pixel.x as u32, pixel.y as u32, colour));
        }
        near.sort_by(|a, b| b.0.total_cmp(&a.0));
        for (_, x, y, colour) in near {
            for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                photo.put_pixel((x + dx).min(PHOTO_SIZE - 1), (y + dy).min(PHOTO_SIZE - 1), Rgb(colour));
            }
        }
        photo.save(scene.at(&format!("images/{view:02}.png"))).expect("a photo");
    }
    scene.write("sparse/0/images.txt", images);
    let line =
        |(id, (at, [r, g, b])): (usize, (DVec3, [u8; 3]))| format!("{id} {} {} {} {r} {g} {b} 0\n", at.x, at.y, at.z);
    scene.write("sparse/0/points3D.txt", points().into_iter().enumerate().map(line).collect::<String>());
    scene
}

fn as_is(_: usize, (rotation, translation): (DMat3, DVec3)) -> (DQuat, DVec3) {
    (DQuat::from_mat3(&rotation), translation)
}

fn open(scene: &Scene, poses: &str) -> Dataset {
    let lookup = Lookup { poses: poses.parse().expect("words"), ..Lookup::default() };
    scenes::open(scene.path(), &LoadOptions { lookup, ..all() }).expect("a scene")
}

#[test]
fn a_sound_scene_has_nothing_said_of_its_frame() {
    let dataset = open(&ball(as_is), "");
    assert_eq!((dataset.flaws, dataset.notes), (Vec::new(), Vec::new()));
}

#[test]
fn poses_of_another_convention_are_named_and_read_as_they_are_said_to_be() {
    let swap = DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0));
    let gl = |_: usize, (r, t): (DMat3, DVec3)| (DQuat::from_mat3(&(swap * r)), swap * t);
    let c2w = |_: usize, (r, t): (DMat3, DVec3)| (DQuat::from_mat3(&r.transpose()), -(r.transpose() * t));
    let xyzw = |_: usize, (r, t): (DMat3, DVec3)| {
        let q = DQuat::from_mat3(&r);
        (DQuat::from_xyzw(q.y, q.z, q.w, q.x), t)
    };
    type Stored<'a> = &'a dyn Fn(usize, (DMat3, DVec3)) -> (DQuat, DVec3);
    let cases: [(&str, Stored); 3] = [("opengl", &gl), ("c2w", &c2w), ("xyzw", &xyzw)];
    for (words, stored) in cases {
        let scene = ball(stored);
        let dataset = open(&scene, "");
        let [SceneProblem::Frame(text)] = &dataset.flaws[..] else { panic!("{words}: {:?}", dataset.flaws) };
        assert!(text.contains(&format!("`poses = {words}`")), "{words}: {text}");
        let right = open(&scene, words);
        assert_eq!(right.flaws, [], "{words}");
        let (found, expected) = (&right.train[3].camera, pose(3));
        assert!(found.rotation.abs_diff_eq(expected.0, 1e-9), "{words}");
        assert!(found.translation.abs_diff_eq(expected.1, 1e-9), "{words}");
    }
}

#[test]
fn points_of_something_else_are_noticed() {
    let scene = ball(as_is);
    let moved: String = points()
        .iter()
        .enumerate()
        .map(|(id, (at, _))| format!("{id} {} {} {} 9 9 9 0\n", at.x + 500.0, at.y, at.z))
        .collect();
    scene.write("sparse/0/points3D.txt", moved);
    let dataset = open(&scene, "");
    assert!(
        matches!(&dataset.flaws[..], [SceneProblem::Frame(text)] if text.contains("different frames")),
        "{:?}",
        dataset.flaws
    );
    // The right positions with the colours of others.
    let turned: String = points()
        .iter()
        .zip(points().iter().cycle().skip(POINT_COUNT / 3))
        .enumerate()
        .map(|(id, ((at, _), (_, [r, g, b])))| format!("{id} {} {} {} {b} {r} {g} 0\n", at.x, at.y, at.z))
        .collect();
    scene.write("sparse/0/points3D.txt", turned);
    let dataset = open(&scene, "");
    assert_eq!(dataset.flaws, []);
    noted(&dataset.notes, &["may not belong together"]);
}

#[test]
fn a_photo_that_sees_none_of_the_points_is_named() {
    let scene = ball(|view, (r, t)| {
        let turned = if view == 4 { DMat3::from_rotation_y(std::f64::consts::PI) * r } else { r };
        (DQuat::from_mat3(&turned), if view == 4 { DMat3::from_rotation_y(std::f64::consts::PI) * t } else { t })
    });
    let notes = open(&scene, "").notes;
    noted(&notes, &["1 of 10 photos show none of the points", "04.png"]);
}

#[test]
fn one_camera_far_away_moves_nothing() {
    let usual = open(&ball(as_is), "").extent();
    let stray = |distance: f64| {
        move |view: usize, (r, t): (DMat3, DVec3)| {
            (DQuat::from_mat3(&r), if view == 7 { t + DVec3::new(0.0, 0.0, distance) } else { t })
        }
    };
    // A very distant photo is omitted. A nearer one stays, and the extent ignores it.
    for (distance, count) in [(38_000.0, VIEW_COUNT - 1), (60.0, VIEW_COUNT)] {
        let dataset = open(&ball(stray(distance)), "");
        assert_eq!(dataset.train.len(), count, "{distance}");
        let left_out =
            dataset.flaws.iter().any(|flaw| matches!(flaw, SceneProblem::LeftOut(text) if text.contains("07.png")));
        assert_eq!(left_out, count < VIEW_COUNT, "{:?}", dataset.flaws);
        assert!((dataset.extent() / usual - 1.0).abs() < 0.2, "{distance}: {} {usual}", dataset.extent());
    }
}
