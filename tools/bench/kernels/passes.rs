//! Each pass alone: what the passes of a step take, and per item.

use super::bed::Sample;
use super::scenes::Plan;
use crate::measure::{Spread, spread};
use labelgs::pass::Stage;
use labelgs::shaders::structs::Counters;
use serde::Serialize;

/// A pass of a step; passes of one name, as those of a sort, are added up.
#[derive(Clone, Debug, Serialize)]
pub struct PassRow {
    /// Stage of the step.
    pub stage: &'static str,
    /// Name of the pass.
    pub name: String,
    /// Runs of it in a step.
    pub runs: usize,
    /// Milliseconds of all its runs in a step.
    pub time: Spread,
    /// What it works on.
    pub unit: &'static str,
    /// How many of these there are.
    pub items: u64,
    /// Nanoseconds an item, all runs.
    pub ns_per_item: f64,
}

/// The passes in the order of the step.
pub fn rows_of(samples: &[Sample], plan: &Plan, counters: &Counters, tile_pixels: u32) -> Vec<PassRow> {
    let Some(first) = samples.first() else { return Vec::new() };
    let mut names: Vec<(Stage, &str)> = Vec::new();
    for (stage, name, _) in &first.items {
        if !names.contains(&(*stage, name)) {
            names.push((*stage, name));
        }
    }
    let row = |(stage, name): (Stage, &str)| {
        let is = |item: &&(Stage, String, u64)| item.0 == stage && item.1 == name;
        let ms = |sample: &Sample| sample.items.iter().filter(is).map(|item| item.2 as f64 * 1e-6).sum();
        let time = spread(samples.iter().map(ms).collect());
        let (unit, items) = items_of(stage, name, plan, counters, tile_pixels);
        PassRow {
            stage: stage.name(),
            name: name.to_owned(),
            runs: first.items.iter().filter(is).count(),
            time,
            unit,
            items,
            ns_per_item: time.median * 1e6 / items.max(1) as f64,
        }
    };
    names.into_iter().map(row).collect()
}

/// What a pass works on.
fn items_of(stage: Stage, name: &str, plan: &Plan, counters: &Counters, tile_pixels: u32) -> (&'static str, u64) {
    let gaussians = ("Gaussian", plan.gaussians as u64);
    let splats = ("splat", u64::from(counters.visible_count));
    let instances = ("instance", u64::from(counters.instance_count));
    let pairs = ("pair", counters.walked_splats() * u64::from(tile_pixels));
    let pixels = u64::from(plan.size.0) * u64::from(plan.size.1);
    match (stage, name) {
        (_, "step_begin" | "prepare_splats" | "prepare_instances" | "prepare_blend" | "scan_spine" | "loss_reduce") => {
            ("step", 1)
        }
        (_, name) if name.starts_with("fill") || name.starts_with("copy") || name.starts_with("radix_scan") => {
            ("step", 1)
        }
        (_, "cull" | "compact" | "scan_reduce_flag" | "scan_apply_flag") => gaussians,
        (_, "tile_ranges") => ("tile", pixels.div_ceil(u64::from(tile_pixels))),
        (_, "emit_instances" | "gather") => instances,
        (Stage::Sort, name) if name.ends_with("by tile") => instances,
        (Stage::Project | Stage::Sort | Stage::ProjectBackward, _) => splats,
        (Stage::BlendForward | Stage::BlendBackward, _) => pairs,
        (Stage::Loss, _) => ("pixel", pixels),
        (Stage::Optimise, _) => gaussians,
        _ => ("step", 1),
    }
}
