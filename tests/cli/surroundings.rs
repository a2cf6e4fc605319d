//! The program in unusual surroundings: folder names, languages, streams, links, read-only folders, little memory.
#![cfg(target_os = "linux")]

use crate::support::device;
use crate::support::runs::{Place, all_whole, copy, files, stderr, succeeded};
use labelgs::formats::write_model;
use labelgs::scene::Gaussians;
use std::collections::BTreeMap;
use std::ffi::{OsStr, OsString};
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

fn labelgs(place: &Place) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_labelgs"));
    command.env("LABELGS_VALIDATION", "off").env("LABELGS_CACHE", place.path("cache"));
    command
}

fn train(place: &Place, scene: &Path, out: &Path, flags: &[&str]) -> Output {
    let mut command = labelgs(place);
    command.arg("train").arg(scene).arg("--masks").arg(scene.join("masks")).arg("-o").arg(out);
    command.args(["--checkpoint-every", "2"]).args(flags).output().expect("it runs")
}

#[test]
fn folders_may_have_any_name() {
    let Some(_turn) = device() else { return };
    let place = Place::new();
    let names: [&[u8]; 4] =
        ["a b".as_bytes(), "\u{fc}\u{4e2d}\u{1f436}".as_bytes(), b"line\nbreak --flag", b"no\xffutf8"];
    for name in names {
        let name = OsStr::from_bytes(name);
        let (scene, out) = (place.path("scenes").join(name), place.path("models").join(name));
        copy(&place.path("scene"), &scene);
        succeeded(&train(&place, &scene, &out, &["--iterations", "4"]));
        // A name that is not UTF-8 cannot be kept in a checkpoint, so `--masks` is given again for every name.
        let said = succeeded(&train(&place, &scene, &out, &["--resume", "--iterations", "6"]));
        assert!(said.contains("resuming after step 4"), "{name:?}: {said}");
        let pictures = place.path("pictures").join(name);
        let mut render = labelgs(&place);
        render.arg("render").arg(&out).arg("--scene").arg(&scene).arg("-o").arg(&pictures);
        succeeded(&render.output().expect("it runs"));
        assert!(!files(&pictures).is_empty(), "{name:?}");
        succeeded(&labelgs(&place).arg("list").arg(&out).output().expect("it runs"));
    }
    // Longer than the file system allows.
    let long: PathBuf = std::iter::repeat_n("folder", 700).collect();
    let output = train(&place, &place.path("scene"), &place.path("models").join(&long), &["--iterations", "4"]);
    assert_eq!(output.status.code(), Some(7), "{}", stderr(&output));
    assert!(stderr(&output).contains("cannot be written"), "{}", stderr(&output));
    let output = train(&place, &place.path("scenes").join(long), &place.path("models/long"), &["--iterations", "4"]);
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
}

/// Numbers are read and written alike under every language, and time zone and date change no result.
#[test]
fn languages_and_zones_change_nothing() {
    let Some(_turn) = device() else { return };
    let place = Place::new();
    succeeded(&place.trained("out", &["--iterations", "4"]));
    let model = place.model("out", 4);
    for (language, zone) in
        [("C", "UTC"), ("de_DE.UTF-8", "Asia/Kathmandu"), ("tr_TR", "nowhere/at all"), ("", "\u{fffd}")]
    {
        let out = place.path(&format!("out-{language}"));
        let mut command = labelgs(&place);
        command.env("LANG", language).env("LC_ALL", language).env("TZ", zone);
        command.args(place.train(out.to_str().expect("text"), &["--iterations", "4"]).iter().map(OsString::from));
        succeeded(&command.output().expect("it runs"));
        assert!(place.model(&format!("out-{language}"), 4) == model, "{language:?} in {zone:?}");
    }
}

/// Closed streams and closed pipes do not end a run, because results are in files.
#[test]
fn closed_streams_do_not_end_a_run() {
    let Some(_turn) = device() else { return };
    let place = Place::new();
    succeeded(&place.trained("right", &["--iterations", "4"]));
    let model = place.model("right", 4);
    let shell = |redirection: &str, out: &str| {
        let mut command = Command::new("sh");
        command.args(["-c", &format!("\"$0\" \"$@\" {redirection}"), env!("CARGO_BIN_EXE_labelgs")]);
        command.env("LABELGS_VALIDATION", "off").env("LABELGS_CACHE", place.path("cache"));
        command.args(place.train(&place.text(out), &["--iterations", "4", "-vv"]));
        command.status().expect("it runs").code()
    };
    for (index, redirection) in
        ["<&-", ">&-", "2>&-", "<&- >&- 2>&-", "2>/dev/full", ">/dev/null 2>&1"].iter().enumerate()
    {
        let out = format!("closed-{index}");
        assert_eq!(shell(redirection, &out), Some(0), "{redirection}");
        assert!(place.model(&out, 4) == model, "{redirection}");
    }
    // A result that cannot be printed has the status of a failed write.
    assert_eq!(shell(">/dev/full", "full"), Some(7));
    assert!(place.model("full", 4) == model);
    // `labelgs train ... 2>&1 | head -n 1`
    for to_stdout in [true, false] {
        let (reader, writer) = std::io::pipe().expect("a pipe");
        drop(reader);
        let out = format!("piped-{to_stdout}");
        let mut command = labelgs(&place);
        command.args(place.train(&place.text(&out), &["--iterations", "4", "-vv"]));
        let command = if to_stdout { command.stdout(writer) } else { command.stderr(writer).stdout(Stdio::null()) };
        assert_eq!(command.status().expect("it runs").code(), Some(0), "to standard output: {to_stdout}");
        assert!(place.model(&out, 4) == model);
    }
}

/// Compiled pipelines go to the user's cache folder, unless `LABELGS_CACHE` names another.
#[test]
fn caches_are_kept_where_the_system_has_them() {
    let Some(_turn) = device() else { return };
    let place = Place::new();
    let named = [("HOME", "home"), ("XDG_CACHE_HOME", "xdg"), ("LABELGS_CACHE", "own")];
    for (count, expected) in [(1, "home/.cache/labelgs"), (2, "xdg/labelgs"), (3, "own")] {
        let mut command = labelgs(&place);
        command.env_remove("XDG_CACHE_HOME").env_remove("LABELGS_CACHE");
        command.envs(named[..count].iter().map(|&(name, folder)| (name, place.path(folder))));
        let output = command.args(place.train(&place.text(&format!("out-{count}")), &["--iterations", "1"])).output();
        succeeded(&output.expect("it runs"));
        let kept = std::fs::read_dir(place.path(expected)).expect(expected);
        assert!(
            kept.flatten().any(|entry| entry.file_name().to_string_lossy().starts_with("pipelines-")),
            "{expected}"
        );
    }
}

/// Runs the program with a limit on its address space, MiB.
fn within(place: &Place, megabytes: u32, args: &[String]) -> Output {
    let mut command = Command::new("sh");
    command.args(["-c", r#"ulimit -c 0; ulimit -v "$1"; shift; exec "$@""#, "sh", &(megabytes * 1024).to_string()]);
    command.env("LABELGS_VALIDATION", "off").env("LABELGS_CACHE", place.path("cache"));
    command.arg(env!("CARGO_BIN_EXE_labelgs")).args(args).output().expect("a shell")
}

/// Without host memory: status 5, the number of bytes, and no partial file.
#[cfg(target_os = "linux")]
#[test]
fn host_memory_may_run_out() {
    let Some(_turn) = device() else { return };
    let place = Place::new();
    let [model, part, right] = ["model.ply", "part.ply", "right.ply"].map(|name| place.text(name));
    let rows = 300_000;
    let gaussians = Gaussians {
        means: (0..rows).map(|row| [row as f32, 0.0, 0.0]).collect(),
        quats: vec![[1.0, 0.0, 0.0, 0.0]; rows],
        scales: vec![[0.0; 3]; rows],
        opacities: vec![0.0; rows],
        sh0: vec![[0.0; 3]; rows],
        ..Gaussians::default()
    };
    write_model(&model, &gaussians).expect("written");
    let extract = |to: &str| ["extract", &model, "--labels", "0", "-o", to].map(str::to_owned);
    succeeded(&place.labelgs(&extract(&right).each_ref().map(String::as_str)));
    let (mut done, mut refused) = (0, 0);
    // Less does not load a program without optimisation.
    for megabytes in (76..172).step_by(8) {
        let output = within(&place, megabytes, &extract(&part));
        let written = std::fs::read(&part).ok();
        match output.status.code() {
            Some(0) => {
                done += 1;
                assert!(written == std::fs::read(&right).ok(), "{megabytes} MiB: another file than with memory");
                std::fs::remove_file(&part).expect("removed");
            }
            Some(5) => {
                refused += 1;
                let said = stderr(&output);
                assert!(said.contains("out of memory while allocating "), "{megabytes} MiB: {said}");
                assert!(written.is_none(), "{megabytes} MiB: half of a file");
            }
            _ => panic!("{megabytes} MiB: {}; {}", output.status, stderr(&output)),
        }
    }
    println!("{refused} of {} runs had too little memory", done + refused);
    assert!(done > 3 && refused > 3, "{done}, {refused}");
    // In a training, an allocation of the driver may fail and end the process by a signal. Files stay complete, and the
    // training can be resumed with more memory.
    succeeded(&place.trained("right", &["--iterations", "8", "--checkpoint-every", "4"]));
    for megabytes in (200..1200).step_by(200) {
        let out = format!("out-{megabytes}");
        let flags = ["--iterations", "8", "--checkpoint-every", "4", "--resume"];
        let output = within(&place, megabytes, &place.train(&place.text(&out), &flags));
        assert!(matches!(output.status.code(), None | Some(0 | 4 | 5)), "{}: {}", output.status, stderr(&output));
        assert!(!stderr(&output).contains("bug in labelgs"), "{megabytes} MiB: {}", stderr(&output));
        if place.path(&out).exists() {
            all_whole(&place.path(&out));
        }
        succeeded(&place.trained(&out, &flags));
        assert!(place.model(&out, 8) == place.model("right", 8), "{megabytes} MiB");
    }
}

/// Bytes and times of every file below a folder.
fn state(folder: &Path) -> BTreeMap<PathBuf, (Vec<u8>, std::time::SystemTime)> {
    let time = |path: &Path| std::fs::metadata(path).and_then(|found| found.modified()).expect("a time");
    let mut found: BTreeMap<_, _> = (files(folder).into_iter())
        .map(|path| (path.clone(), (std::fs::read(&path).expect("a file"), time(&path))))
        .collect();
    // Includes folders: creating and deleting a file changes the time of its folder.
    let folders: Vec<PathBuf> = found.keys().filter_map(|path| path.parent()).map(Path::to_owned).collect();
    for folder in folders {
        let time = time(&folder);
        found.insert(folder, (Vec::new(), time));
    }
    found
}

#[test]
fn a_scene_is_never_written_to() {
    let Some(_turn) = device() else { return };
    let place = Place::new();
    let before = state(&place.path("scene"));
    let (scene, out) = (place.text("scene"), place.text("out"));
    succeeded(&place.trained("out", &["--iterations", "4"]));
    succeeded(&place.labelgs(&["render", &out, "--scene", &scene, "-o", &place.text("pictures")]));
    let (relabelled, masks) = (place.text("relabelled.ply"), place.text("scene/masks"));
    let checked = place.labelgs(&["masks", "check", "--scene", &scene, &masks]);
    assert!(matches!(checked.status.code(), Some(0 | 1)), "{}", stderr(&checked));
    succeeded(&place.labelgs(&["label", &out, "--scene", &scene, "--masks", &masks, "-o", &relabelled]));
    succeeded(&place.labelgs(&["eval", &out, "--scene", &scene, "--masks", &masks]));
    let after = state(&place.path("scene"));
    assert!(before == after, "files before: {:?}, after: {:?}", before.keys(), after.keys());
}

/// Links: photos and masks may be links, and so may the folder of the results.
#[test]
fn links_are_followed() {
    let Some(_turn) = device() else { return };
    let place = Place::new();
    succeeded(&place.trained("right", &["--iterations", "4"]));
    let linked = place.path("linked");
    std::fs::create_dir_all(linked.join("images")).expect("a folder");
    for entry in std::fs::read_dir(place.path("scene")).expect("a scene") {
        let path = entry.expect("an entry").path();
        if !path.ends_with("images") {
            symlink(&path, linked.join(path.file_name().expect("a name"))).expect("a link");
        }
    }
    for photo in files(&place.path("scene/images")) {
        symlink(&photo, linked.join("images").join(photo.file_name().expect("a name"))).expect("a link");
    }
    std::fs::create_dir_all(place.path("real")).expect("a folder");
    symlink(place.path("real"), place.path("out")).expect("a link");
    succeeded(&train(&place, &linked, &place.path("out"), &["--iterations", "4"]));
    assert!(place.path("out").is_symlink());
    assert!(place.model("real", 4) == place.model("right", 4));
    // A link that leads nowhere.
    symlink(place.path("gone"), place.path("nowhere")).expect("a link");
    let output = train(&place, &linked, &place.path("nowhere"), &["--iterations", "4"]);
    assert_eq!(output.status.code(), Some(7), "{}", stderr(&output));
    // A link may name a missing file, or a pipe of the system.
    let model = place.text("right/point_cloud/iteration_4/point_cloud.ply");
    symlink("later.ply", place.path("link.ply")).expect("a link");
    let extract = ["extract", &model, "--labels", "0", "-o"];
    succeeded(&place.labelgs(&[&extract[..], &[&place.text("link.ply")]].concat()));
    let bytes = std::fs::read(place.path("later.ply")).expect("what the link names");
    assert!(place.path("link.ply").is_symlink());
    let output = place.labelgs(&[&extract[..], &["/dev/stdout", "-q"]].concat());
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(output.stdout.starts_with(&bytes), "the file comes out of the pipe");
    symlink("circle-b.ply", place.path("circle-a.ply")).expect("a link");
    symlink("circle-a.ply", place.path("circle-b.ply")).expect("a link");
    let output = place.labelgs(&[&extract[..], &[&place.text("circle-a.ply")]].concat());
    assert_eq!(output.status.code(), Some(7), "{}", stderr(&output));
}
