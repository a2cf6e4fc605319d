//! The first Gaussians of a scene.

use glam::{DMat3, DVec3};
use labelgs::cli::support::exit_status::exit_status;
use labelgs::run::{StrategyKind, TrainConfig};
use labelgs::scene::harmonics::SH_C0;
use labelgs::scene::{Camera, Dataset, Photo, Point, View};
use labelgs::scenes::init::add_far_gaussians;
use labelgs::scenes::initial_gaussians;
use labelgs::train::first_model;

fn point(x: f64, y: f64, z: f64) -> Point {
    Point { position: DVec3::new(x, y, z), colour: [255, 0, 51] }
}

/// A camera at `centre` that looks at `target`.
fn looking(centre: DVec3, target: DVec3) -> Camera {
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

fn dataset(cameras: impl IntoIterator<Item = Camera>, shade: impl Fn(&Camera, DVec3) -> [u8; 3]) -> Dataset {
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

fn ring(count: usize) -> impl Iterator<Item = Camera> {
    (0..count).map(move |index| {
        let angle = std::f64::consts::TAU * index as f64 / count as f64;
        let height = if index % 2 == 0 { 1.0 } else { -0.5 };
        looking(DVec3::new(1.0 + 4.0 * angle.cos(), height, 4.0 * angle.sin()), DVec3::new(1.0, 0.0, 0.0))
    })
}

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
    // Points at one place get the smallest allowed size.
    assert!((f64::from(g.scales[22][0]) - 0.5 * f64::ln(1e-7)).abs() < 1e-5);
}

/// Growth chooses the places of most Gaussians; relocation starts with small opaque ones.
#[test]
fn a_training_starts_with_a_part_of_its_budget() {
    let scene = dataset(ring(12), |_, _| [90, 60, 30]);
    let of = |strategy, max_gaussians| {
        let config = TrainConfig { strategy, budget: 4000, max_gaussians, far_points: 0, ..TrainConfig::default() };
        first_model(&scene, &config).expect("Gaussians")
    };
    let (grown, drawn) = (of(StrategyKind::Budget, 0), of(StrategyKind::Mcmc, 0));
    assert_eq!((grown.len(), drawn.len()), (1000, 1000));
    assert_eq!(drawn.means, grown.means);
    assert!(drawn.scales[0][0] < grown.scales[0][0] && drawn.opacities[0] > grown.opacities[0]);
    assert_eq!(of(StrategyKind::Adc, 0).len(), 50_000);
    assert_eq!(of(StrategyKind::Budget, 300).len(), 300);
}

/// A laser scan has more points than the photos have pixels. They are thinned over all of their place, and the Gaussians get the
/// sizes of what is left, with room for growth below a limit; one that allows all of them keeps them all.
#[test]
fn points_far_beyond_the_budget_are_thinned_evenly() {
    let mut scene = dataset(ring(6), |_, _| [90, 60, 30]);
    let wall = |side: usize| {
        let place = move |at: usize| (at as f64 + 0.5) / side as f64 * 2.0 - 1.0;
        (0..side * side).map(move |at| point(1.0, place(at % side), place(at / side))).collect::<Vec<Point>>()
    };
    let of = |scene: &Dataset, config: TrainConfig| {
        first_model(scene, &TrainConfig { far_points: 0, ..config }).expect("Gaussians")
    };
    let config = || TrainConfig::default();
    // The photos ask for 64 x 48 / 2 Gaussians.
    scene.points = wall(70);
    assert_eq!(of(&scene, config()), initial_gaussians(&scene, 0, 10).expect("Gaussians"), "not far beyond it");
    scene.points = wall(150);
    let all = initial_gaussians(&scene, 0, 10).expect("Gaussians");
    assert_eq!(of(&scene, TrainConfig { max_gaussians: 22_500, ..config() }), all);
    assert_eq!(of(&scene, TrainConfig { strategy: StrategyKind::Adc, ..config() }), all);
    for (config, count) in [
        (config(), 6144),
        (TrainConfig { iterations: 1, ..config() }, 6144),
        (TrainConfig { budget: 700, ..config() }, 2800),
        (TrainConfig { max_gaussians: 3000, ..config() }, 3000),
        (TrainConfig { max_gaussians: 1200, ..config() }, 600),
        (TrainConfig { max_gaussians: 3000, strategy: StrategyKind::Adc, ..config() }, 1500),
    ] {
        let thin = of(&scene, config);
        assert_eq!(thin.len(), count);
        for quarter in 0..16 {
            let at = |row: usize| {
                let place = thin.world(row);
                let quarter = |value: f64| ((value + 1.0) * 2.0) as usize;
                quarter(place.y) + 4 * quarter(place.z)
            };
            let inside = (0..count).filter(|&row| at(row) == quarter).count();
            assert!(inside.abs_diff(count / 16) < count / 64, "{inside} of {count} in a sixteenth");
        }
        let mean = |model: &labelgs::scene::Gaussians| {
            model.scales.iter().map(|scale| f64::from(scale[0])).sum::<f64>() / model.len() as f64
        };
        let grown = (mean(&thin) - mean(&all)).exp() / (22_500.0 / count as f64).sqrt();
        assert!((0.75..1.3).contains(&grown), "{grown}");
    }
    let with_far = TrainConfig { max_gaussians: 3000, ..config() };
    assert!((2200..=3000).contains(&first_model(&scene, &with_far).expect("Gaussians").len()));
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
    // A textured wall at z = 6 before cameras in a row.
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
    assert_eq!(exit_status(&initial_gaussians(&Dataset::default(), 1, 10).expect_err("no views")), 3);
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

/// Cameras on a ring look over a ground with points at a blue sky. Only directions above all points get far Gaussians,
/// in the colour of the sky.
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
