//! The first Gaussians of a scene.

use super::rigs::{dataset, looking, point, ring};
use glam::DVec3;
use labelgs_scene::harmonics::SH_C0;
use labelgs_scene::{Camera, Dataset, Error, Point};
use labelgs_scenes::init::add_far_gaussians;
use labelgs_scenes::initial_gaussians;

#[test]
fn gaussians_stand_on_the_points() {
    let mut points: Vec<Point> = (0..20).map(|index| point(f64::from(index * index), 0.0, 0.0)).collect();
    points.extend([point(1000.0, 0.0, 0.0); 6]);
    let scene = Dataset { points, ..Dataset::default() };
    let g = initial_gaussians(&scene, 1, 10).expect("Gaussians");
    assert_eq!((g.len(), g.sh_degree, g.labels.is_none()), (26, 3, true));
    assert_eq!(g.sh_rest, vec![[0.0; 3]; 26 * 15]);
    assert!(g.opacities.iter().all(|&o| (o - (0.1f32 / 0.9).ln()).abs() < 1e-6));
    assert!(g.quats.iter().all(|&q| q == [1.0, 0.0, 0.0, 0.0]));
    assert!((f64::from(g.sh0[0][0]) * SH_C0 + 0.5 - 1.0).abs() < 1e-6);
    assert!((f64::from(g.sh0[0][2]) * SH_C0 + 0.5 - 0.2).abs() < 1e-6);
    // Neighbours of 9 among the squares: 4, 16 and 1 or 0.
    let expected = 0.5 * f64::ln((25.0 + 49.0 + 64.0) / 3.0);
    assert!(g.scales[3].iter().all(|&s| (f64::from(s) - expected).abs() < 1e-6));
    // Coinciding points get the smallest allowed size.
    assert!((f64::from(g.scales[22][0]) - 0.5 * f64::ln(1e-7)).abs() < 1e-5);
}

#[test]
fn many_points_at_one_place_are_fine() {
    let scene = Dataset { points: vec![point(1.0, 2.0, 3.0); 5000], ..Dataset::default() };
    assert_eq!(initial_gaussians(&scene, 1, 10).expect("Gaussians").len(), 5000);
}

#[test]
fn over_a_plain_background_the_visual_hull_remains() {
    // A ball of radius 0.6 around (1, 0, 0), shaded by direction, over black.
    let (centre, radius) = (DVec3::new(1.0, 0.0, 0.0), 0.6);
    let shade = |camera: &Camera, ray: DVec3| {
        let to = centre - camera.centre();
        let along = to.dot(ray);
        let hit = to.length_squared() - along * along < radius * radius;
        if hit { [200, 120, 60] } else { [0; 3] }
    };
    let scene = dataset(ring(16), shade);
    let g = initial_gaussians(&scene, 7, 800).expect("Gaussians");
    assert_eq!(g.len(), 800);
    let distances: Vec<f64> = g.means.iter().map(|m| DVec3::from_array(m.map(f64::from)).distance(centre)).collect();
    assert!(distances.iter().all(|&d| d < 0.95), "{:?}", distances.iter().copied().fold(0.0, f64::max));
    let colour = g.sh0[0].map(|c| (f64::from(c) * SH_C0 + 0.5) * 255.0);
    assert!(colour[0] > colour[1] && colour[1] > colour[2]);
    assert_eq!(g, initial_gaussians(&scene, 7, 800).expect("Gaussians"));
    assert_ne!(g, initial_gaussians(&scene, 8, 800).expect("Gaussians"));
}

#[test]
fn in_a_room_points_are_swept_onto_the_surfaces() {
    // A textured wall at z = 6 in front of cameras in a row.
    let shade = |camera: &Camera, ray: DVec3| {
        let at = camera.centre() + ray * ((6.0 - camera.centre().z) / ray.z);
        let wave = |value: f64| (128.0 + 100.0 * (value * 2.1).sin()) as u8;
        [wave(at.x + 0.3 * at.y), wave(at.y), wave(0.7 * at.x - at.y + 1.0)]
    };
    let cameras = (0..12).map(|index| {
        let centre = DVec3::new(f64::from(index) * 0.4 - 2.2, f64::from(index % 3) * 0.4, 0.0);
        looking(centre, centre + DVec3::Z)
    });
    let g = initial_gaussians(&dataset(cameras, shade), 3, 1000).expect("Gaussians");
    assert_eq!(g.len(), 1000);
    let near = g.means.iter().filter(|mean| (mean[2] - 6.0).abs() < 1.0).count();
    assert!(near > 500, "{near} of 1000 lie near the wall");
}

#[test]
fn unusual_camera_rigs_get_initial_gaussians() {
    let same = vec![looking(DVec3::ZERO, DVec3::Z); 2];
    let outward = (0..8).map(|index| {
        let angle = std::f64::consts::TAU * f64::from(index) / 8.0;
        looking(DVec3::ZERO, DVec3::new(angle.cos(), 0.0, angle.sin()))
    });
    let noise = |_: &Camera, ray: DVec3| [(ray.x * 991.0) as u8, (ray.y * 991.0) as u8, (ray.z * 991.0) as u8];
    for (name, cameras) in [("one", same[..1].to_vec()), ("same", same), ("outward", outward.collect())] {
        let mut scene = dataset(cameras, noise);
        for photos in [true, false] {
            if !photos {
                scene.train.iter_mut().for_each(|view| view.photo = None);
            }
            let g = initial_gaussians(&scene, 3, 500).expect("Gaussians");
            assert_eq!(g.len(), 500, "{name}");
            assert!(g.means.iter().chain(&g.scales).flatten().all(|value| value.is_finite()), "{name}");
        }
    }
    let error = initial_gaussians(&Dataset::default(), 1, 10).expect_err("no views");
    assert!(matches!(error, Error::Data { .. }), "{error}");
}

#[test]
fn no_gaussian_of_a_made_up_point_covers_a_picture() {
    // Few points in a room have distant neighbours, so only the bound keeps them small.
    let scene = dataset(ring(8), |_, direction| [(127.0 + 120.0 * direction.x) as u8, 90, 60]);
    let model = initial_gaussians(&scene, 1, 64).expect("Gaussians");
    let mut bounded = 0;
    for (mean, scale) in model.means.iter().zip(&model.scales) {
        let world = DVec3::from_array(mean.map(f64::from));
        for view in &scene.train {
            let (camera, at) = (&view.camera, view.camera.to_camera(world));
            let pixel = camera.project(at);
            let inside = at.z > 0.0 && (0.0..64.0).contains(&pixel.x) && (0.0..48.0).contains(&pixel.y);
            let size = f64::from(scale[0].exp()) / at.z * camera.fx;
            assert!(!inside || size <= 64.0 * 0.02 * 1.0001, "{size} px at {pixel}");
            bounded += u32::from(inside && size > 64.0 * 0.0199);
        }
    }
    assert!(bounded > 20, "the bound was reached {bounded} times only");
}

/// Cameras on a ring look across a ground with points at a blue sky. Only directions above all points get far
/// Gaussians, in the colour of the sky.
#[test]
fn far_gaussians_stand_where_photos_look_past_the_points() {
    let cameras = (0..12).map(|index| {
        let angle = f64::from(index) * std::f64::consts::TAU / 12.0;
        looking(DVec3::new(3.0 * angle.cos(), 0.5, 3.0 * angle.sin()), DVec3::ZERO)
    });
    let mut scene = dataset(cameras, |_, ray| if ray.y > -0.1 { [30, 60, 200] } else { [90, 80, 40] });
    // Dense enough for a point in each cell of the photos, near and far.
    let grid = |step: f64| {
        (0..40_000).map(move |index| {
            point(step * (f64::from(index % 200) - 99.5), -0.2, step * (f64::from(index / 200) - 99.5))
        })
    };
    scene.points = grid(0.05).chain(grid(0.2)).collect();
    let first = initial_gaussians(&scene, 0, 10).expect("Gaussians");
    let mut model = first.clone();
    add_far_gaussians(&mut model, &scene, 2000).expect("photos");
    let added = model.len() - first.len();
    assert!(added > 20 && model.means[..first.len()] == first.means[..], "{added} far Gaussians");
    model.check().expect("a sound model");
    for row in first.len()..model.len() {
        let place = model.world(row);
        // The ground ends before the horizon.
        assert!(place.y > -0.1 * place.length() && place.length() > 7.0, "{place}");
        let colour = model.sh0[row].map(|value| f64::from(value) * SH_C0 + 0.5);
        assert!((colour[2] - 200.0 / 255.0).abs() < 0.01 && colour[0] < 0.2, "{colour:?}");
    }
    let mut none = first.clone();
    add_far_gaussians(&mut none, &scene, 0).expect("photos");
    assert_eq!(none, first);
}
