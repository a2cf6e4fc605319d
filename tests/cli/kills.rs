//! Commands other than `train`, killed while they write: all files are complete, and a second run writes the same.

use crate::support::device;
use crate::support::runs::{Place, all_whole, contents, kills, succeeded};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg32;
use std::collections::BTreeMap;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Kills of each command.
const KILL_COUNT: u32 = 3;

/// Bytes of all files below a folder, without temporary files.
fn results(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    contents(folder, |path| path.extension().is_none_or(|extension| extension != "tmp"))
}

#[test]
fn exports_may_be_killed_at_any_moment() {
    let Some(_turn) = device() else { return };
    let place = Place::new();
    succeeded(&place.trained("run", &["--iterations", "12", "--set", "label_from=2"]));
    let (run, scene, masks) = (place.text("run"), place.text("scene"), place.text("scene/masks"));
    let model = place.text("run/point_cloud/iteration_12/point_cloud.ply");
    let out = place.text("out");
    let file = |name: &str| format!("{out}/{name}");
    let commands: [(Vec<&str>, String); 5] = [
        (vec!["label", &model, "--scene", &scene, "--masks", &masks, "-o"], file("all.ply")),
        // After 12 steps no label is sure.
        (vec!["extract", &model, "--labels", "1", "--min-confidence", "0", "-o"], file("part.ply")),
        (vec!["remove", &model, "--labels", "1", "-o"], file("rest.ply")),
        (vec!["render", &run, "--scene", &scene, "--views", "all", "--what", "rgb,labels", "-o"], out.clone()),
        (vec!["eval", &run, "--scene", &scene, "--masks", &masks, "--json"], file("scores.json")),
    ];
    let kills = kills(KILL_COUNT);
    let mut random = Pcg32::seed_from_u64(u64::from(kills));
    for (args, to) in commands {
        let name = args[0];
        let args: Vec<String> = args.iter().map(|part| (*part).to_owned()).chain([to]).collect();
        let words: Vec<&str> = args.iter().map(String::as_str).collect();
        std::fs::create_dir_all(&out).expect("a folder");
        succeeded(&place.labelgs(&words));
        let start = Instant::now();
        succeeded(&place.labelgs(&words));
        let took = start.elapsed();
        let right = results(&place.path("out"));
        assert!(!right.is_empty(), "{name} writes nothing");
        let (mut killed, mut started) = (0, 0);
        while killed < kills {
            // Half of the kills hit a run that replaces existing files.
            if started % 2 == 0 {
                std::fs::remove_dir_all(&out).and_then(|()| std::fs::create_dir(&out)).expect("an empty folder");
            }
            let mut child = place.spawned(&args);
            std::thread::sleep(took.mul_f64(random.random_range(0.3..1.0)));
            child.kill().expect("killed or done");
            killed += u32::from(child.wait().expect("a child").signal().is_some());
            started += 1;
            assert!(started < 20 * kills, "{name} is done before it can be killed");
            all_whole(&place.path("out"));
            assert!(results(&place.path("out")).iter().all(|(path, bytes)| right.get(path) == Some(bytes)), "{name}");
        }
        succeeded(&place.labelgs(&words));
        assert!(results(&place.path("out")) == right, "{name}: other files than without kills");
        std::fs::remove_dir_all(&out).expect("removed");
    }
    println!("{kills} kills of each export");
}
