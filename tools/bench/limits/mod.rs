//! How close each stage of a step comes to the device's limit.
//!
//! The limit of a stage is the larger of two times: its arithmetic divided by the arithmetic rate, and its bytes
//! divided by the copy rate, both measured in the same run. The time of empty dispatches is added. The counts are lower
//! bounds: the work of the method, not of the kernels, and without labels.

mod ceilings;

use super::measure::{self, median, table};
use super::pace::{Pace, race};
use super::trained::{TEST_EVERY, plain_model};
use super::{Common, device};
use ceilings::Ceilings;
use labelgs::Result;
use labelgs::pass::{KernelShape, Stage};
use labelgs::synth::{self, SynthOptions};
use serde_json::{Value, json};

/// Work of a stage.
#[derive(Clone, Copy, Default)]
struct Requirement {
    /// Multiplications and additions.
    operations: f64,
    exp2: f64,
    divisions: f64,
    /// Bytes read and written.
    bytes: f64,
}

impl Requirement {
    /// Returns the minimum time, seconds.
    fn seconds(self, c: &Ceilings) -> f64 {
        let arithmetic = self.operations / c.operations + self.exp2 / c.exp2 + self.divisions / c.divisions;
        arithmetic.max(self.bytes / c.bytes)
    }
}

/// Counts of a step.
struct Step {
    gaussians: f64,
    splats: f64,
    instances: f64,
    pairs: f64,
    pixels: f64,
    tiles: u32,
}

/// vec4 of the colour coefficients above degree 0, at degree 3: 45 floats.
const SH_VECS: f64 = 45.0 / 4.0;

/// Returns the work of each stage of a step, for colours of degree 3.
fn need(stage: Stage, s: &Step, digit_bits: u32) -> Requirement {
    let passes = |bits: u32| f64::from(bits.div_ceil(digit_bits));
    let tile_bits = u32::BITS - s.tiles.saturating_sub(1).leading_zeros();
    let vec4 = 16.0;
    match stage {
        // Means and scales of all; all planes in, three records out of the visible.
        Stage::PROJECT => Requirement {
            operations: 40.0 * s.gaussians + 280.0 * s.splats,
            bytes: (2.0 * vec4 + 8.0) * s.gaussians + ((7.0 + SH_VECS) * vec4 + 8.0) * s.splats,
            ..Requirement::default()
        },
        // A pass reads the keys twice and keys and values once, and writes both.
        Stage::SORT => Requirement {
            bytes: 20.0 * (passes(32) * s.splats + passes(tile_bits) * s.instances),
            ..Requirement::default()
        },
        Stage::TILE => Requirement {
            operations: 35.0 * s.instances,
            bytes: (3.0 * vec4 + 8.0) * s.splats + 8.0 * s.instances,
            ..Requirement::default()
        },
        // Exponent 6, weight and transmittance 3, colour 6 (method of 3DGS in base 2).
        Stage::BLEND_FORWARD => Requirement {
            operations: 15.0 * s.pairs,
            exp2: s.pairs,
            bytes: (3.0 * vec4 + 8.0) * s.instances + 20.0 * s.pixels,
            ..Requirement::default()
        },
        // Exponent 6, transmittance 1, light 6, gradient of alpha 4, three moments 5, colour 6.
        Stage::BLEND_BACKWARD => Requirement {
            operations: 28.0 * s.pairs,
            exp2: s.pairs,
            divisions: s.pairs,
            bytes: (6.0 * vec4 + 8.0) * s.instances + 52.0 * s.pixels,
        },
        // Two windows of 11 taps along both axes: over four moments and over three derivatives, three channels.
        Stage::LOSS => Requirement {
            operations: s.pixels * 3.0 * (2.0 * 2.0 * 11.0 * (4.0 + 3.0) + 30.0),
            bytes: 2.0 * (vec4 + 4.0) * s.pixels + 3.0 * 3.0 * 2.0 * vec4 * s.pixels + vec4 * s.pixels,
            ..Requirement::default()
        },
        Stage::GATHER => Requirement { bytes: 3.0 * vec4 * (s.instances + s.splats), ..Requirement::default() },
        // Coefficients in, and the gradients of them and of their directions out.
        Stage::PROJECT_BACKWARD => Requirement {
            operations: 700.0 * s.splats,
            bytes: (11.0 + 2.0 * SH_VECS) * vec4 * s.splats,
            ..Requirement::default()
        },
        // All planes of parameters with two moments, read and written, and the gradients of the visible.
        Stage::OPTIMISE => Requirement {
            operations: 12.0 * 4.0 * (4.0 + SH_VECS) * s.gaussians,
            bytes: (4.0 + SH_VECS) * vec4 * (6.0 * s.gaussians + s.splats),
            ..Requirement::default()
        },
        _ => Requirement::default(),
    }
}

/// Runs the benchmark.
pub fn run(common: &Common) -> Result<()> {
    let (options, training, timed) = if common.small {
        (SynthOptions { width: 48, height: 40, views: 9, ..Default::default() }, 20, 2)
    } else {
        (SynthOptions::default(), 1500, 60)
    };
    let gpu = device::open()?;
    let shape = KernelShape::for_device(gpu.capabilities());
    let c = ceilings::measure(&gpu, shape.texel, common.small)?;
    println!("{}\n{}", gpu.capabilities().name, c.to_text());
    let model = plain_model(&gpu, &options, training)?;
    let dataset = synth::dataset(&options, TEST_EVERY);
    let mut paces = [Pace::new("step", &gpu, dataset, &model)?];
    race(&mut paces, timed)?;
    let [pace] = &mut paces;
    let (about, found) = pace.about();
    let (tiles_x, tiles_y) = shape.tiles(options.width, options.height);
    let step = Step {
        gaussians: model.len() as f64,
        splats: pace.median(|report| f64::from(report.report.counters.visible_count)),
        instances: pace.median(|report| f64::from(report.report.counters.instance_count)),
        pairs: median(pace.pairs()),
        pixels: f64::from(options.width) * f64::from(options.height),
        tiles: tiles_x * tiles_y,
    };
    println!("{about}; load {:.1}\n", measure::load().unwrap_or(f64::NAN));
    let mut rows = vec![["stage", "ms", "limit ms", "fraction"].map(str::to_owned).to_vec()];
    let mut stages: Vec<Value> = Vec::new();
    let (mut all, mut limits) = (0.0, 0.0);
    for (stage, times) in &pace.stages {
        let (ms, limit) = (median(times.iter().copied()), need(*stage, &step, shape.digit_bits).seconds(&c) * 1e3);
        (all, limits) = (all + ms, limits + limit);
        stages.push(json!({ "stage": stage.name, "ms": ms, "limit_ms": limit }));
        rows.push(vec![stage.name.to_owned(), format!("{ms:.2}"), format!("{limit:.2}"), format!("{:.2}", limit / ms)]);
    }
    let dispatches = pace.items as f64 * c.dispatch * 1e3;
    rows.push(vec![format!("{} dispatches", pace.items), String::new(), format!("{dispatches:.2}"), String::new()]);
    let limits = limits + dispatches;
    rows.push(vec!["step".to_owned(), format!("{all:.2}"), format!("{limits:.2}"), format!("{:.2}", limits / all)]);
    println!("{}", table(&rows));
    measure::write_json(
        &common.output.join("limits.json"),
        &json!({ "schema_version": 2, "ceilings": c, "step": found, "stages": stages, "dispatches": pace.items,
            "passes_ms": all, "pipeline_ms": median(pace.wall.iter().copied()), "limit_ms": limits }),
    )
}
