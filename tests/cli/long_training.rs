//! A long training gives the same bits when repeated, interrupted in the middle, or run on other numbers of threads.

use crate::support::device;
use crate::support::runs::{Place, succeeded};
use std::process::Command;
use std::time::{Duration, Instant};

const STEP_COUNT: u32 = 400;
const MIDDLE_STEP: u32 = 200;

const SETTINGS: &str = "
iterations = 400
strategy = \"adc\"
start_size = 1.0
checkpoint_every = 200
preview_every = 0
label_from = 100
vote_every = 150
occlusion_every = 200
sh_degree_interval = 200
densify_from = 50
densify_until = 350
densify_interval = 50
densify_grad_threshold = 5e-4
opacity_reset_interval = 300
opacity_reset_margin = 100
";

#[test]
fn a_long_training_is_the_same_to_the_last_bit() {
    let Some(turn) = device() else { return };
    let place = Place::new();
    std::fs::write(place.path("long.toml"), SETTINGS).expect("settings");
    let settings = place.text("long.toml");
    let flags = ["--config", &settings];
    let start = Instant::now();
    succeeded(&place.trained("straight", &flags));
    let patience = start.elapsed() * 20 + Duration::from_secs(60);
    let expected = place.model("straight", STEP_COUNT);
    let gaussians = labelgs::formats::read_model(
        place.path(&format!("straight/point_cloud/iteration_{STEP_COUNT}/point_cloud.ply")),
    );
    let gaussians = gaussians.expect("a model").gaussians;
    let labelled = gaussians.labels.as_ref().map_or(0, |labels| labels.iter().filter(|&&id| id > 0).count());
    assert!(gaussians.len() > 300 && labelled > 100, "{} Gaussians, {labelled} of them labelled", gaussians.len());

    // Killed after the checkpoint in the middle.
    let mut child = place.spawned(&place.train("killed", &flags));
    let start = Instant::now();
    while place.checkpoints("killed").is_empty() && child.try_wait().expect("a child").is_none() {
        assert!(start.elapsed() < patience, "no checkpoint");
        std::thread::sleep(Duration::from_millis(5));
    }
    child.kill().expect("killed or done");
    child.wait().expect("a child");
    assert_eq!(place.checkpoints("killed").first().map(|found| found.step), Some(MIDDLE_STEP));
    succeeded(&place.trained("killed", &["--resume"]));
    assert!(place.model("killed", STEP_COUNT) == expected, "killed and resumed: another model");

    if !turn.is_cpu() {
        return;
    }
    // The number of threads is lavapipe's.
    for threads in ["1", "5"] {
        let out = format!("threads-{threads}");
        let mut command = Command::new(env!("CARGO_BIN_EXE_labelgs"));
        command
            .env("LP_NUM_THREADS", threads)
            .env("LABELGS_VALIDATION", "off")
            .env("LABELGS_CACHE", place.path("cache"));
        command.args(place.train(&place.text(&out), &flags));
        succeeded(&command.output().expect("it runs"));
        assert!(place.model(&out, STEP_COUNT) == expected, "{threads} threads: another model");
    }
}
