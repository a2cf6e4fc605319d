//! Photos and videos become scenes, with programs that stand in for COLMAP and ffmpeg.

use crate::support::runs::{files, stderr, succeeded};
use labelgs::scene::{Camera, Point};
use labelgs::scenes::colmap::write;
use labelgs::scenes::{self, LoadOptions};
use serde_json::Value;
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::PathBuf;
use std::process::{Command, Output, Stdio};
use std::thread::sleep;
use std::time::Duration;

/// Does what COLMAP's commands do, with models of the folder `models`, by the names of the attempts.
const COLMAP: &str = r#"
here=$(dirname "$0"); verb=$1
case " $* " in *" -h "*) cat "$here/help"; exit 0 ;; esac
echo "$*" >> "$here/calls"
while [ $# -gt 0 ]; do
    case $1 in --output_path) output=$2 ;; --database_path) database=$2 ;; --input_path) input=$2 ;; esac
    shift
done
case $verb in
    feature_extractor)
        [ ! -e "$here/broken" ] || { echo "cannot allocate features"; exit 1; }
        : > "$database"; echo "Processed file [1/4]" ;;
    mapper)
        if [ -e "$here/slow" ]; then echo $$ > "$here/running"; exec sleep 600; fi
        model=$here/models/$(basename "$output")
        [ -d "$model" ] || { echo "no initial pair of photos"; exit 1; }
        cp -r "$model" "$output/0"; : > "$output/0/project.ini"
        [ ! -d "$model.apart" ] || cp -r "$model.apart" "$output/1" ;;
    point_filtering | bundle_adjuster) cp "$input"/*.txt "$output" ;;
esac
"#;

/// Options of COLMAP 3.8 and of 4.0.
const HELP: &str = "COLMAP 3.8 (without CUDA) --ImageReader.single_camera --ImageReader.camera_model --SiftExtraction.use_gpu \
                    --SiftExtraction.peak_threshold --SiftExtraction.max_image_size --SiftMatching.use_gpu \
                    --SiftMatching.guided_matching --Mapper.init_min_num_inliers --Mapper.min_num_matches";
const NEW_HELP: &str = "COLMAP 4.0 (with CUDA) --ImageReader.single_camera --ImageReader.camera_model \
                        --FeatureExtraction.use_gpu --SiftExtraction.peak_threshold --FeatureMatching.use_gpu";

const NAMES: [&str; 4] = ["a.png", "B.JPG", "c d.jpeg", "d.PNG"];

/// Sends a signal; returns true if the process is there.
fn kill(signal: &str, process: &str) -> bool {
    Command::new("kill").args([signal, process]).stderr(Stdio::null()).status().expect("kill").success()
}

/// A folder with photos and stand-ins.
struct Studio {
    folder: tempfile::TempDir,
}

impl Studio {
    fn new() -> Self {
        let studio = Self { folder: tempfile::tempdir().expect("a folder") };
        studio.program("colmap", COLMAP);
        studio.write("bin/help", HELP);
        NAMES.iter().for_each(|name| studio.photo(&format!("photos/{name}"), (12, 8)));
        studio
    }

    fn at(&self, name: &str) -> PathBuf {
        let path = self.folder.path().join(name);
        fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        path
    }

    fn write(&self, name: &str, text: &str) {
        fs::write(self.at(name), text).expect("written");
    }

    fn program(&self, name: &str, script: &str) {
        let path = self.at(&format!("bin/{name}"));
        fs::write(&path, format!("#!/bin/sh\n{script}")).expect("written");
        fs::set_permissions(path, fs::Permissions::from_mode(0o755)).expect("a program");
    }

    fn photo(&self, name: &str, (width, height): (u32, u32)) {
        let pixels = vec![[90, 80, 70]; (width * height) as usize];
        let bytes = labelgs::files::image::png_rgb8((width, height), &pixels).expect("a PNG");
        fs::write(self.at(name), bytes).expect("written");
    }

    /// What an attempt finds: poses of photos, and points.
    fn model(&self, attempt: &str, names: &[&str], points: usize) {
        let camera = Camera::at_origin([10.0, 10.0, 6.0, 4.0], (12, 8));
        let views: Vec<(&str, &Camera)> = names.iter().map(|&name| (name, &camera)).collect();
        let point = |index| Point { position: glam::DVec3::new(index as f64, 0.5, 4.0), colour: [1, 2, 3] };
        let points: Vec<Point> = (0..points).map(point).collect();
        write::model(&self.at(&format!("bin/models/{attempt}")), &views, &points).expect("a model");
    }

    fn command(&self, words: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_labelgs"));
        let path = format!("{}:/usr/bin:/bin", self.at("bin").display());
        command.arg("photos").args(words).env("PATH", path).current_dir(self.folder.path());
        command
    }

    fn photos(&self, words: &[&str]) -> Output {
        self.command(words).output().expect("it runs")
    }

    #[track_caller]
    fn refused(&self, words: &[&str], status: i32, expected: &[&str]) {
        let before = files(self.folder.path()).len();
        let output = self.photos(words);
        let text = stderr(&output);
        assert_eq!(output.status.code(), Some(status), "{text}");
        expected.iter().for_each(|part| assert!(text.contains(part), "{part} is not in {text}"));
        self.nothing_is_left();
        assert!(files(self.folder.path()).len() <= before + 1, "only the calls of the stand-in are new");
    }

    #[track_caller]
    fn nothing_is_left(&self) {
        let entries = fs::read_dir(self.folder.path()).expect("a folder").flatten();
        let names: Vec<String> = entries.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
        assert!(names.iter().all(|name| ["bin", "photos", "clip.mp4", "full"].contains(&name.as_str())), "{names:?}");
    }

    /// The calls of COLMAP that begin with this word.
    fn calls(&self, verb: &str) -> Vec<String> {
        let text = fs::read_to_string(self.at("bin/calls")).unwrap_or_default();
        text.lines().filter(|line| line.starts_with(verb)).map(str::to_owned).collect()
    }

    fn images(&self) -> Vec<String> {
        let entries = fs::read_dir(self.at("scene/images")).expect("photos").flatten();
        let mut names: Vec<String> = entries.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }
}

#[test]
fn photos_of_a_folder_become_a_scene() {
    let studio = Studio::new();
    studio.model("usual", &NAMES, 5);
    studio.write("photos/notes.txt", "none");
    studio.photo("photos/._a.png", (12, 8));
    studio.photo("photos/below/e.png", (12, 8));
    let output = studio.photos(&["photos", "-o", "scene"]);
    succeeded(&output);
    let told = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(told.contains("4 of 4 photos have poses, 5 points") && told.contains("labelgs check scene"), "{told}");
    assert_eq!(studio.images(), ["B.JPG", "a.png", "c d.jpeg", "d.PNG"]);
    let options = LoadOptions { test_every: None, ..LoadOptions::default() };
    let dataset = scenes::open(&studio.at("scene"), &options).expect("a scene");
    assert_eq!((dataset.train.len(), dataset.points.len()), (4, 5));
    assert!(!studio.at("scene/sparse/0/project.ini").exists(), "it has paths of a folder that is gone");
    let log = fs::read_to_string(studio.at("scene/colmap.log")).expect("the messages of COLMAP");
    assert!(log.contains("Processed file [1/4]"), "{log}");
    let [features] = &studio.calls("feature_extractor")[..] else { panic!("one call") };
    for part in ["single_camera 1", "camera_model OPENCV", "--SiftExtraction.use_gpu 0"] {
        assert!(features.contains(part), "{features}");
    }
    assert_eq!((studio.calls("exhaustive_matcher").len(), studio.calls("mapper").len()), (1, 1));
    assert!(studio.calls("point_filtering").is_empty());
    // The scene is whole, so that it is not made twice.
    let again = studio.photos(&["photos", "-o", "scene"]);
    assert!(again.status.code() == Some(2) && stderr(&again).contains("not empty"), "{}", stderr(&again));
}

#[test]
fn photos_without_a_pose_are_tried_again_then_named_and_left_out() {
    let studio = Studio::new();
    studio.model("usual", &NAMES[..2], 5);
    studio.model("fainter", &NAMES[..3], 40);
    studio.model("fainter.apart", &NAMES[3..], 1);
    studio.model("fewer", &NAMES[..2], 90);
    let output = studio.photos(&["photos", "-o", "scene", "--json"]);
    let text = succeeded(&output);
    for part in [
        "2 of 4 photos have poses; trying again with fainter features",
        "3 of 4 photos have poses; trying again with fewer common features",
        "1 of 4 photos have no pose and are left out: d.PNG. ",
        "overlap by more than half",
        "more frames of a video (--frames)",
        "also placed 1 photo in 1 group that it could not join to the scene",
    ] {
        assert!(text.contains(part), "{part} is not in {text}");
    }
    let told: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!((&told["placed"], &told["photos"]), (&3.into(), &4.into()));
    assert_eq!((&told["left_out"], &told["points"]), (&serde_json::json!(["d.PNG"]), &40.into()));
    assert_eq!(studio.images(), ["B.JPG", "a.png", "c d.jpeg"]);
    assert!(studio.at("photos/d.PNG").is_file(), "the photos of the user stay");
    let (features, models) = (studio.calls("feature_extractor"), studio.calls("mapper"));
    assert!(features.len() == 2 && features[1].contains("--SiftExtraction.peak_threshold 0.0003"), "{features:?}");
    assert!(studio.calls("exhaustive_matcher")[1].contains("--SiftMatching.guided_matching 1"));
    assert!(models.len() == 3 && models[2].contains("--Mapper.init_min_num_inliers 50"), "{models:?}");
    assert!(models[2].contains("fainter.db"), "features are found once: {models:?}");
    assert_eq!((studio.calls("point_filtering").len(), studio.calls("bundle_adjuster").len()), (1, 1));
}

#[test]
fn photos_that_do_not_fit_together_are_an_error_with_advice() {
    let studio = Studio::new();
    let advice = ["COLMAP found no poses for its 4 photos", "overlap by more than half", "no initial pair of photos"];
    studio.refused(&["photos", "-o", "scene"], 3, &advice);
    assert_eq!(studio.calls("mapper").len(), 3);
    studio.write("bin/broken", "");
    studio.refused(&["photos", "-o", "scene"], 3, &["feature_extractor", "failed", "cannot allocate features"]);
}

#[test]
fn what_is_missing_or_wrong_is_told_before_any_work() {
    let studio = Studio::new();
    studio.write("full/a.txt", "");
    studio.refused(&["photos", "-o", "full"], 2, &["output: full is not empty"]);
    studio.refused(&["photos"], 2, &["--output <SCENE>"]);
    studio.refused(&["photos", "-o", "scene", "--frames", "2"], 2, &["--frames"]);
    studio.refused(&["photos", "-o", "scene", "--model", "LENS"], 2, &["LENS", "OPENCV_FISHEYE"]);
    studio.refused(&["photos", "-o", "scene", "--gpu"], 2, &["--gpu: ", "without CUDA"]);
    studio.refused(&["nowhere", "-o", "scene"], 3, &["nowhere: there is no such file or folder"]);
    studio.refused(&["photos/a.png", "-o", "scene"], 3, &["is a PNG; expected a folder of photos or a video"]);
    studio.photo("full/below/a.png", (12, 8));
    studio.write("full/IMG_1.HEIC", "");
    let expected = ["found 0 photos", "1 file must be converted to JPEG first: IMG_1.HEIC", "full/below holds 1"];
    studio.refused(&["full", "-o", "scene"], 3, &expected);
    // Nothing is installed.
    fs::write(studio.at("clip.mp4"), b"\0\0\0\x20ftypisom\0\0\x02\0isomiso2").expect("a video");
    fs::rename(studio.at("bin/colmap"), studio.at("bin/other")).expect("renamed");
    let alone = |words: &[&str]| studio.command(words).env("PATH", studio.at("bin")).output().expect("it runs");
    let output = alone(&["photos", "-o", "scene"]);
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    for part in ["holds colmap", "apt-get install colmap", "brew install colmap", "Windows", "Metashape"] {
        assert!(stderr(&output).contains(part), "{}", stderr(&output));
    }
    fs::rename(studio.at("bin/other"), studio.at("bin/colmap")).expect("renamed");
    let output = alone(&["clip.mp4", "-o", "scene"]);
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    assert!(stderr(&output).contains("holds ffmpeg") && stderr(&output).contains("winget"), "{}", stderr(&output));
    studio.nothing_is_left();
}

#[test]
fn a_folder_of_photos_named_as_a_scene_is_answered_with_the_command() {
    let studio = Studio::new();
    let check = |scene: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_labelgs"));
        stderr(&command.args(["check", scene]).current_dir(studio.folder.path()).output().expect("it runs"))
    };
    let text = check("photos");
    assert!(text.contains("photos holds 4 photos without poses: `labelgs photos photos -o SCENE` finds"), "{text}");
    fs::write(studio.at("clip.mp4"), b"\0\0\0\x20ftypisom\0\0\x02\0isomiso2").expect("a video");
    let text = check("clip.mp4");
    assert!(text.contains("`labelgs photos VIDEO -o SCENE` makes one of it"), "{text}");
}

#[test]
fn a_signal_ends_colmap_and_leaves_nothing() {
    for (signal, status) in [("-INT", 130), ("-TERM", 143)] {
        let studio = Studio::new();
        studio.write("bin/slow", "");
        let mut child = studio.command(&["photos", "-o", "scene"]).stderr(Stdio::null()).spawn().expect("it runs");
        let running = loop {
            let text = fs::read_to_string(studio.at("bin/running")).unwrap_or_default();
            if let Some(process) = text.strip_suffix('\n') {
                break process.to_owned();
            }
            assert_eq!(child.try_wait().expect("a child"), None);
            sleep(Duration::from_millis(5));
        };
        assert!(kill(signal, &child.id().to_string()));
        assert_eq!(child.wait().expect("a child").code(), Some(status));
        assert!(!kill("-0", &running), "COLMAP still runs");
        studio.nothing_is_left();
    }
}

#[test]
fn a_video_becomes_frames_at_equal_distances() {
    let studio = Studio::new();
    // A second of 40 frames; the length of its stream is not known, as in Matroska.
    let told = r#"{"streams":[{"avg_frame_rate":"4/1"}],"format":{"duration":"10.0"}}"#;
    studio.program("ffprobe", &format!("echo '{told}'"));
    let script = r#"echo "$*" > "$(dirname "$0")/words"; for last; do :; done; folder=$(dirname "$last")
                    for at in 1 2 3; do cp "$(dirname "$0")/frame.png" "$folder/0000$at.jpg"; echo "frame=$at"; done"#;
    studio.program("ffmpeg", script);
    studio.photo("bin/frame.png", (12, 8));
    studio.model("usual", &["00001.jpg", "00002.jpg", "00003.jpg"], 5);
    fs::write(studio.at("clip.mkv"), b"\x1A\x45\xDF\xA3").expect("a video");
    for (flags, rate) in [(&["--frames", "20"][..], "fps=2 "), (&[], "fps=4 ")] {
        succeeded(&studio.photos(&[&["clip.mkv", "-o", "scene"], flags].concat()));
        let words = fs::read_to_string(studio.at("bin/words")).expect("the call of ffmpeg");
        assert!(words.contains(rate) && words.contains("-nostdin"), "{words}");
        assert_eq!(studio.images(), ["00001.jpg", "00002.jpg", "00003.jpg"]);
        fs::remove_dir_all(studio.at("scene")).expect("removed");
    }
    studio.program("ffprobe", "echo '{}'; echo 'moov atom not found' >&2; exit 1");
    let broken = studio.photos(&["clip.mkv", "-o", "scene"]);
    let text = stderr(&broken);
    assert!(broken.status.code() == Some(3) && text.contains("no video of a known length"), "{text}");
    assert!(text.contains("moov atom not found") && !studio.at("scene").exists(), "{text}");
}

#[test]
fn photos_of_each_size_share_a_lens_and_damaged_ones_are_left_out() {
    let studio = Studio::new();
    studio.write("bin/help", NEW_HELP);
    studio.photo("photos/d.PNG", (8, 12));
    studio.write("photos/e.jpg", "no photo");
    // Links to other folders are followed.
    fs::rename(studio.at("photos/a.png"), studio.at("bin/a.png")).expect("moved");
    std::os::unix::fs::symlink("../bin/a.png", studio.at("photos/a.png")).expect("a link");
    studio.model("usual", &NAMES, 5);
    let output = studio.photos(&["photos", "-o", "scene", "--gpu", "--model", "PINHOLE"]);
    let text = succeeded(&output);
    assert!(text.contains("1 of 5 photos have no pose and are left out: e.jpg"), "{text}");
    assert!(!text.contains("trying again"), "no attempt makes a photo of that: {text}");
    let features = studio.calls("feature_extractor");
    assert!(features.len() == 2 && features.iter().all(|call| call.contains("--image_list_path")), "{features:?}");
    for part in ["--FeatureExtraction.use_gpu 1", "camera_model PINHOLE"] {
        assert!(features[0].contains(part), "{features:?}");
    }
    assert!(studio.calls("exhaustive_matcher")[0].contains("--FeatureMatching.use_gpu 1"));
    assert!(fs::read(studio.at("scene/images/a.png")).is_ok_and(|bytes| bytes.starts_with(b"\x89PNG")));
}
