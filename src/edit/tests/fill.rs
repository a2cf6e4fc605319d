//! Closing the place of a removed object: surfaces are continued where no view looked, and nowhere else.

use glam::{DMat3, DVec3};
use labelgs_edit::{Filled, Light, Sight, fill};
use labelgs_scene::harmonics::SH_C0;
use labelgs_scene::{Camera, Gaussians, LabelMap};

mod patterns;

/// Radius of a dome, label 1, that stands on the plane z = 0, label 0.
const RADIUS: f64 = 0.4;
const SIDE: u32 = 200;
const FOCAL: f64 = 220.0;
/// Distance of the cameras.
const FAR: f64 = 3.0;

/// What is under the dome.
#[derive(Clone, Copy, PartialEq)]
enum Under {
    /// Nobody knows.
    Hidden,
    /// Every view sees a pit where x is above 0, as if the dome were glass there.
    Pit,
}

/// Colour of the plane: a gradient along x and y.
fn gradient(place: DVec3) -> [f64; 3] {
    [0.5 + 0.3 * place.x, 0.5 + 0.3 * place.y, 0.4]
}

/// Share of its colour that the plane has in the shadow of the dome.
const SHADE: f64 = 0.45;

fn sun() -> DVec3 {
    DVec3::new(0.75, 0.35, 0.55).normalize()
}

/// True for places of the plane in the shadow of the dome.
fn is_in_shadow(place: DVec3) -> bool {
    let along = place.dot(sun());
    let root = along * along - place.length_squared() + RADIUS * RADIUS;
    root > 0.0 && root.sqrt() > along
}

/// Eight cameras in a ring that look at the origin.
fn cameras() -> Vec<Camera> {
    let camera = |index: u32| {
        let angle = f64::from(index) * std::f64::consts::TAU / 8.0;
        let outward = DVec3::new(angle.cos() * 0.8, angle.sin() * 0.8, 0.6);
        let forward = -outward;
        let right = forward.cross(DVec3::Z).normalize();
        let rotation = DMat3::from_cols(right, forward.cross(right), forward).transpose();
        let (half, translation) = (f64::from(SIDE) / 2.0, -(rotation * outward * FAR));
        Camera { rotation, translation, fx: FOCAL, fy: FOCAL, cx: half, cy: half, width: SIDE, height: SIDE }
    };
    (0..8).map(camera).collect()
}

fn sight(camera: Camera, under: Under) -> Sight {
    sight_of(camera, under, gradient)
}

/// The view of a camera, by its rays, with the colours of the plane.
fn sight_of(camera: Camera, under: Under, plane: impl Fn(DVec3) -> [f64; 3]) -> Sight {
    let (mut rgb, mut depth, mut ids) = (Vec::new(), Vec::new(), Vec::new());
    let centre = camera.centre();
    for index in 0..SIDE * SIDE {
        let (x, y) = (f64::from(index % SIDE) + 0.5, f64::from(index / SIDE) + 0.5);
        let own = DVec3::new((x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy, 1.0);
        let ray = camera.rotation.transpose() * own;
        // |centre + t ray| = RADIUS
        let (a, b, c) = (ray.length_squared(), ray.dot(centre), centre.length_squared() - RADIUS * RADIUS);
        let root = b * b - a * c;
        let dome = (root > 0.0).then(|| (-b - root.sqrt()) / a).filter(|t| (centre + ray * *t).z > 0.0);
        let ground = -centre.z / ray.z;
        let floor = centre + ray * ground;
        let in_pit = under == Under::Pit && floor.x > 0.0 && floor.truncate().length() < RADIUS;
        let (t, label, colour) = match dome {
            Some(t) if !in_pit => (t, 1, [0.9, 0.1, 0.9]),
            _ if in_pit => (-(centre.z + 1.0) / ray.z, 0, [0.1; 3]),
            _ if ray.z < 0.0 => (ground, 0, plane(floor)),
            _ => (0.0, 0, [0.0; 3]),
        };
        depth.push(t as f32);
        ids.push(label);
        rgb.push(colour.map(|value| value as f32));
    }
    Sight { camera, rgb, depth, labels: LabelMap { width: SIDE, height: SIDE, ids } }
}

/// A model of the dome, and of the plane without its disc.
fn model(origin: DVec3) -> Gaussians {
    model_of(origin, 20)
}

/// The same with so many Gaussians of the plane on either side.
fn model_of(origin: DVec3, side: i32) -> Gaussians {
    let mut means = Vec::new();
    let mut labels = Vec::new();
    for (turn, height) in (0..100).flat_map(|turn| (0..26).map(move |height| (turn, height))) {
        let (angle, up) = (f64::from(turn) * 0.0629, f64::from(height) * 0.06);
        means.push(RADIUS * DVec3::new(angle.cos() * up.cos(), angle.sin() * up.cos(), up.sin()));
        labels.push(1);
    }
    for (x, y) in (-side..=side).flat_map(|x| (-side..=side).map(move |y| (x, y))) {
        let place = DVec3::new(f64::from(x), f64::from(y), 0.0) * 0.05;
        if place.length() > RADIUS {
            means.push(place);
            labels.push(0);
        }
    }
    let count = means.len();
    let scale = |&label: &u32| [if label == 1 { -4.2 } else { -3.5 }; 3];
    Gaussians {
        antialiased: false,
        origin,
        means: means.iter().map(|mean| mean.as_vec3().to_array()).collect(),
        quats: vec![[1.0, 0.0, 0.0, 0.0]; count],
        scales: labels.iter().map(scale).collect(),
        opacities: vec![3.0; count],
        sh0: vec![[0.0; 3]; count],
        sh_rest: vec![[0.1; 3]; count * 3],
        sh_degree: 1,
        labels: Some(labels),
        label_confidence: Some(vec![0.9; count]),
    }
}

fn filled(under: Under) -> (Filled, usize) {
    let sights: Vec<Sight> = cameras().into_iter().map(|camera| sight(camera, under)).collect();
    let model = model(DVec3::ZERO);
    let rest = labelgs_edit::remove(&model, &[1]).expect("rest").len();
    (fill(&model, &[1], &sights, None).expect("filled"), rest)
}

/// Size of a pixel at the dome, the spacing of new Gaussians.
const CELL: f64 = FAR / FOCAL;

#[test]
fn a_missing_disc_is_closed_in_the_colours_around_it() {
    let (Filled { model, added, hidden, .. }, rest) = filled(Under::Hidden);
    assert_eq!(hidden, 0);
    model.check().expect("all columns have the same length");
    let new: Vec<usize> = (rest..model.len()).collect();
    assert_eq!(added.into_iter().collect::<Vec<_>>(), [(0, new.len() as u64)]);
    // A Gaussian is 0.7 of its spacing wide.
    let spacing = f64::from(model.scales[rest][0].exp()) / 0.7;
    let area = new.len() as f64 * spacing * spacing / (std::f64::consts::PI * RADIUS * RADIUS);
    assert!((0.9..1.06).contains(&area), "{area} of the disc is filled");
    for row in new {
        let place = model.world(row);
        assert!(place.z.abs() < 0.5 * CELL, "{place} is off the plane");
        assert!(place.truncate().length() < RADIUS + CELL, "{place} is outside of the disc");
        let shown = model.sh0[row].map(|value| 0.5 + f64::from(value) * SH_C0);
        let off = (0..3).map(|c| (shown[c] - gradient(place)[c]).abs()).fold(0.0, f64::max);
        // A gradient is its own smoothest continuation; pixels round the places of its colours.
        assert!(off < 0.01, "{place}: {shown:?} is {off} from the gradient");
        assert_eq!(model.labels.as_ref().map(|labels| labels[row]), Some(0));
        // Flat, along the plane, and opaque.
        let [u, v, normal] = model.scales[row];
        assert!(u == v && normal < u - 1.0 && model.opacities[row] > 2.0, "{:?}", model.scales[row]);
        let [w, x, y, z] = model.quats[row].map(f64::from);
        let up = glam::DQuat::from_xyzw(x, y, z, w) * DVec3::Z;
        assert!(up.z.abs() > 0.999, "{up}");
    }
}

#[test]
fn the_rest_stays_and_every_run_is_the_same() {
    let (first, rest) = filled(Under::Hidden);
    let removed = labelgs_edit::remove(&model(DVec3::ZERO), &[1]).expect("rest");
    assert_eq!(first.model.filtered(|row| row < rest), removed);
    assert_eq!(first, filled(Under::Hidden).0);
}

#[test]
fn nothing_covers_what_a_view_saw() {
    let (Filled { model, .. }, rest) = filled(Under::Pit);
    let new: Vec<DVec3> = (rest..model.len()).map(|row| model.world(row)).collect();
    assert!(new.len() > 100, "{} Gaussians in the half that nobody saw", new.len());
    for place in new {
        assert!(place.x < CELL, "{place} covers the pit that every view saw");
    }
}

/// Small Gaussians and a large one under the dome: the dome hides the small ones, and the rim of the large one is seen.
#[test]
fn what_the_object_hid_goes_with_it() {
    let mut model = model(DVec3::ZERO);
    let rest = labelgs_edit::remove(&model, &[1]).expect("rest").len();
    let places = [(0.1, 0.0, 0.02), (-0.2, 0.05, 0.02), (0.0, 0.0, 0.01)];
    for (place, size) in places.into_iter().zip([-5.0, -5.0, 0.0]) {
        model.means.push([place.0, place.1, place.2]);
        model.quats.push([1.0, 0.0, 0.0, 0.0]);
        model.scales.push([size; 3]);
        model.opacities.push(3.0);
        model.sh0.push([0.0; 3]);
        model.sh_rest.extend([[0.0; 3]; 3]);
        model.labels.as_mut().expect("labels").push(0);
        model.label_confidence.as_mut().expect("shares").push(0.9);
    }
    for (under, hidden) in [(Under::Hidden, 2), (Under::Pit, 1)] {
        let sights: Vec<Sight> = cameras().into_iter().map(|camera| sight(camera, under)).collect();
        let filled = fill(&model, &[1], &sights, None).expect("filled");
        assert_eq!(filled.hidden, hidden, "a pit shows what is above it");
        let kept = (0..filled.model.len()).filter(|&row| filled.model.scales[row] == [-5.0; 3]).count();
        assert_eq!(kept as u64, 2 - hidden);
        assert_eq!(filled.model.len() as u64 - filled.added.values().sum::<u64>(), (rest + 3) as u64 - hidden);
    }
}

#[test]
fn without_surroundings_nothing_is_made_up() {
    // The dome in empty space.
    let mut sights: Vec<Sight> = cameras().into_iter().map(|camera| sight(camera, Under::Hidden)).collect();
    for sight in &mut sights {
        let labels = &sight.labels.ids;
        sight.depth.iter_mut().zip(labels).filter(|(_, label)| **label == 0).for_each(|(depth, _)| *depth = 0.0);
    }
    let filled = fill(&model(DVec3::ZERO), &[1], &sights, None).expect("filled");
    assert!(filled.added.is_empty(), "{:?}", filled.added);
    let error = fill(&model(DVec3::ZERO), &[1], &[], None).expect_err("no view");
    assert!(error.to_string().contains("needs at least one view"), "{error}");
    let error = fill(&model(DVec3::ZERO), &[7], &sights, None).expect_err("no such label");
    assert!(error.to_string().contains("no Gaussian has label 7"), "{error}");
}

/// Views of the dome in the sun.
fn in_the_sun() -> Vec<Sight> {
    let shaded = |place: DVec3| gradient(place).map(|value| if is_in_shadow(place) { SHADE * value } else { value });
    cameras().into_iter().map(|camera| sight_of(camera, Under::Hidden, shaded)).collect()
}

#[test]
fn shadows_tell_the_light() {
    let light = Light::of(&model(DVec3::ZERO), &in_the_sun()).expect("searched").expect("a light");
    let off = light.towards.angle_between(sun()).to_degrees();
    // What throws the shadow is 1.5 cells wider than the dome, 3 degrees at its height.
    assert!(off < 3.0, "{off} degrees from the sun");
    for share in light.shade.to_array() {
        // The plane is a gradient, which differs by a tenth between the two sides of an edge.
        assert!((share - SHADE).abs() < 0.05, "{}", light.shade);
    }
    let flat: Vec<Sight> = cameras().into_iter().map(|camera| sight(camera, Under::Hidden)).collect();
    assert_eq!(Light::of(&model(DVec3::ZERO), &flat).expect("searched"), None, "colours without a shadow tell none");
}

#[test]
fn the_shadow_goes_with_its_object() {
    let (sights, whole) = (in_the_sun(), model(DVec3::ZERO));
    let light = Light { towards: sun(), shade: DVec3::splat(SHADE) };
    let rest = labelgs_edit::remove(&whole, &[1]).expect("rest");
    let dark = fill(&whole, &[1], &sights, None).expect("filled");
    let filled = fill(&whole, &[1], &sights, Some(&light)).expect("filled");
    assert_eq!(dark.lit, 0);
    // The grid of new Gaussians begins elsewhere, as far as the shadow goes; its cells at the rim are others.
    let count = filled.added[&0] as f64 / dark.added[&0] as f64;
    assert!((0.98..1.02).contains(&count), "{count} of the new Gaussians: light changes colours alone");
    let shown = |model: &Gaussians, row: usize| 0.5 + f64::from(model.sh0[row][0]) * SH_C0;
    let (mut lit, mut kept) = (0, 0);
    for row in 0..rest.len() {
        let (before, after) = (shown(&rest, row), shown(&filled.model, row));
        let world = rest.world(row);
        let around = [0.0, 0.8, 1.6, 2.4, 3.1, 3.9, 4.7, 5.5]
            .map(|turn| world + 0.15 * DVec3::new(f64::cos(turn), f64::sin(turn), 0.0));
        // Off the soft edge: 0.06 of the way from the dome's top to its shadow, twice as long along the shadow.
        if around.into_iter().all(is_in_shadow) {
            assert!((after / before - 1.0 / SHADE).abs() < 1e-4, "{world}: {after} in the shadow");
            let band = filled.model.sh_rest[row * 3][1] / rest.sh_rest[row * 3][1];
            assert!((f64::from(band) - 1.0 / SHADE).abs() < 1e-4, "{band}");
            lit += 1;
        } else if !around.into_iter().any(is_in_shadow) {
            assert_eq!(after, before, "in the light");
            kept += 1;
        }
    }
    assert!(lit > 10 && kept > 500, "{lit} in the shadow, {kept} in the light");
    assert!(filled.lit >= lit, "{} are lit", filled.lit);
    // The disc under the dome has the colours of the plane in the light.
    let off = |row: usize| (shown(&filled.model, row) - gradient(filled.model.world(row))[0]).abs();
    let mean = (rest.len()..filled.model.len()).map(off).sum::<f64>() / (filled.model.len() - rest.len()) as f64;
    let dark = (rest.len()..dark.model.len())
        .map(|row| (shown(&dark.model, row) - gradient(dark.model.world(row))[0]).abs())
        .sum::<f64>()
        / (dark.model.len() - rest.len()) as f64;
    assert!(mean < 0.01 && dark > 0.05, "off by {mean}, and by {dark} with the shadow");
}

/// What another object shades stays dark: a roof over the dome's shadow keeps the light away with or without the dome.
#[test]
fn the_shadow_of_the_rest_stays() {
    let mut whole = model(DVec3::ZERO);
    for (x, y) in (-15..=15).flat_map(|x| (-15..=15).map(move |y| (x, y))) {
        let place = DVec3::new(f64::from(x), f64::from(y), 0.0) * 0.06 + 1.0 * sun() / sun().z;
        whole.means.push(place.as_vec3().to_array());
        whole.quats.push([1.0, 0.0, 0.0, 0.0]);
        whole.scales.push([-3.0; 3]);
        whole.opacities.push(3.0);
        whole.sh0.push([0.0; 3]);
        whole.sh_rest.extend([[0.0; 3]; 3]);
        whole.labels.as_mut().expect("labels").push(2);
        whole.label_confidence.as_mut().expect("shares").push(0.9);
    }
    let light = Light { towards: sun(), shade: DVec3::splat(SHADE) };
    let filled = fill(&whole, &[1], &in_the_sun(), Some(&light)).expect("filled");
    assert_eq!(filled.lit, 0);
}
