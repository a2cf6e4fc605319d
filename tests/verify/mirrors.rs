//! The mirrors against identities, closed forms and brute force.

use crate::reference::adam::{AdamState, Rates, adam};
use crate::reference::blend::{blend_forward, centre, shade, trace};
use crate::reference::loss::{Photo, blur, photo_loss, ssim, ssim_backward, window};
use crate::reference::project::{normalised, project_all, project_forward, rotation};
use crate::reference::scan::{compact, exclusive_scan};
use crate::reference::sort::{depth_sort, radix_sort};
use crate::reference::splat::Splat;
use crate::reference::step::splats_of;
use crate::reference::tile::{
    TileGrid, counted_tiles, cull, emit_instances, exponent, row_interval, tile_lengths, tile_ranges, tiles_within,
    touched_tiles,
};
use crate::reference::{Model, Row, Rules, sh};
use crate::support::compare::{Tolerance, check, close, exact};
use crate::support::scenes::{Scene, Shape, dot, generator, plain_camera, scene, uniform};
use glam::{DMat3, DQuat, DVec3};

const EQUAL: Tolerance = Tolerance { absolute: 1e-12, relative: 1e-10 };

#[test]
fn a_quaternion_gives_its_rotation_matrix() {
    let mut random = generator(1);
    for _ in 0..20 {
        let q = normalised([0; 4].map(|_| uniform(&mut random, -1.0, 1.0))).0;
        let known = DMat3::from_quat(DQuat::from_xyzw(q[1], q[2], q[3], q[0]));
        check("rotation", close(&rotation(q).to_cols_array(), &known.to_cols_array(), EQUAL));
    }
}

/// Midpoints in z and angle integrate polynomials of this degree on the sphere to about 1e-6.
#[test]
fn spherical_harmonics_are_orthonormal() {
    let (rules, steps) = (Rules::default(), 800);
    let mut products = vec![0.0; 256];
    for i in 0..steps {
        let z = (f64::from(i) + 0.5) / f64::from(steps) * 2.0 - 1.0;
        for j in 0..16 {
            let angle = (f64::from(j) + 0.5) / 16.0 * std::f64::consts::TAU;
            let ring = (1.0 - z * z).sqrt();
            let values = sh::basis(&rules, DVec3::new(ring * angle.cos(), ring * angle.sin(), z));
            let area = 4.0 * std::f64::consts::PI / (f64::from(steps) * 16.0);
            (0..256).for_each(|k| products[k] += values[k / 16] * values[k % 16] * area);
        }
    }
    let identity: Vec<f64> = (0..256).map(|k| if k / 16 == k % 16 { 1.0 } else { 0.0 }).collect();
    check("products", close(&products, &identity, Tolerance { absolute: 3e-5, relative: 0.0 }));
}

/// The covariance is that of the linearised projection: rows of M are its differences along the Gaussian's axes.
#[test]
fn projection_is_linearised_at_the_centre() {
    let rules = Rules::default();
    let s = scene(3, &Shape { scales: (0.1, 0.3), ..Shape::default() });
    let model = s.model();
    for (index, row) in model.rows.iter().enumerate() {
        let projected = project_forward(&rules, &s.camera, &model, index).expect("in front of the camera");
        let axes = rotation(normalised(row.quat).0) * DMat3::from_diagonal(DVec3::from(row.scale.map(f64::exp)));
        let at = |p: DVec3| s.camera.project(s.camera.to_camera(p));
        let mean = DVec3::from(row.mean);
        let m = [0, 1, 2].map(|k| (at(mean + 1e-5 * axes.col(k)) - at(mean - 1e-5 * axes.col(k))) / 2e-5);
        let sum = |f: fn(&glam::DVec2) -> f64| m.iter().map(f).sum::<f64>();
        let cov = [sum(|v| v.x * v.x) + rules.dilation, sum(|v| v.x * v.y), sum(|v| v.y * v.y) + rules.dilation];
        check("cov2d", close(&projected.cov2d, &cov, Tolerance { absolute: 1e-6, relative: 1e-6 }));
        let ([a, b, c], [xx, xy, yy]) = (projected.splat.conic, projected.cov2d);
        let product = [a * xx + b * xy, a * xy + b * yy, b * xx + c * xy, b * xy + c * yy];
        check("conic", close(&product, &[1.0, 0.0, 0.0, 1.0], Tolerance { absolute: 1e-9, relative: 0.0 }));
        let centre = at(mean);
        check("mean2d", close(&projected.splat.mean2d, &[centre.x, centre.y], EQUAL));
    }
}

#[test]
fn a_round_splat_has_the_expected_footprint() {
    let camera = plain_camera(40, 30);
    let model = Model { rows: vec![dot(&camera, [20.0, 15.0], 5.0, 3.0, 0.7)], labels: vec![0], sh_degree: 0 };
    let splat = project_forward(&Rules::default(), &camera, &model, 0).expect("in front").splat;
    let expected = [20.0, 15.0, 1.0 / (9.0 + f64::from(0.3_f32)), 0.0, 0.7, 0.5];
    let found = [splat.mean2d[0], splat.mean2d[1], splat.conic[0], splat.conic[1], splat.opacity, splat.colour[0]];
    check("splat", close(&found, &expected, EQUAL));
}

#[test]
fn nothing_is_drawn_at_or_behind_the_near_plane() {
    let camera = plain_camera(40, 30);
    let seen = |z: f64| {
        let row = Row { mean: [0.0, 0.0, z], quat: [1.0, 0.0, 0.0, 0.0], ..Row::default() };
        let model = Model { rows: vec![row], labels: vec![0], sh_degree: 0 };
        project_forward(&Rules::default(), &camera, &model, 0).is_some()
    };
    assert!(seen(0.2001) && !seen(f64::from(0.2_f32)) && !seen(0.1) && !seen(-3.0));
}

fn splats(seed: u64, shape: &Shape) -> (Scene, Vec<Splat>) {
    let s = scene(seed, shape);
    let found = splats_of(&project_all(&Rules::default(), &s.camera, &s.model()));
    (s, found)
}

#[test]
fn blending_skips_only_negligible_splats() {
    let rules = Rules::default();
    let (s, splats) = splats(5, &Shape { opacities: (-5.0, 8.0), gaussians: 80, ..Shape::default() });
    let image = blend_forward(&rules, &splats, (48, 40), s.target.background);
    for (index, pixel) in image.pixels.iter().enumerate() {
        let ray = trace(&rules, splats.iter().enumerate(), centre(index, 48));
        let whole = shade(&splats, &ray, s.target.background);
        assert_eq!(pixel.colour, whole.colour);
        assert!(pixel.margins.cut == whole.margins.cut || whole.margins.cut > 1e-3, "margins near the cut are seen");
        let weights: f64 = ray.contributions.iter().map(|c| c.weight()).sum();
        assert!((weights + pixel.transmittance - 1.0).abs() < 1e-12);
        let main = ray.contributions.iter().map(|c| c.weight()).fold(0.0, f64::max);
        assert_eq!(pixel.main_weight, main);
    }
}

/// Largest exponent over a rectangle by trying 81 x 81 places of it.
fn largest_by_trial(splat: &Splat, (x0, x1): (usize, usize), (y0, y1): (usize, usize)) -> f64 {
    let place = |from: usize, to: usize, i: usize| from as f64 + 0.5 + (to - from - 1) as f64 * i as f64 / 80.0;
    let all = (0..81 * 81).map(|i| exponent(splat, [place(x0, x1, i % 81), place(y0, y1, i / 81)]));
    all.fold(f64::NEG_INFINITY, f64::max)
}

#[test]
fn tiles_of_an_ellipse_equal_brute_force() {
    let rules = Rules::default();
    let shape =
        Shape { scales: (0.01, 0.6), opacities: (-5.5, 3.0), gaussians: 60, width: 45, height: 37, ..Shape::default() };
    let (_, splats) = splats(6, &shape);
    let grid = TileGrid { size: (45, 37), tile: (8, 8) };
    assert_eq!((grid.columns(), grid.rows()), (6, 5));
    let (mut touched_count, mut only_between) = (0, 0);
    for splat in &splats {
        let (touched, _) = touched_tiles(&rules, splat, &grid);
        let counted = counted_tiles(&rules, splat, &grid);
        assert!(counted.iter().all(|tile| touched.contains(tile)));
        let wider = tiles_within(&rules, splat, &grid, 0.5);
        assert!(touched.iter().all(|tile| wider.contains(tile)));
        assert_eq!(tiles_within(&rules, splat, &grid, 0.0), touched);
        touched_count += touched.len();
        only_between += touched.len() - counted.len();
        for tile in 0..grid.count() {
            let (column, row) = (tile % grid.columns(), tile / grid.columns());
            let trial = largest_by_trial(splat, grid.span_x(column), grid.span_y(row)) - rules.exponent_min();
            if trial.abs() > 0.1 {
                assert_eq!(touched.contains(&(tile as u32)), trial > 0.0, "tile {tile}, {trial} above the cut");
            }
        }
        assert!(touched.is_empty() || cull(&rules, splat, grid.size).touches);
    }
    assert!(only_between > 0 && only_between * 10 < touched_count, "{only_between} of {touched_count} tiles in vain");
}

/// Round ones, needles in all directions, huge ones, and centres far outside of the picture.
#[test]
fn tiles_of_a_row_are_an_interval_in_closed_form() {
    let (rules, mut random) = (Rules::default(), generator(8));
    let grid = TileGrid { size: (61, 43), tile: (8, 4) };
    let (mut listed, mut only_between) = (0, 0);
    for index in 0..600 {
        let mut draw = |low: f64, high: f64| uniform(&mut random, low, high);
        let far = if index % 3 == 0 { 1e3 } else { 20.0 };
        let angle = if index % 5 == 0 { 0.0 } else { draw(0.0, 3.2) };
        let turn = DMat3::from_rotation_z(angle);
        let size = if index % 2 == 0 { 3.0 } else { 1.0 };
        let [first, second] = [0; 2].map(|_| 10_f64.powf(draw(-size, size)));
        let inverse = DMat3::from_diagonal(DVec3::new(first, second, 1.0));
        let conic = turn * inverse * turn.transpose();
        let splat = Splat {
            mean2d: [draw(-far, 61.0 + far), draw(-far, 43.0 + far)],
            conic: [conic.x_axis.x, conic.x_axis.y, conic.y_axis.y],
            opacity: draw(-8.3, -0.001).exp2(),
            ..Splat::default()
        };
        let row = |row: usize| row_interval(&rules, &splat, &grid, row);
        let found: Vec<u32> =
            (0..grid.rows()).flat_map(|y| (row(y).0..row(y).1).map(move |x| (y * grid.columns() + x) as u32)).collect();
        let (touched, _) = touched_tiles(&rules, &splat, &grid);
        let counted = counted_tiles(&rules, &splat, &grid);
        assert!(found.iter().all(|tile| touched.contains(tile)), "{splat:?}: {found:?} in {touched:?}");
        assert!(counted.iter().all(|tile| found.contains(tile)), "{splat:?}: {counted:?} in {found:?}");
        listed += found.len();
        only_between += found.len() - counted.len();
    }
    assert!(listed > 1000 && only_between * 30 < listed, "{only_between} of {listed} tiles in vain");
}

#[test]
fn instances_and_ranges_equal_brute_force() {
    let rules = Rules::default();
    let (s, splats) = splats(7, &Shape::default());
    let (labels, grid) = (s.model().labels, TileGrid { size: (48, 40), tile: (16, 16) });
    let slot_of = |gaussian: usize| labels[gaussian].checked_sub(1).map(|slot| slot as usize);
    let instances = emit_instances(&rules, &splats, &grid, slot_of);
    let keys: Vec<u32> = instances.iter().map(|i| i.key).collect();
    let order = radix_sort(&keys);
    let sorted: Vec<u32> = order.iter().map(|&place| keys[place]).collect();
    let ranges = tile_ranges(&sorted, grid.count() * 4);
    for (key, [start, end]) in ranges.iter().map(|r| r.map(|v| v as usize)).enumerate() {
        let (layer, tile) = (key / grid.count(), (key % grid.count()) as u32);
        let found: Vec<u32> = order[start..end].iter().map(|&place| instances[place].splat).collect();
        let member = |splat: &Splat| {
            (layer == 0 || labels[splat.gaussian] == layer as u32)
                && touched_tiles(&rules, splat, &grid).0.contains(&tile)
        };
        let expected: Vec<u32> = (0..splats.len()).filter(|&i| member(&splats[i])).map(|i| i as u32).collect();
        check("list of a tile", exact(&found, &expected));
    }
}

#[test]
fn sorts_and_scans_equal_brute_force() {
    assert_eq!(depth_sort(&[3.0, 1.0, 2.0, 1.0]), [1, 3, 2, 0]);
    assert_eq!(radix_sort(&[5, 1, 5, 0, 1]), [3, 1, 4, 0, 2]);
    assert_eq!(exclusive_scan(&[3, 0, 2, 7]), (vec![0, 3, 3, 5], 12));
    assert_eq!(exclusive_scan(&[u32::MAX - 1, 1, 1, 7]), (vec![0, u32::MAX - 1, u32::MAX, u32::MAX], u32::MAX));
    assert_eq!(compact(&[0, 4, 0, 1]), [1, 3]);
    let ranges = tile_ranges(&[0, 0, 3], 4);
    assert_eq!(ranges, [[0, 2], [2, 2], [2, 2], [2, 3]]);
    assert_eq!(tile_lengths(&ranges), (2, vec![true, false, false, true]));
}

/// SSIM at one pixel from its definition: weighted means, variances and covariance of the 11 x 11 window.
fn ssim_at(rules: &Rules, size: (usize, usize), x: &[f64], y: &[f64], (px, py): (isize, isize)) -> f64 {
    let weights = window(rules);
    let over = |f: &dyn Fn(f64, f64) -> f64| {
        let taps = (0..121).map(|i| {
            let (qx, qy) = (px + i % 11 - 5, py + i / 11 - 5);
            let inside = qx >= 0 && qy >= 0 && qx < size.0 as isize && qy < size.1 as isize;
            let place = if inside { qy as usize * size.0 + qx as usize } else { 0 };
            let (a, b) = if inside { (x[place], y[place]) } else { (0.0, 0.0) };
            weights[i as usize % 11] * weights[i as usize / 11] * f(a, b)
        });
        taps.sum::<f64>()
    };
    let (mx, my) = (over(&|a, _| a), over(&|_, b| b));
    let (vx, vy) = (over(&|a, _| (a - mx).powi(2)), over(&|_, b| (b - my).powi(2)));
    let cov = over(&|a, b| (a - mx) * (b - my));
    (2.0 * mx * my + rules.ssim_c1) * (2.0 * cov + rules.ssim_c2)
        / ((mx * mx + my * my + rules.ssim_c1) * (vx + vy + rules.ssim_c2))
}

#[test]
fn ssim_equals_its_definition() {
    let (rules, mut random, size) = (Rules::default(), generator(9), (17, 14));
    let mut plane = || -> Vec<f64> { (0..17 * 14).map(|_| uniform(&mut random, 0.0, 1.0)).collect() };
    let (x, y) = (plane(), plane());
    let map = ssim(&rules, size, &x, &y);
    let direct: Vec<f64> =
        (0..17 * 14).map(|i| ssim_at(&rules, size, &x, &y, ((i % 17) as isize, (i / 17) as isize))).collect();
    check("ssim", close(&map, &direct, EQUAL));
    let (same, v) = (ssim(&rules, size, &x, &x), ssim_backward(&rules, size, &x, &x, &[1.0; 17 * 14]));
    check("ssim of a copy", close(&same, &[1.0; 17 * 14], EQUAL));
    assert!(v.iter().all(|v| v.abs() < 1e-9), "a copy is the maximum");
    let w = window(&rules);
    assert_eq!(w.len(), 11);
    assert!((w.iter().sum::<f64>() - 1.0).abs() < 1e-12 && (blur(&[1.0; 400], (20, 20), &w)[210] - 1.0).abs() < 1e-12);
}

#[test]
fn invalid_pixels_stay_out_of_the_photo_loss() {
    let (rules, s) = (Rules::default(), scene(10, &Shape::default()));
    let photo = &s.target.photo;
    let image: Vec<[f64; 3]> = photo.colours.iter().map(|c| c.map(|v| v * 0.8 + 0.05)).collect();
    let loss = photo_loss(&rules, &image, photo);
    let (mut other_image, mut other) = (image.clone(), photo.clone());
    for i in (0..image.len()).filter(|&i| !photo.valid[i]) {
        (other_image[i], other.colours[i]) = ([9.0; 3], [-4.0; 3]);
        assert_eq!(loss.v_image[i], [0.0; 3]);
    }
    assert!(photo.valid.contains(&false));
    assert_eq!(photo_loss(&rules, &other_image, &other), loss);
    let nothing = Photo { valid: vec![false; image.len()], ..photo.clone() };
    assert_eq!(photo_loss(&rules, &image, &nothing).value, 0.0);
    let copy = photo_loss(&rules, &photo.colours, photo);
    assert!(copy.value.abs() < 1e-7, "0 but for weights that are f32");
}

#[test]
fn adam_takes_known_steps() {
    let (rules, rates) = (Rules::default(), Rates([0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8]));
    let gradient = Row { mean: [3.0, -1e-6, 0.0], opacity: -2.0, ..Row::default() };
    let first = adam(&rules, &rates, 1, &AdamState::default(), &gradient);
    check("first step", close(&first.row.mean, &[-0.1, 0.1, 0.0], Tolerance { absolute: 1e-8, relative: 0.0 }));
    assert!((first.row.opacity - 0.4).abs() < 1e-9);
    let second = adam(&rules, &rates, 2, &first, &Row::default());
    let (beta1, beta2) = (0.9_f64, 0.999_f64);
    let m = 3.0 * beta1 * (1.0 - beta1) / (1.0 - beta1 * beta1);
    let u = 9.0 * beta2 * (1.0 - beta2) / (1.0 - beta2 * beta2);
    assert!((second.row.mean[0] - (first.row.mean[0] - 0.1 * m / u.sqrt())).abs() < 1e-12);
}
