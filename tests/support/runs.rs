//! Runs of the program on a small scene, and the files of such runs.

use assert_cmd::Command;
use labelgs::formats::read_model;
use labelgs::records::checkpoint_folder::{self, CheckpointFile};
use labelgs::train::state::TrainState;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Child, Output, Stdio};

const SETTINGS: &str = "
iterations = 40
strategy = \"adc\"
start_size = 1.0
checkpoint_every = 4
preview_every = 7
label_from = 4
vote_every = 12
occlusion_every = 15
sh_degree_interval = 6
densify_from = 5
densify_interval = 8
densify_grad_threshold = 1e-4
opacity_reset_interval = 20
opacity_reset_margin = 10
";

/// A scene, and a folder for compiled pipelines, which make starts quick.
pub struct Place {
    folder: tempfile::TempDir,
    environment: Vec<(&'static str, String)>,
}

impl Place {
    /// Makes the scene.
    pub fn new() -> Self {
        Self::on(Vec::new())
    }

    /// The same for another driver, which these environment variables choose.
    pub fn on(environment: Vec<(&'static str, String)>) -> Self {
        let place = Self { folder: tempfile::tempdir().expect("a folder"), environment };
        let scene = place.text("scene");
        let made = ["synth", &scene, "--preset", "simple", "--size", "64x48", "--views", "6", "--points", "200"];
        assert!(place.labelgs(&made).status.success());
        std::fs::write(place.path("settings.toml"), SETTINGS).expect("settings");
        place
    }

    /// Chooses another driver, or other features of it, from now on.
    pub fn choose(&mut self, environment: &[(&'static str, &str)]) {
        self.environment = environment.iter().map(|&(name, value)| (name, value.to_owned())).collect();
    }

    /// A path in the folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// The same as text.
    pub fn text(&self, name: &str) -> String {
        self.path(name).to_str().expect("UTF-8").to_owned()
    }

    /// Runs the tool.
    pub fn labelgs(&self, args: &[&str]) -> Output {
        self.faulty(args, None)
    }

    /// Runs the program with an injected fault (`src/scene/lab/fault.rs`).
    pub fn faulty(&self, args: &[&str], fault: Option<&str>) -> Output {
        let mut command = Command::cargo_bin("labelgs").expect("the tool is built");
        command.env("LABELGS_VALIDATION", "off").env("LABELGS_CACHE", self.path("cache"));
        command.envs(self.environment.iter().cloned());
        if let Some(fault) = fault {
            command.env("LABELGS_FAULT", fault);
        }
        command.args(args).output().expect("it runs")
    }

    /// A run in the folder `out` with further flags.
    pub fn train(&self, out: &str, flags: &[&str]) -> Vec<String> {
        let typed = ["train", &self.text("scene"), "-o", &self.text(out), "--masks", &self.text("scene/masks")];
        typed.iter().chain(flags).map(|&part| part.to_owned()).collect()
    }

    /// Runs it.
    pub fn trained(&self, out: &str, flags: &[&str]) -> Output {
        self.trained_with(None, out, flags)
    }

    /// Runs it with a fault.
    pub fn trained_with(&self, fault: Option<&str>, out: &str, flags: &[&str]) -> Output {
        let args = self.train(out, flags);
        self.faulty(&args.iter().map(String::as_str).collect::<Vec<_>>(), fault)
    }

    /// Starts the tool.
    pub fn spawned(&self, args: &[String]) -> Child {
        self.spawned_with(None, args)
    }

    /// Starts it with a fault.
    pub fn spawned_with(&self, fault: Option<&str>, args: &[String]) -> Child {
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_labelgs"));
        command.env("LABELGS_VALIDATION", "off").env("LABELGS_CACHE", self.path("cache")).args(args);
        command.envs(self.environment.iter().cloned()).envs(fault.map(|fault| ("LABELGS_FAULT", fault)));
        command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("it runs")
    }

    /// The file of settings.
    pub fn settings(&self) -> String {
        self.text("settings.toml")
    }

    /// Checkpoints, the newest first.
    pub fn checkpoints(&self, out: &str) -> Vec<CheckpointFile> {
        checkpoint_folder::list(&self.path(out)).expect("a list")
    }

    /// The history of a run without its times.
    pub fn history(&self, out: &str) -> Vec<serde_json::Value> {
        history(&self.path(out))
    }

    /// Bytes of the model of a step.
    pub fn model(&self, out: &str, step: u32) -> Vec<u8> {
        let path = self.path(out).join(format!("point_cloud/iteration_{step}/point_cloud.ply"));
        std::fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
    }
}

/// The history of a run that has ended, without its times.
pub fn history(out: &Path) -> Vec<serde_json::Value> {
    let text = std::fs::read_to_string(out.join("history.jsonl")).expect("a history");
    assert!(text.ends_with('\n'), "a run that has ended leaves whole lines");
    let mut lines = lines(&text).expect("JSON");
    for line in &mut lines {
        let line = line.as_object_mut().expect("an object");
        line.retain(|key, _| !["ms", "seconds"].contains(&key.as_str()));
    }
    lines
}

/// Standard error as text.
pub fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[track_caller]
pub fn succeeded(output: &Output) -> String {
    assert_eq!(output.status.code(), Some(0), "{}", stderr(output));
    stderr(output)
}

/// All files below a folder.
pub fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    entries.flat_map(|path| if path.is_dir() { files(&path) } else { vec![path] }).collect()
}

/// Bytes of the files below a folder that are wanted, by their path in it.
pub fn contents(folder: &Path, wanted: impl Fn(&PathBuf) -> bool) -> BTreeMap<PathBuf, Vec<u8>> {
    let bytes = |path: &Path| std::fs::read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let named = |path: PathBuf| (path.strip_prefix(folder).expect("inside").to_owned(), bytes(&path));
    files(folder).into_iter().filter(wanted).map(named).collect()
}

/// Copies all files below a folder to another one.
pub fn copy(from: &Path, to: &Path) {
    for path in files(from) {
        let copy = to.join(path.strip_prefix(from).expect("inside"));
        std::fs::create_dir_all(copy.parent().expect("a folder")).expect("a folder");
        std::fs::copy(path, copy).expect("a copy");
    }
}

/// The whole lines of a history.
fn lines(text: &str) -> Result<Vec<serde_json::Value>, String> {
    let whole = text.split_inclusive('\n').filter(|line| line.ends_with('\n'));
    whole.map(|line| serde_json::from_str(line).map_err(|error| error.to_string())).collect()
}

/// Number of kills of a test; `LABELGS_TEST_KILLS` overrides it.
pub fn kills(usual: u32) -> u32 {
    std::env::var("LABELGS_TEST_KILLS").ok().and_then(|kills| kills.parse().ok()).unwrap_or(usual)
}

/// Checks that every file of a killed run can be read, except temporary files.
pub fn all_whole(out: &Path) {
    for path in files(out) {
        let name = path.file_name().expect("a name").to_string_lossy().into_owned();
        if name.starts_with(".labelgs-") {
            continue;
        }
        let read = || std::fs::read_to_string(&path).expect("text");
        let whole = match path.extension().and_then(|extension| extension.to_str()) {
            Some("ckpt") => TrainState::read(&path).map(drop).map_err(|error| error.to_string()),
            Some("ply") => read_model(&path).map(drop).map_err(|error| error.to_string()),
            Some("json") => serde_json::from_str::<serde_json::Value>(&read()).map(drop).map_err(|e| e.to_string()),
            Some("toml") => toml::from_str::<toml::Table>(&read()).map(drop).map_err(|error| error.to_string()),
            // A kill may leave a part of its last line.
            Some("jsonl") => lines(&read()).map(drop),
            Some("html") if read().ends_with("</html>\n") => Ok(()),
            Some("png" | "jpg") => image::open(&path).map(drop).map_err(|error| error.to_string()),
            _ => Err("what is this?".to_owned()),
        };
        whole.unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    }
}
