//! Tables for people.

use super::errors::Errors;
use super::knee;
use super::measure::SceneResult;
use super::modes::Mode;
use std::fmt::Write;

/// All of a scene.
pub fn scene(scene: &SceneResult) -> String {
    let mut out = String::new();
    let (width, height) = scene.size;
    // Writing into a String cannot fail.
    let _ = writeln!(
        out,
        "\n{}: {}; {} Gaussians, {width} x {height} px, {} splats, {} instances, {} pairs; {} rounds, load {}",
        scene.name,
        scene.about,
        scene.gaussians,
        scene.splats,
        scene.instances,
        scene.pairs,
        scene.rounds,
        scene.load.map_or("unknown".to_owned(), |load| format!("{load:.2}")),
    );
    modes(&mut out, scene);
    if let Some(rounding) = &scene.rounding {
        let _ = writeln!(out, "default where no decision is near (rounding alone): {}", numbers(Some(rounding)));
    }
    for (name, knee) in knee::all(scene) {
        let _ = writeln!(out, "{name}: {knee}");
    }
    out
}

fn modes(out: &mut String, scene: &SceneResult) {
    let stages = ["project", "sort", "tile", "blend forward", "blend backward", "gather", "project backward"];
    let _ = write!(out, "{:>2} {:<22}{:>7}{:>7}{:>7}{:>9}{:>9}", "", "", "median", "least", "CPU", "ms", "CPU ms");
    for stage in stages {
        let _ = write!(
            out,
            "{:>9}",
            stage.replace("project backward", "proj bwd").replace("blend ", "").replace("ward", ".")
        );
    }
    let _ = writeln!(out, "{:>11} |{:^46}|{:^46}", "instances", "against the rules", "against no cut-offs");
    let heads = format!("{:^22}  {:^22}", "colours max 99.9% rms", "gradients max 99.9% rms");
    let _ = writeln!(out, "{:>134} |{heads:^46}|{heads:^46}", "");
    for (number, mode) in scene.modes.iter().enumerate() {
        let cpu = mode.cpu.map_or("-".to_owned(), |cpu| format!("{:.1}", cpu.median));
        let relative = mode.relative_cpu.map_or("-".to_owned(), |cpu| format!("{cpu:.3}"));
        let _ = write!(
            out,
            "{number:>2} {:<22}{:>7.3}{:>7.3}{relative:>7}{:>9.2}{cpu:>9}",
            mode.name, mode.relative_median, mode.relative_least, mode.touched.median
        );
        for stage in stages {
            let _ = write!(out, "{:>9.2}", mode.stages.get(stage).map_or(0.0, |time| time.median));
        }
        let (rules, open) = (numbers(mode.against_rules.as_ref()), numbers(mode.against_no_cut_offs.as_ref()));
        let _ = writeln!(out, "{:>11} | {rules} | {open}", mode.instances);
    }
}

fn numbers(errors: Option<&Errors>) -> String {
    let Some(errors) = errors else { return "-".to_owned() };
    let (c, g) = (errors.colours, errors.gradients.worst);
    format!("{:.1e} {:.1e} {:.1e}  {:.1e} {:.1e} {:.1e}", c.max, c.p999, c.rms, g.max, g.p999, g.rms)
}

/// What the numbers before the modes and the charts' points mean.
pub fn legend(modes: &[Mode]) -> String {
    let mut out = String::from(
        "median: time of project, sort, tile, blend and gather by that of the default in the same round; least: by the \
         least times of their passes; CPU: processor time of the whole step\nerrors: absolute for colours; worst group of parameters for gradients: largest by the largest \
         magnitude, relative, norm by norm\n",
    );
    for (number, mode) in modes.iter().enumerate() {
        let _ = writeln!(out, "{number:>2} {:<22}{}", mode.name, mode.about);
    }
    out
}

/// Each pass alone, all scenes side by side.
pub fn passes(scenes: &[SceneResult]) -> String {
    let mut out = String::from("\neach pass alone, default mode (median ms of all its runs in a step; ns an item)\n");
    let sized: Vec<&SceneResult> = scenes.iter().filter(|scene| scene.name.starts_with('S')).collect();
    let Some(first) = sized.first() else { return out };
    let _ = write!(out, "{:<18}{:<26}{:>5} {:<9}", "stage", "pass", "runs", "item");
    for scene in &sized {
        let _ = write!(out, "{:>10} ms{:>10} ns", scene.name, "");
    }
    let _ = writeln!(out);
    for (index, row) in first.passes.iter().enumerate() {
        let _ = write!(out, "{:<18}{:<26}{:>5} {:<9}", row.stage, row.name, row.runs, row.unit);
        for scene in &sized {
            if let Some(row) = scene.passes.get(index) {
                let _ = write!(out, "{:>13.3}{:>13.2}", row.time.median, row.ns_per_item);
            }
        }
        let _ = writeln!(out);
    }
    out
}
