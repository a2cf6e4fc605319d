//! How far meshes from a trained model of a synthetic scene are from the true surfaces.

use crate::{device, measure::table};
use glam::DVec3;
use labelgs::Result;
use labelgs::formats::read_model;
use labelgs::render::mesh::{CELLS_DEFAULT, object_mesh};
use labelgs::run::model_file;
use labelgs::scenes::camera_json::views_of_model;
use labelgs::synth::{Preset, World};
use std::{path::PathBuf, time::Instant};

/// Options of the mesh comparison.
#[derive(clap::Args, Clone, Debug)]
pub struct Options {
    /// Folder of a run on a scene of `labelgs synth` with seed 0, with the labels of its masks.
    model: PathBuf,
    /// Objects of the scene.
    #[arg(long, value_enum, default_value = "default")]
    preset: Preset,
    /// Cells along the longest side of an object.
    #[arg(long, default_value_t = CELLS_DEFAULT)]
    cells: u32,
}

/// Prints a row per object: distances of its mesh's vertices from the true surface, in object diagonals.
pub fn run(options: &Options) -> Result<()> {
    let model = read_model(&model_file(&options.model)?)?.gaussians;
    let cameras: Vec<DVec3> = views_of_model(&options.model)?.iter().map(|view| view.camera.centre()).collect();
    let gpu = device::open()?;
    let head = ["object", "triangles", "mean off, %", "9 of 10 within, %", "s"];
    let mut rows = vec![head.map(str::to_owned).to_vec()];
    for object in World::new(options.preset, 0).objects {
        let start = Instant::now();
        let mesh = object_mesh(&gpu, &model, object.id.into(), &cameras, options.cells)?;
        let seconds = start.elapsed().as_secs_f64();
        let places: Vec<DVec3> = mesh.positions.iter().map(|at| DVec3::from_array(at.map(f64::from))).collect();
        let (low, high) = places.iter().fold((DVec3::MAX, DVec3::MIN), |(low, high), &at| (low.min(at), high.max(at)));
        let diagonal = (high - low).length();
        let share = |&at: &DVec3| 100.0 * object.distance_to(mesh.origin + at).abs() / diagonal;
        let mut off: Vec<f64> = places.iter().map(share).collect();
        off.sort_by(f64::total_cmp);
        let mean = off.iter().sum::<f64>() / off.len() as f64;
        rows.push(vec![
            object.name.to_owned(),
            mesh.triangles.len().to_string(),
            format!("{mean:.2}"),
            format!("{:.2}", off[off.len() * 9 / 10]),
            format!("{seconds:.1}"),
        ]);
    }
    println!("{}", table(&rows));
    Ok(())
}
