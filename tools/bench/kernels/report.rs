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
    times(&mut out, scene);
    if scene.rounding.is_some() {
        errors(&mut out, scene);
    }
    if let Some(rounding) = &scene.rounding {
        let _ = writeln!(
            out,
            "default, {} pixels and {} Gaussians with no decision near (rounding alone):{}",
            rounding.pixels,
            rounding.rows,
            numbers(Some(rounding))
        );
    }
    // The other scenes ask what breaks, not what pays.
    if scene.name.starts_with('S') {
        for (name, knee) in knee::all(scene) {
            let _ = writeln!(out, "{name}: {knee}");
        }
    }
    out
}

/// Columns of the times.
const STAGES: [(&str, &str); 7] = [
    ("project", "project"),
    ("sort", "sort"),
    ("tile", "tile"),
    ("blend forward", "forward"),
    ("blend backward", "backward"),
    ("gather", "gather"),
    ("project backward", "proj bwd"),
];

fn times(out: &mut String, scene: &SceneResult) {
    let _ = write!(out, "{:25}{:>7}{:>7}{:>7}{:>9}{:>9}", "", "median", "least", "CPU", "ms", "CPU ms");
    for (_, head) in STAGES {
        let _ = write!(out, "{head:>10}");
    }
    let _ = writeln!(out, "{:>11}", "instances");
    for (number, mode) in scene.modes.iter().enumerate() {
        let cpu = mode.cpu.map_or("-".to_owned(), |cpu| format!("{:.1}", cpu.median));
        let relative = mode.relative_cpu.map_or("-".to_owned(), |cpu| format!("{cpu:.3}"));
        let _ = write!(
            out,
            "{number:>2} {:<22}{:>7.3}{:>7.3}{relative:>7}{:>9.2}{cpu:>9}",
            mode.name, mode.relative_median, mode.relative_least, mode.touched.median
        );
        for (stage, _) in STAGES {
            let _ = write!(out, "{:>10.2}", mode.stages.get(stage).map_or(0.0, |time| time.median));
        }
        let _ = writeln!(out, "{:>11}", mode.instances);
    }
}

fn errors(out: &mut String, scene: &SceneResult) {
    let _ = writeln!(out, "{:25}{:^54}|{:^54}", "", "against the same rules", "against no cut-offs");
    let _ = write!(out, "{:25}", "");
    for end in ["|", ""] {
        let _ = write!(out, "{:^27}{:^27}{end}", "colours: max 99.9% rms", "gradients: max 99.9% norm");
    }
    let _ = writeln!(out);
    for (number, mode) in scene.modes.iter().enumerate() {
        let (rules, open) = (numbers(mode.against_rules.as_ref()), numbers(mode.against_no_cut_offs.as_ref()));
        let _ = writeln!(out, "{number:>2} {:<22}{rules}|{open}", mode.name);
    }
}

fn numbers(errors: Option<&Errors>) -> String {
    let Some(errors) = errors else { return String::new() };
    let (c, g) = (errors.colours, errors.gradients.worst);
    [c.max, c.p999, c.rms, g.max, g.p999, g.rms].map(|value| format!("{value:>9.1e}")).concat()
}

/// What the columns mean, and the modes behind the numbers of the charts.
pub fn legend(modes: &[Mode]) -> String {
    let mut out = String::from(
        "times by those of the default: `median` of the rounds' ratios of all stages but loss and report, `least` by the \
         sums of\nthe least times of the passes, `CPU` processor time of the whole step\n\
         errors: absolute for colours; for gradients those of the worst group of parameters: largest by the largest \
         magnitude,\n99.9 % of the relative errors, norm by norm\n",
    );
    for (number, mode) in modes.iter().enumerate() {
        let _ = writeln!(out, "{number:>2} {:<22}{}", mode.name, mode.about);
    }
    out
}

/// Each pass alone, all scenes side by side.
pub fn passes(scenes: &[SceneResult]) -> String {
    let mut out =
        String::from("\neach pass alone, default mode: ms of all its runs in a step, and ns an item (median)\n");
    let sized: Vec<&SceneResult> = scenes.iter().filter(|scene| scene.name.starts_with('S')).collect();
    let Some(first) = sized.first() else { return out };
    let _ = write!(out, "{:<18}{:<24}{:<9}", "stage", "pass", "item");
    for scene in &sized {
        let _ = write!(out, "{:>7} median{:>10}{:>12}", scene.name, "least", "ns/item");
    }
    let _ = writeln!(out);
    for row in &first.passes {
        let _ = write!(out, "{:<18}{:<24}{:<9}", row.stage, row.name, row.unit);
        for scene in &sized {
            if let Some(row) = scene.passes.iter().find(|other| (other.stage, &other.name) == (row.stage, &row.name)) {
                let _ = write!(out, "{:>14.3}{:>10.3}{:>12.2}", row.time.median, row.time.min, row.ns_per_item);
            }
        }
        let _ = writeln!(out);
    }
    out
}
