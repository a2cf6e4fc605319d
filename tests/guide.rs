//! The commands that README.md and the guide show run as they stand, one after the other, in an empty folder. Only the
//! long trainings are cut short, and the made scene is smaller.

use clap::Parser;
use labelgs::cli::command::Cli;
use labelgs::edit::strokes::StrokesFile;
use labelgs::masks::nested::{self, FoundMask};
use std::collections::BTreeSet;
use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Instant;

const REPOSITORY_ROOT: &str = env!("CARGO_MANIFEST_DIR");

/// Steps that every long training of the pages loses.
const STEPS_LESS: u32 = 2980;

/// The line of the guide at which a person runs a tracker of their own.
const TRACKER_COMMENT: &str = "# your tracker reads video/frames/NNNNN.png and writes id images tracked/NNNNN.png";

/// The lines of the boxes of shell commands in a page.
fn commands(page: &Path) -> Vec<String> {
    let text = fs::read_to_string(page).expect("a page");
    let boxes = text.split("\n```").collect::<Vec<_>>();
    let shell = boxes.iter().filter_map(|part| part.strip_prefix("sh\n"));
    let lines = shell
        .flat_map(str::lines)
        .filter(|line| !line.is_empty() && (!line.starts_with('#') || *line == TRACKER_COMMENT));
    lines.map(str::to_owned).collect()
}

/// Pages of the guide, in its order.
fn pages() -> Vec<PathBuf> {
    let folder = Path::new(REPOSITORY_ROOT).join("src/guide");
    let text = fs::read_to_string(folder.join("mod.rs")).expect("the guide");
    let table = text.split("\npages! {").nth(1).expect("the pages");
    let names = table.lines().filter_map(|line| line.trim().split_once(": \"")).map(|(name, _)| name);
    let pages: Vec<PathBuf> = names.map(|name| folder.join(name).with_extension("md")).collect();
    let files = fs::read_dir(&folder).expect("the guide").flatten();
    let written = files.filter(|file| file.path().extension().is_some_and(|ending| ending == "md")).count();
    assert_eq!(pages.len(), written, "a page that the guide does not show");
    pages
}

/// What a tracker would leave: the masks of the photos among the frames, and the last of them for the frames between.
fn track(folder: &Path) {
    let text = fs::read_to_string(folder.join("video/frames.json")).expect("frames.json");
    let frames: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    fs::create_dir(folder.join("tracked")).expect("a new folder");
    let mut mask = None;
    for frame in frames["frames"].as_array().expect("a list") {
        let photo = frame["photo"].as_str().map(|photo| folder.join("scene/masks").join(photo));
        mask = photo.or(mask);
        let file = Path::new(frame["file"].as_str().expect("a file")).file_name().expect("a name").to_owned();
        let ids = mask.as_ref().expect("the first frame is a photo");
        fs::copy(ids, folder.join("tracked").join(file)).expect("a mask per photo");
    }
}

/// What `masks make` would leave with a network: lists of the true masks.
fn segment(folder: &Path) {
    for entry in fs::read_dir(folder.join("scene/masks")).expect("masks").flatten() {
        let path = entry.path();
        if path.extension().is_some_and(|ending| ending == "png") {
            let ids = labelgs::masks::read_mask(&path).expect("ids");
            let mask = |id: u16| FoundMask {
                inside: ids.ids.iter().map(|&found| found == id).collect(),
                score: 0.95,
                stability: 0.95,
            };
            let masks: Vec<FoundMask> = ids.objects().into_iter().map(mask).collect();
            let list = folder.join("made/nested").join(path.file_name().expect("a name")).with_extension("json");
            nested::write(&list, (ids.width, ids.height), &masks).expect("a list");
        }
    }
}

/// The strokes that a page shows, for the smaller scene.
fn stroke(page: &Path, folder: &Path) {
    let text = fs::read_to_string(page).expect("a page");
    let shown = text.split("\n```").filter_map(|part| part.strip_prefix("json\n"));
    let mut files = shown.filter_map(|text| serde_json::from_str::<StrokesFile>(text).ok());
    let mut file = files.next().expect("a file of strokes");
    for point in file.strokes.iter_mut().flat_map(|stroke| &mut stroke.points) {
        *point = point.map(|at| at * 0.3);
    }
    fs::write(folder.join("strokes.json"), serde_json::to_string(&file).expect("JSON")).expect("a file");
}

/// The made scene at three tenths of its size, with fewer photos, and pixels that are named there.
fn shrink(words: &mut Vec<String>) {
    if words[1] == "synth" && !words.iter().any(|word| word == "--size") {
        words.extend(["--size", "96x72", "--views", "12"].map(str::to_owned));
    }
    for at in 1..words.len() {
        if let Some((view, (x, y))) =
            words[at].split_once(':').and_then(|(view, place)| Some((view, place.split_once(',')?)))
            && words[at - 1].ends_with("at")
        {
            let shrunk = |text: &str| text.parse::<u32>().expect("a pixel") * 3 / 10;
            words[at] = format!("{view}:{},{}", shrunk(x), shrunk(y));
        }
    }
}

/// A training's command with fewer steps.
fn shorten(words: &mut Vec<String>) {
    match words.iter().position(|word| word == "--iterations") {
        Some(at) => {
            let steps: u32 = words[at + 1].parse().expect("steps");
            words[at + 1] = if steps > STEPS_LESS { steps - STEPS_LESS } else { steps }.to_string();
        }
        None => words.extend(["--iterations".to_owned(), "20".to_owned()]),
    }
}

/// Runs a viewer until it prints its address.
fn shows(command: &mut Command) {
    let mut child = command.stdout(Stdio::piped()).spawn().expect("it runs");
    let mut line = String::new();
    BufReader::new(child.stdout.take().expect("a pipe")).read_line(&mut line).expect("a line");
    child.kill().expect("it ran until now");
    child.wait().expect("it ends");
    assert!(line.starts_with("http://127.0.0.1:"), "{line}");
}

/// Runs each command of the pages once.
fn run(pages: &[PathBuf]) {
    if crate::support::device().is_none() {
        return;
    }
    let mut done = BTreeSet::new();
    let folder = tempfile::tempdir().expect("a folder");
    for page in pages {
        for line in commands(page) {
            if !done.insert(line.clone()) {
                continue;
            }
            if line == TRACKER_COMMENT {
                track(folder.path());
                continue;
            }
            let typed = line.split(" # ").next().expect("a command").trim();
            let mut words: Vec<String> = typed.split_whitespace().map(str::to_owned).collect();
            if words.iter().any(|word| word == "--network") {
                segment(folder.path());
                continue;
            }
            if words.iter().any(|word| word == "--strokes") {
                stroke(page, folder.path());
            }
            if words[0] != "labelgs" {
                let is_known =
                    words[0] == "cargo" || words.iter().any(|word| Path::new(REPOSITORY_ROOT).join(word).is_file());
                assert!(is_known, "{}: no command is known for: {line}", page.display());
                continue;
            }
            shrink(&mut words);
            if words[1] == "train" {
                shorten(&mut words);
            }
            let mut command = Command::new(env!("CARGO_BIN_EXE_labelgs"));
            command.env("LABELGS_VALIDATION", "off").env("LABELGS_CACHE", folder.path().join("cache"));
            if words[1] == "view" {
                shows(command.args(&words[1..]).current_dir(folder.path()));
                continue;
            }
            let start = Instant::now();
            let output = command.args(&words[1..]).current_dir(folder.path()).output().expect("it runs");
            println!("{:.1} s: {line}", start.elapsed().as_secs_f64());
            let said = String::from_utf8_lossy(&output.stderr);
            // It ends with status 1 where it finds something, as it does on small objects here.
            let is_check =
                words[1] == "masks" && words[2] == "check" || line.contains("check") && line.contains("# finds");
            let is_finding = is_check && output.status.code() == Some(1);
            assert!(output.status.success() || is_finding, "{}: {line}: {}\n{said}", page.display(), output.status);
        }
    }
}

#[test]
fn every_command_of_readme_and_guide_runs() {
    run(&[vec![Path::new(REPOSITORY_ROOT).join("README.md")], pages()].concat());
}

/// Commands in the tables of README, which need files that nobody has here, are commands of the program.
#[test]
fn commands_of_tables_are_understood() {
    let text = fs::read_to_string(Path::new(REPOSITORY_ROOT).join("README.md")).expect("README.md");
    let rows = text.lines().filter(|line| line.starts_with("| "));
    let commands: Vec<&str> = rows.flat_map(|row| row.split('`').filter(|part| part.starts_with("labelgs "))).collect();
    assert!(commands.len() >= 8, "{commands:?}");
    for command in commands {
        if let Err(error) = Cli::try_parse_from(command.split_whitespace()) {
            panic!("{command}: {error}");
        }
    }
}

#[test]
fn readme_has_at_most_150_lines() {
    let lines = fs::read_to_string(Path::new(REPOSITORY_ROOT).join("README.md")).expect("README.md").lines().count();
    assert!(lines <= 150, "{lines} lines: what is long goes into the guide");
}
