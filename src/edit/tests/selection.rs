//! Gaussians are selected by hand.

use glam::{DMat3, DVec3};
use labelgs_edit::selection::{Combine, Nearby, Region, Shape, Side, beyond, in_region, in_sphere};
use labelgs_scene::{Camera, Gaussians};

/// Gaussians along a side of the grid.
const GRID_SIDE: usize = 21;

/// Two flat square grids, one at z = 2 and one at z = 4, from -1 to 1 in x and y. The left half of each is red, the
/// right half green.
fn sheets() -> Gaussians {
    let place = |row: usize| {
        let (sheet, at) = (row / (GRID_SIDE * GRID_SIDE), row % (GRID_SIDE * GRID_SIDE));
        [(at % GRID_SIDE) as f32 * 0.1 - 1.0, (at / GRID_SIDE) as f32 * 0.1 - 1.0, 2.0 + 2.0 * sheet as f32]
    };
    let count = 2 * GRID_SIDE * GRID_SIDE;
    Gaussians {
        means: (0..count).map(place).collect(),
        quats: vec![[1.0, 0.0, 0.0, 0.0]; count],
        scales: vec![[-2.8, -2.8, -6.0]; count],
        opacities: vec![3.0; count],
        sh0: (0..count).map(|row| if place(row)[0] < 0.0 { [1.7, -1.7, -1.7] } else { [-1.7, 1.7, -1.7] }).collect(),
        ..Gaussians::default()
    }
}

/// A camera at the origin that looks along z; one unit is 50 px at z = 2.
fn camera() -> Camera {
    let camera = Camera::at_origin([100.0, 100.0, 100.0, 75.0], (200, 150));
    assert_eq!((camera.rotation, camera.translation), (DMat3::IDENTITY, DVec3::ZERO));
    camera
}

fn places(model: &Gaussians, chosen: &[bool]) -> Vec<DVec3> {
    (0..model.len()).filter(|&row| chosen[row]).map(|row| model.world(row)).collect()
}

#[test]
fn what_is_drawn_over_a_picture_is_chosen() {
    let (model, camera) = (sheets(), camera());
    let box_of = |x0, y0, x1, y1| Region {
        shape: Shape::Inside,
        points: vec![[x0, y0], [x1, y0], [x1, y1], [x0, y1]],
        radius: 0.0,
    };
    // Only the front sheet is visible.
    let depth = vec![2.0_f32; 200 * 150];
    let square = box_of(100.0, 75.0, 127.0, 102.0);
    let seen = places(&model, &in_region(&model, &camera, &square, Some(&depth)));
    assert!(seen.iter().all(|at| at.z == 2.0 && at.x >= -1e-6 && at.x < 0.54 && at.y < 0.54), "{seen:?}");
    assert_eq!(seen.len(), 36, "0 to 0.5 in both directions");
    let through = places(&model, &in_region(&model, &camera, &square, None));
    assert_eq!(through.iter().filter(|at| at.z == 4.0).count(), 121, "0 to 1 at twice the depth");
    assert_eq!(through.len(), 36 + 121);
    // Where no surface was drawn, nothing is hidden.
    assert_eq!(
        in_region(&model, &camera, &square, Some(&vec![0.0; 200 * 150])),
        in_region(&model, &camera, &square, None)
    );

    // A line with two corners, and a single point.
    let line = Region { shape: Shape::Along, points: vec![[60.0, 75.0], [100.0, 75.0], [100.0, 115.0]], radius: 3.0 };
    let along = places(&model, &in_region(&model, &camera, &line, Some(&depth)));
    assert!(along.iter().all(|at| (at.y.abs() < 0.061 && at.x < 0.061) || (at.x.abs() < 0.061 && at.y > -0.061)));
    assert_eq!(along.len(), 9 + 8, "each grid place on the line once: {along:?}");
    let point = Region { points: vec![[100.0, 75.0]], ..line };
    assert_eq!(places(&model, &in_region(&model, &camera, &point, Some(&depth))), [DVec3::new(0.0, 0.0, 2.0)]);
    // A concave line: its notch is outside. No points, nothing.
    let notched = Region {
        shape: Shape::Inside,
        points: vec![[60.0, 40.0], [140.0, 40.0], [140.0, 110.0], [100.0, 60.0], [60.0, 110.0]],
        radius: 0.0,
    };
    assert!(notched.has((70.0, 60.0).into()) && !notched.has((100.0, 90.0).into()));
    for shape in [Shape::Inside, Shape::Along] {
        let none = Region { shape, points: Vec::new(), radius: 9.0 };
        assert!(!in_region(&model, &camera, &none, None).contains(&true));
    }
}

#[test]
fn places_and_depths_are_chosen() {
    let (model, camera) = (sheets(), camera());
    let ball = places(&model, &in_sphere(&model, DVec3::new(0.0, 0.0, 2.0), 0.15));
    assert_eq!(ball.len(), 9);
    for (side, z) in [(Side::Front, 2.0), (Side::Behind, 4.0)] {
        let found = places(&model, &beyond(&model, &camera, 3.0, side));
        assert!(found.len() == GRID_SIDE * GRID_SIDE && found.iter().all(|at| at.z == z), "{side:?}");
    }
}

#[test]
fn a_flood_stays_on_its_colour_and_its_sheet() {
    let mut model = sheets();
    let nearby = Nearby::new(&model).expect("a tree");
    let free = vec![true; model.len()];
    let first = 10 * GRID_SIDE + 15;
    let found = places(&model, &nearby.flood(&model, first, 0.2, &free));
    assert!(found.iter().all(|at| at.z == 2.0 && at.x > -0.01), "{found:?}");
    assert_eq!(found.len(), 11 * GRID_SIDE);
    assert_eq!(places(&model, &nearby.flood(&model, first, 1.0, &free)).len(), GRID_SIDE * GRID_SIDE, "any colour");
    // Two locked columns stop the flood, and so does an upright sheet.
    let unlocked: Vec<bool> = (0..model.len()).map(|row| (model.means[row][0] - 0.55).abs() > 0.06).collect();
    assert_eq!(places(&model, &nearby.flood(&model, 10 * GRID_SIDE + 12, 0.2, &unlocked)).len(), 5 * GRID_SIDE);
    for row in 0..model.len() {
        if model.means[row][0] > 0.45 {
            model.scales[row] = [-6.0, -2.8, -2.8];
        }
    }
    assert_eq!(places(&model, &nearby.flood(&model, 10 * GRID_SIDE + 12, 0.2, &free)).len(), 5 * GRID_SIDE);
}

#[test]
fn choices_grow_and_shrink_by_a_row_or_two() {
    let model = sheets();
    let nearby = Nearby::new(&model).expect("a tree");
    let inner = |reach: f32| -> Vec<bool> {
        let is_in = |mean: &[f32; 3]| mean[2] == 2.0 && mean[0].abs() < reach && mean[1].abs() < reach;
        model.means.iter().map(is_in).collect()
    };
    let start = inner(0.45);
    let (more, less) = (nearby.grown(&start), nearby.shrunk(&start));
    let has_all = |a: &[bool], b: &[bool]| a.iter().zip(b).all(|(&a, &b)| a || !b);
    assert!(has_all(&more, &inner(0.55)) && has_all(&inner(0.75), &more), "one or two rows more");
    assert!(has_all(&inner(0.35), &less) && has_all(&less, &inner(0.15)), "one or two rows less");
    let nothing = vec![false; model.len()];
    assert_eq!((nearby.grown(&nothing), nearby.shrunk(&nothing)), (nothing.clone(), nothing));
}

#[test]
fn choices_join() {
    let (before, found) = ([false, false, true, true], [false, true, false, true]);
    for (how, expected) in [
        (Combine::Replace, [false, true, false, true]),
        (Combine::Add, [false, true, true, true]),
        (Combine::Take, [false, false, true, false]),
        (Combine::Within, [false, false, false, true]),
    ] {
        assert_eq!(how.join(&before, &found), expected, "{how:?}");
    }
}
