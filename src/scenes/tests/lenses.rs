//! Lenses: their formulas, and a synthetic scene photographed through each of them.

use glam::{DVec2, DVec3};
use labelgs_scene::{Camera, Dataset, LabelMap, View};
use labelgs_scenes::LoadOptions;
use labelgs_scenes::lens::{Division, Eucm, Fisheye, Fov, Lens, Optics, Polynomial, Projection, RadTan};
use labelgs_scenes::window::{Window, ids_of_photo, windows};
use labelgs_synth::{self as synth, World, trace_photo, trace_view};
use labelgs_synth::{Preset, SynthLens, SynthOptions};
use std::collections::BTreeSet;
use std::f64::consts::FRAC_PI_2;
use std::path::Path;

fn fisheyes() -> [Lens; 7] {
    let thin = Fisheye {
        radial: [0.02, -0.01, 0.002, -0.0004],
        tangential: [0.001, -0.0015],
        prism: [0.001, -0.001],
        skew: 0.0,
    };
    let rad_tan = RadTan {
        radial: [0.02, -0.01, 0.003, -0.001, 0.0003, -0.00005],
        tangential: [0.001, -0.0008],
        prism: [0.0005, -0.0003, 0.0004, -0.0002],
    };
    [
        Lens::Fisheye(Fisheye { radial: [0.03, -0.01, 0.002, -0.0005], ..Fisheye::default() }),
        Lens::Fisheye(thin),
        Lens::RadTan(rad_tan),
        Lens::Fov(Fov { angle: 0.9 }),
        Lens::Division(Division { k: -0.15 }),
        Lens::Eucm(Eucm { alpha: 0.6, beta: 1.1 }),
        Lens::Equirectangular,
    ]
}

/// The numbers were computed from COLMAP's formulas by another program, at the point (0.5, -0.4) of the plane z = 1.
#[test]
fn lenses_have_the_values_of_colmap() {
    let expected = [
        (0.448619656943611, -0.35889572555488886),
        (0.4461055697919717, -0.3570142037887875),
        (0.44830586177574994, -0.3584296438919073),
        (0.48066183037550997, -0.384529464300408),
        (0.47253536987831735, -0.3780282959026539),
        (0.4453371898489706, -0.3562697518791765),
        (0.5_f64.atan(), -(0.4 / 1.25_f64.sqrt()).atan()),
    ];
    for (lens, (x, y)) in fisheyes().iter().zip(expected) {
        let found = lens.projection().expect("a lens").project(DVec3::new(1.0, -0.8, 2.0));
        assert!(found.distance(DVec2::new(x, y)) < 1e-14, "{lens:?}: {found}");
    }
}

#[test]
fn every_lens_is_undone_and_grows_with_the_angle() {
    let polynomial = Polynomial {
        numerator: [-0.12, 0.03, 0.0, 0.0],
        denominator: [0.0; 3],
        tangential: [0.001, -0.002],
        ..Polynomial::default()
    };
    for lens in fisheyes().into_iter().chain([Lens::Polynomial(polynomial)]) {
        let projection = lens.projection().expect("a lens");
        let reach = projection.reach();
        assert!(reach > 0.7, "{lens:?} ends at {reach}");
        for step in 0..40 {
            let angle =
                0.98 * reach.min(if matches!(lens, Lens::Polynomial(_)) { 1.0 } else { reach }) * f64::from(step)
                    / 40.0;
            for side in 0..8 {
                let side = DVec2::from_angle(f64::from(side) * std::f64::consts::FRAC_PI_4 + 0.1);
                let direction = (side * angle.sin()).extend(angle.cos());
                let point = projection.project(direction);
                let back = projection.unproject(point, reach).expect("a direction");
                assert!(back.distance(direction) < 1e-8, "{lens:?} at {angle}: {direction} {back}");
            }
            let further = projection.radius(angle + 1e-4);
            assert!(further > projection.radius(angle), "{lens:?} at {angle}");
        }
    }
}

#[test]
fn a_lens_ends_where_it_would_show_things_twice() {
    // a - a^3 has its maximum at 1 / sqrt 3.
    let folded = Fisheye { radial: [-1.0, 0.0, 0.0, 0.0], ..Fisheye::default() };
    assert!((folded.reach() - 3f64.powf(-0.5)).abs() < 1e-3);
    assert_eq!(Fisheye::default().reach(), FRAC_PI_2);
    let camera = camera(100, 80, 30.0);
    let optics = Optics::new(camera, Lens::Fisheye(folded));
    assert!(optics.pixel(DVec3::new(0.5, 0.0, 1.0)).is_some() && optics.pixel(DVec3::X).is_none());
    assert!(optics.direction(DVec2::new(0.0, 0.0)).is_none(), "nothing is shown in the corner");
    for lens in [
        Lens::Fov(Fov { angle: 0.0 }),
        Lens::Eucm(Eucm { alpha: 2.0, beta: 1.0 }),
        Lens::Division(Division { k: f64::NAN }),
    ] {
        assert!(!lens.projection().expect("a lens").is_valid(), "{lens:?}");
    }
}

fn camera(width: u32, height: u32, focal: f64) -> Camera {
    let (cx, cy) = (f64::from(width) / 2.0, f64::from(height) / 2.0);
    let (rotation, translation) = (glam::DMat3::IDENTITY, DVec3::ZERO);
    Camera { rotation, translation, fx: focal, fy: focal, cx, cy, width, height }
}

fn options(lens: SynthLens, fov: Option<u32>) -> SynthOptions {
    SynthOptions {
        preset: Preset::Simple,
        width: 160,
        height: 120,
        views: 2,
        points: 30,
        lens,
        fov,
        ..SynthOptions::default()
    }
}

fn read(folder: &Path, options: &SynthOptions) -> Dataset {
    synth::write(options, folder, &|_| Ok(())).expect("written");
    let load = LoadOptions { masks: Some(folder.join("masks")), test_every: None, ..LoadOptions::default() };
    labelgs_scenes::open(folder, &load).expect("read")
}

/// PSNR of a view against a pinhole render at its pose, over the covered pixels; the share of equal ids; the number of
/// covered pixels.
fn compared(world: &World, view: &View) -> (f64, f64, usize) {
    let (photo, mask) = (view.photo().expect("a photo"), view.mask().expect("read").expect("a mask"));
    let made = trace_view(world, &view.camera, 0);
    let (mut error, mut same, mut count) = (0.0, 0, 0);
    for at in (0..photo.rgba.len()).filter(|&at| photo.rgba[at][3] == 255) {
        for channel in 0..3 {
            error += ((f64::from(photo.rgba[at][channel]) - f64::from(made.rgb[at][channel])) / 255.0).powi(2);
        }
        same += usize::from(mask.ids[at] == u16::from(made.ids[at]));
        count += 1;
    }
    let outside = (0..photo.rgba.len()).filter(|&at| photo.rgba[at][3] == 0);
    outside.for_each(|at| assert_eq!((photo.rgba[at], mask.ids[at]), ([0; 4], 0)));
    (-10.0 * (error / (3 * count.max(1)) as f64).log10(), same as f64 / count as f64, count)
}

/// Bilinear interpolation and resampling within pixels limit OPENCV to 42 dB, and views enlarged from faces to a few dB
/// less. A lens that is off by a pixel would be below 30 dB at the edges of this scene.
#[test]
fn a_scene_through_every_lens_is_that_of_a_pinhole() {
    let world = World::new(Preset::Simple, 0);
    for lens in SynthLens::all() {
        let wide = lens.to_string() == "EQUIRECTANGULAR";
        let folder = tempfile::tempdir().expect("a folder");
        let dataset = read(folder.path(), &options(lens, Some(100)));
        assert_eq!(dataset.train.len(), if wide { 12 } else { 2 }, "{lens}");
        let mut pixels = 0;
        for view in &dataset.train {
            let (psnr, same, count) = compared(&world, view);
            println!("{lens} {}: {psnr:.1} dB, {same:.4} of {count} px", view.name);
            assert!(psnr > 34.0 && same > 0.99, "{lens} {}: {psnr} dB, {same}", view.name);
            pixels += count;
        }
        assert!(pixels > 2 * 160 * 120 * 8 / 10, "{lens}: only {pixels} px are covered");
    }
}

#[test]
fn a_wide_photo_becomes_the_faces_that_it_covers() {
    let world = World::new(Preset::Simple, 0);
    let folder = tempfile::tempdir().expect("a folder");
    let lens = "OPENCV_FISHEYE".parse().expect("a lens");
    let dataset = read(folder.path(), &options(lens, Some(170)));
    let names: Vec<&str> = dataset.train.iter().map(|view| view.name.as_str()).collect();
    let faces = ["front", "right", "left", "up", "down"].map(|face| format!("000.{face}.png"));
    assert!(faces.iter().all(|face| names.contains(&face.as_str())) && names.len() == 10, "{names:?}");
    for view in &dataset.train {
        let (psnr, same, count) = compared(&world, view);
        assert!(psnr > 22.0 && same > 0.97 && count > 0, "{}: {psnr} dB, {same}", view.name);
        let Camera { cx, cy, width, height, .. } = view.camera;
        assert!((0.0..=f64::from(width)).contains(&cx) && (0.0..=f64::from(height)).contains(&cy));
    }
    // A photo and its faces are held out together.
    let load = LoadOptions { test_every: Some(2), ..LoadOptions::default() };
    let split = labelgs_scenes::open(folder.path(), &load).expect("read");
    assert!(split.test.len() == 5 && split.test.iter().all(|view| view.name.starts_with("000.")));
}

/// A pinhole view with the photo's focal lengths would end at 51 degrees from the axis.
#[test]
fn a_wide_polynomial_shows_all_that_the_photo_has() {
    let world = World::new(Preset::Simple, 0);
    for (fov, views) in [(40, 1), (105, 1), (130, 5)] {
        let folder = tempfile::tempdir().expect("a folder");
        let dataset = read(folder.path(), &options("OPENCV".parse().expect("a lens"), Some(fov)));
        let of_first: Vec<_> = dataset.train.iter().filter(|view| view.name.starts_with("000.")).collect();
        assert_eq!(of_first.len(), views, "{fov} degrees");
        let Camera { fx, width, .. } = of_first[0].camera;
        let shown = 2.0 * (f64::from(width) / 2.0 / fx).atan().to_degrees();
        assert!(views > 1 || shown > 0.95 * f64::from(fov), "{shown} of {fov} degrees");
        for view in of_first {
            let (psnr, same, _) = compared(&world, view);
            assert!(psnr > 34.0 && same > 0.99, "{fov} degrees, {}: {psnr} dB, {same}", view.name);
        }
    }
}

/// Masks made for views are mapped back to their photos.
#[test]
fn ids_return_to_the_photo() {
    for (name, fov) in [("OPENCV_FISHEYE", 170), ("FOV", 80), ("EQUIRECTANGULAR", 90)] {
        let folder = tempfile::tempdir().expect("a folder");
        let options = options(name.parse().expect("a lens"), Some(fov));
        let dataset = read(folder.path(), &options);
        let stored = labelgs_masks::read_mask(folder.path().join("masks/000.png")).expect("a mask");
        let windows = windows(folder.path(), &labelgs_scenes::Lookup::default()).expect("windows");
        let of_photo = dataset.train.iter().filter(|view| view.name.starts_with("000."));
        let masks: Vec<_> =
            of_photo.map(|view| (&windows[&view.name], view.mask().expect("read").expect("a mask"))).collect();
        let views: Vec<(&Window, &LabelMap)> = masks.iter().map(|(window, mask)| (*window, &**mask)).collect();
        let back = ids_of_photo(&views).expect("ids");
        assert_eq!((back.width, back.height), (stored.width, stored.height));
        let covered = back.ids.iter().zip(&stored.ids).filter(|(_, id)| **id != 0).count();
        let same = back.ids.iter().zip(&stored.ids).filter(|(found, id)| **id != 0 && found == id).count();
        assert!(same as f64 > 0.95 * covered as f64, "{name}: {same} of {covered}");
    }
}

/// The observations of a synthetic scene fit its lens, as `labelgs check` finds.
#[test]
fn observed_points_are_where_the_lens_shows_them() {
    for name in ["THIN_PRISM_FISHEYE", "EQUIRECTANGULAR", "OPENCV"] {
        let folder = tempfile::tempdir().expect("a folder");
        let dataset = read(folder.path(), &options(name.parse().expect("a lens"), None));
        let report = labelgs_scenes::capture::scan(folder.path(), &labelgs_scenes::Lookup::default(), &dataset)
            .expect("scanned");
        let error = report.reprojection.expect("observations");
        // Points have an error of 0.15 % of their distance.
        assert!(error < 1.0, "{name}: {error} px");
        let photos: BTreeSet<_> = report.views.iter().map(|view| view.name.split('.').next()).collect();
        assert_eq!(report.photos, photos.len(), "{name}: faces of a photo are one");
        assert_eq!(report.views.len() > report.photos, name == "EQUIRECTANGULAR", "{name}");
    }
}

#[test]
fn photographs_show_nothing_beyond_the_lens() {
    let world = World::new(Preset::Simple, 0);
    let folded = Fisheye { radial: [-1.0, 0.0, 0.0, 0.0], ..Fisheye::default() };
    let (rgb, ids) = trace_photo(&world, &Optics::new(camera(20, 16, 6.0), Lens::Fisheye(folded)), 0);
    assert_eq!((rgb[0], ids[0]), ([0; 3], 0));
    assert_ne!(rgb[8 * 20 + 10], [0; 3]);
}
