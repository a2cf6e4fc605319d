//! Cameras that move: along a path, around an object; frames and videos.

use crate::support::device;
use crate::support::runs::{Place, stderr, succeeded};
use labelgs::files::image::{read_photo, read_rgba};
use labelgs::masks::read_mask;
use labelgs::scene::Camera;
use labelgs::scenes::LoadOptions;
use labelgs::scenes::camera_json::CameraFile;
use serde_json::{Value, json};
use std::path::Path;

/// A path through the cameras, a second each.
fn path(cameras: &[Camera], fps: u32) -> Value {
    let key = |(at, camera): (usize, &Camera)| json!({ "time": at, "camera": CameraFile::from(camera) });
    let keyframes: Vec<Value> = cameras.iter().enumerate().map(key).collect();
    json!({ "schema_version": 1, "fps": fps, "keyframes": keyframes })
}

fn cameras(place: &Place) -> Vec<Camera> {
    let dataset = labelgs::scenes::open(&place.path("scene"), &LoadOptions::default()).expect("a scene");
    dataset.all().into_iter().map(|view| view.camera.clone()).collect()
}

fn files(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).expect("a folder").flatten();
    let mut names: Vec<String> = entries.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// Puts a program that keeps the frames as they are on the search path, in the place of ffmpeg.
#[cfg(unix)]
fn with_encoder(place: &mut Place) {
    use std::os::unix::fs::PermissionsExt;
    let program = place.path("bin/ffmpeg");
    std::fs::create_dir_all(place.path("bin")).expect("a folder");
    std::fs::write(&program, "#!/bin/sh\nfor last; do :; done\nexec /bin/cat > \"$last\"\n").expect("written");
    std::fs::set_permissions(&program, std::fs::Permissions::from_mode(0o755)).expect("a program");
    let bin = place.text("bin");
    place.choose(&[("PATH", &bin)]);
}

#[cfg(unix)]
#[test]
fn a_path_becomes_frames_and_a_video_of_them() {
    let Some(_turn) = device() else { return };
    let mut place = Place::new();
    succeeded(&place.trained("out", &["--iterations", "20"]));
    let cameras = &cameras(&place)[..3];
    let (out, file, single) = (place.text("out"), place.text("path.json"), place.text("single.json"));
    std::fs::write(&file, path(cameras, 4).to_string()).expect("written");
    std::fs::write(&single, json!(CameraFile::from(&cameras[1])).to_string()).expect("written");
    let render = |flags: &[&str]| place.labelgs(&[&["render", &out], flags].concat());
    succeeded(&render(&["--path", &file, "-o", &place.text("frames")]));
    succeeded(&render(&["--camera", &single, "-o", &place.text("frames")]));
    let mut expected: Vec<String> = (0..9).map(|frame| format!("{frame:05}.rgb.png")).collect();
    expected.push("single.rgb.png".to_owned());
    assert_eq!(files(&place.path("frames")), expected);
    let bytes = |name: &str| std::fs::read(place.path("frames").join(name)).expect("a picture");
    assert_eq!(bytes("00004.rgb.png"), bytes("single.rgb.png"), "a path passes its keyframes");
    assert_ne!(bytes("00003.rgb.png"), bytes("00004.rgb.png"));

    let clip = place.text("clip.mp4");
    place.choose(&[("PATH", "/nowhere")]);
    let render = |place: &Place, flags: &[&str]| place.labelgs(&[&["render", &out, "-o", &clip], flags].concat());
    let missing = render(&place, &["--path", &file]);
    assert_eq!(missing.status.code(), Some(7));
    assert!(stderr(&missing).contains("apt-get install ffmpeg") && stderr(&missing).contains("name a folder"));
    with_encoder(&mut place);
    succeeded(&render(&place, &["--path", &file]));
    let video = std::fs::read(&clip).expect("a video");
    assert_eq!(video.len(), 9 * 64 * 48 * 3);
    let (frames, _) = video.as_chunks::<3>();
    for frame in [0, 4, 8] {
        let picture =
            read_photo(place.path("frames").join(format!("{frame:05}.rgb.png")), [0.0; 3]).expect("a picture");
        assert!(picture.rgb() == frames[frame * 64 * 48..][..64 * 48], "frame {frame}");
    }
    // An odd width has a column more.
    let odd: Vec<Camera> = cameras.iter().map(|camera| Camera { width: 63, ..camera.clone() }).collect();
    let odd_file = place.text("odd.json");
    std::fs::write(&odd_file, path(&odd, 4).to_string()).expect("written");
    succeeded(&render(&place, &["--path", &odd_file, "--what", "depth"]));
    assert_eq!(std::fs::read(&clip).expect("a video").len(), 9 * 64 * 48 * 3);

    for (flags, part) in [
        (&["--camera", &single][..], "a video needs --path or --turntable"),
        (&["--path", &file, "--what", "rgb,depth"], "a video shows one kind of image"),
        (&["--path", &file, "--format", "exr"], "a video has 8-bit colours"),
        (&["--path", &file, "--views", "all"], "cannot be used with"),
        (&["--path", &file, "--seconds", "3"], "cannot be used with"),
    ] {
        let refused = render(&place, flags);
        assert_eq!(refused.status.code(), Some(2), "{flags:?}: {}", stderr(&refused));
        assert!(stderr(&refused).contains(part), "{flags:?}: {}", stderr(&refused));
    }
    let mut twice = path(cameras, 4);
    twice["keyframes"][1]["time"] = 0.into();
    std::fs::write(&file, twice.to_string()).expect("written");
    let refused = render(&place, &["--path", &file]);
    assert_eq!(refused.status.code(), Some(3));
    assert!(stderr(&refused).contains("keyframes: number 1 is at 0 s, after 0 s"), "{}", stderr(&refused));
}

#[test]
fn a_turntable_goes_around_an_object_that_stays_in_the_picture() {
    let Some(_turn) = device() else { return };
    let place = Place::new();
    succeeded(&place.trained("out", &["--iterations", "200"]));
    let (out, turn) = (place.text("out"), place.text("turn"));
    let listed = place.labelgs(&["list", &out, "--json"]);
    let listed: Value = serde_json::from_slice(&listed.stdout).expect("JSON");
    let id = listed["labels"].as_array().expect("labels").iter().map(|row| row["label"].as_u64().expect("an id")).max();
    let id = id.filter(|&id| id > 0).expect("an object").to_string();
    let short = ["--seconds", "1", "--fps", "8", "--size", "80x60"];
    let render = |flags: &[&str]| place.labelgs(&[&["render", &out, "-o", &turn], flags, &short].concat());
    succeeded(&render(&["--turntable", &id, "--what", "rgb,alpha,labels"]));
    assert_eq!(files(&place.path("turn")).len(), 8 * 4);
    let mut pictures = Vec::new();
    for frame in 0..8 {
        let map = read_mask(place.path("turn").join(format!("{frame:05}.labels.png"))).expect("a label map");
        assert_eq!(map.objects(), [id.parse::<u16>().expect("an id")], "frame {frame}: it is alone");
        let alpha = read_rgba(place.path("turn").join(format!("{frame:05}.alpha.png"))).expect("a picture");
        let solid = |at: &usize| alpha.rgba[*at][0] > 127;
        let inside: Vec<usize> = (0..80 * 60).filter(solid).collect();
        let edge = inside.iter().filter(|&&at| at % 80 == 0 || at % 80 == 79 || at / 80 == 0 || at / 80 == 59).count();
        assert!(inside.len() > 100 && edge == 0, "frame {frame}: {} px, {edge} at the edge", inside.len());
        pictures.push(std::fs::read(place.path("turn").join(format!("{frame:05}.rgb.png"))).expect("a picture"));
    }
    pictures.dedup();
    assert_eq!(pictures.len(), 8, "each frame is from another side");

    // The whole, from around it.
    succeeded(&render(&["--turntable", "--what", "alpha"]));
    let alpha = read_rgba(place.path("turn/00003.alpha.png")).expect("a picture");
    assert!(alpha.rgba.iter().filter(|pixel| pixel[0] > 127).count() > 80 * 60 / 4);
    let refused = render(&["--turntable", &id, "--only", &id]);
    assert!(stderr(&refused).contains("no labels together with --only or --without"), "{}", stderr(&refused));
}

#[test]
fn a_sheet_shows_each_label() {
    let Some(_turn) = device() else { return };
    let place = Place::new();
    succeeded(&place.trained("out", &["--iterations", "200"]));
    let (out, object) = (place.text("out"), place.text("object.ply"));
    for (model, more) in [(&out, &["--scene", &place.text("scene")][..]), (&out, &[]), (&object, &[])] {
        succeeded(&place.labelgs(&["extract", &out, "--labels", "1-3", "-o", &object]));
        let [page, picture] = ["sheet.html", "sheet.png"].map(|name| place.text(name));
        let list = |sheet: &str| place.labelgs(&[&["list", model, "--json", "--sheet", sheet], more].concat());
        let listed: Value = serde_json::from_slice(&list(&page).stdout).expect("JSON");
        let labels: Vec<&Value> =
            listed["labels"].as_array().expect("labels").iter().filter(|row| row["label"] != 0).collect();
        let text = std::fs::read_to_string(&page).expect("a page");
        assert_eq!(text.matches("data:image/png;base64,").count(), labels.len());
        for row in &labels {
            assert!(text.contains(&format!("<strong>{}</strong>", row["label"])), "{row}");
        }
        succeeded(&list(&picture));
        let picture = read_photo(&picture, [0.0; 3]).expect("a picture");
        let neutral = picture.rgb().iter().filter(|colour| **colour == [150; 3]).count();
        assert!(neutral * 100 < picture.rgb().len() * 95, "{neutral} of {}", picture.rgb().len());
    }
    let refused = place.labelgs(&["list", &out, "--sheet", "sheet.pdf"]);
    assert!(stderr(&refused).contains("extension .html"), "{}", stderr(&refused));
}
