//! Tables of the benchmark.

use super::errors::Errors;
use super::measure::SceneResult;
use super::modes::Mode;
use crate::measure::table;
use labelgs::pass::Stage;

/// Stages with a column of their own.
const COLUMN_STAGES: [Stage; 7] = [
    Stage::PROJECT,
    Stage::SORT,
    Stage::TILE,
    Stage::BLEND_FORWARD,
    Stage::BLEND_BACKWARD,
    Stage::GATHER,
    Stage::PROJECT_BACKWARD,
];

/// Prints the legend of the columns, and the numbered modes.
pub fn legend(modes: &[Mode]) {
    println!(
        "times by those of the default, medians of the rounds' ratios: `passes` of all stages but loss and report, `CPU` \
         processor\ntime of the whole step\n\
         errors of colours `C` (absolute) and gradients `G` (of the worst group of parameters, by the largest magnitude, \
         relative,\nby the norm), against the same rules and, with `*`, against no cut-offs"
    );
    for (number, mode) in modes.iter().enumerate() {
        println!("{number:>2} {:<12}{}", mode.name, mode.about);
    }
}

/// Prints all results of a scene.
pub fn scene(scene: &SceneResult) {
    let (width, height) = scene.size;
    println!(
        "\n{}: {}; {} Gaussians, {width} x {height} px, {} splats, {} pairs; {} rounds, load {:.2}",
        scene.name,
        scene.about,
        scene.gaussians,
        scene.splats,
        scene.pairs,
        scene.rounds,
        scene.load.unwrap_or(f64::NAN),
    );
    let mut times = vec![vec![String::new(), "passes".to_owned(), "CPU".to_owned()]];
    times[0].extend(COLUMN_STAGES.map(|stage| format!("{} ms", stage.name)));
    times[0].push("instances".to_owned());
    let names = ["C max", "C 99.9%", "C rms", "G max", "G 99.9%", "G norm"];
    let mut errors = vec![vec![String::new()]];
    errors[0].extend(names.iter().map(|name| (*name).to_owned()));
    errors[0].extend(names.iter().map(|name| format!("{name} *")));
    for mode in &scene.modes {
        let cpu = mode.relative_cpu.map_or("-".to_owned(), |cpu| format!("{cpu:.3}"));
        let mut row = vec![mode.name.to_owned(), format!("{:.3}", mode.relative_median), cpu];
        row.extend(COLUMN_STAGES.map(|stage| format!("{:.2}", mode.stages.get(stage.name).unwrap_or(&0.0))));
        row.push(mode.instances.to_string());
        times.push(row);
        let open = numbers(&mode.against_no_cut_offs);
        errors.push([vec![mode.name.to_owned()], numbers(&mode.against_rules), open].concat());
    }
    errors.push([vec!["default, rounding".to_owned()], numbers(&scene.rounding)].concat());
    println!("{}\n{}", table(&times), table(&errors));
    println!(
        "rounding: alone, in {} pixels and {} Gaussians with no decision near",
        scene.rounding.pixels, scene.rounding.rows
    );
}

fn numbers(errors: &Errors) -> Vec<String> {
    let (c, g) = (errors.colours, errors.gradients.worst);
    [c.max, c.p999, c.rms, g.max, g.p999, g.rms].map(|value| format!("{value:.1e}")).to_vec()
}
