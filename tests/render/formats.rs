//! Pictures of a model in every format.

use crate::support::device;
use labelgs::engine::Engine;
use labelgs::formats::{export_model, read_model};
use labelgs::render::{RenderOptions, render};
use labelgs::scene::Gaussians;
use std::fs;

#[path = "../../src/formats/tests/models.rs"]
#[allow(dead_code, reason = "most of it is for round trips")]
mod models;

/// Positions, rotations and harmonics are turned to the axes of each format and back: the picture stays the same, up to
/// the steps of the format. A wrong sign anywhere leaves less than 25 dB here.
#[test]
fn pictures_of_every_format_are_those_of_the_ply() {
    let Some(turn) = device() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let before = models::picture_model();
    let options = labelgs_synth::SynthOptions { views: 5, width: 96, height: 64, ..Default::default() };
    let camera = labelgs_synth::ring_of_cameras(&options)[1].clone();
    let draw = |model: &Gaussians| {
        let mut engine = Engine::for_model(turn.gpu(), model, [(96, 64)]).expect("an engine");
        render(&mut engine, &camera, &RenderOptions::default()).expect("a picture").rgb
    };
    let expected = draw(&before);
    assert!(expected.as_flattened().iter().any(|&value| value > 0.3), "something is drawn");
    for (file, options, _) in models::written() {
        export_model(folder.path().join(file), &before, None, options).expect("written");
        let bytes = fs::metadata(folder.path().join(file)).expect("a file").len() as f64 / before.len() as f64;
        let found = draw(&read_model(folder.path().join(file)).expect("read").gaussians);
        let squares: f64 =
            found.as_flattened().iter().zip(expected.as_flattened()).map(|(a, b)| f64::from(a - b).powi(2)).sum();
        let distance = -10.0 * (squares / (3 * found.len()) as f64).log10();
        println!("{file} {options:?}: {bytes:.1} bytes a Gaussian, {distance:.1} dB from the PLY");
        let least = match &file[2..] {
            "glb" => 80.0,
            "spz" | "html" => 35.0,
            _ => 30.0,
        };
        assert!(distance > least, "{file}: {distance:.1} dB");
    }
}
