//! Files that the program writes besides PLY, and the atomic writer.

use super::fixtures::Scene;
use labelgs_files::{atomic, image as images};
use labelgs_scene::Error;
use std::fs;
use std::io;
use std::time::Duration;

fn entries(scene: &Scene) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(scene.path())
        .expect("a folder")
        .flatten()
        .map(|e| e.file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

#[test]
fn a_failed_write_leaves_the_old_file_and_no_litter() {
    let scene = Scene::new();
    let path = scene.write("out.bin", b"old");
    for bytes in 0..4 {
        let error = atomic::write(&path, |out| {
            out.write_all(&vec![1; bytes << 18])?;
            Err(io::Error::other("disk full"))
        })
        .expect_err("the write fails");
        assert!(matches!(error, Error::Write { .. }), "{error}");
        assert!(error.to_string().contains("out.bin") && error.to_string().contains("disk full"));
        assert_eq!((fs::read(&path).expect("bytes"), entries(&scene)), (b"old".to_vec(), vec!["out.bin".to_owned()]));
    }
    atomic::write(&path, |out| out.write_all(b"new")).expect("written");
    assert_eq!(fs::read(&path).expect("bytes"), b"new");
    atomic::write(scene.path().join("deep/er/file"), |out| out.write_all(b"x")).expect("folders are made");
    assert!(matches!(atomic::write(scene.path(), |_| Ok(())), Err(Error::Write { .. })), "a folder");
}

#[cfg(unix)]
#[test]
fn links_and_devices_are_written_through() {
    use std::os::unix::fs::PermissionsExt;
    let scene = Scene::new();
    let target = scene.write("target", b"old");
    let link = scene.path().join("link");
    std::os::unix::fs::symlink(&target, &link).expect("a link");
    atomic::write(&link, |out| out.write_all(b"new")).expect("written");
    assert!(fs::symlink_metadata(&link).expect("metadata").file_type().is_symlink());
    assert_eq!(fs::read(&target).expect("bytes"), b"new");
    assert_eq!(fs::metadata(&target).expect("metadata").permissions().mode() & 0o600, 0o600);
    atomic::write("/dev/null", |out| out.write_all(b"new")).expect("written");
    if cfg!(target_os = "linux") {
        assert!(matches!(atomic::write("/dev/full", |out| out.write_all(b"new")), Err(Error::Write { .. })), "full");
        scene.write(".labelgs-4194305-abc.tmp", b"");
        scene.write(&format!(".labelgs-{}-abc.tmp", std::process::id()), b"");
        scene.write(".labelgs-notes.tmp", b"");
        assert_eq!(atomic::remove_stale(scene.path(), Duration::from_secs(60)), 0, "it is too young");
        assert_eq!(atomic::remove_stale(scene.path(), Duration::ZERO), 1);
        assert_eq!(entries(&scene).len(), 4);
    }
}

/// A command removes old temporary files of a killed command from its output folder.
#[cfg(target_os = "linux")]
#[test]
fn old_litter_goes_with_the_next_write() {
    let scene = Scene::new();
    let old = fs::File::create(scene.write(".labelgs-4194305-old.tmp", b"")).expect("a file");
    old.set_modified(std::time::SystemTime::now() - Duration::from_secs(7200)).expect("a time");
    scene.write(".labelgs-4194305-new.tmp", b"");
    atomic::write(scene.at("a.txt"), |out| out.write_all(b"text")).expect("written");
    assert_eq!(entries(&scene), [".labelgs-4194305-new.tmp", "a.txt"]);
}

#[test]
fn pixels_come_back_from_png_and_exr() {
    let scene = Scene::new();
    let pixels: Vec<[u8; 3]> = (0..6).map(|v| [v, 255 - v, 2 * v]).collect();
    images::write_png_rgb8(scene.at("a.png"), 3, 2, &pixels).expect("written");
    let back = image::open(scene.at("a.png")).expect("a PNG").into_rgb8();
    assert_eq!(back.into_raw(), pixels.concat());
    let ids = [0, 1, 255, 256, 40_000, 65_535];
    images::write_png_grey16(scene.at("i.png"), 3, 2, &ids).expect("written");
    let back = image::open(scene.at("i.png")).expect("a PNG").into_luma16();
    assert_eq!(back.into_raw(), ids);
    let values = [0.0, -1.5, 1e30, 0.1, f32::MIN_POSITIVE, 7.0];
    images::write_exr_y(scene.at("y.exr"), 3, 2, &values).expect("written");
    let colours: Vec<[f32; 3]> = values.iter().map(|&v| [v, 2.0, -v]).collect();
    images::write_exr_rgb(scene.at("c.exr"), 3, 2, &colours).expect("written");
    let channels = |name: &str| {
        let image = exr::prelude::read_first_flat_layer_from_file(scene.at(name)).expect("an EXR");
        let size = image.layer_data.size;
        let list = image.layer_data.channel_data.list;
        let list = list.into_iter().map(|c| (c.name.to_string(), c.sample_data.values_as_f32().collect::<Vec<_>>()));
        ((size.0, size.1), list.collect::<Vec<_>>())
    };
    assert_eq!(channels("y.exr"), ((3, 2), vec![("Y".to_owned(), values.to_vec())]));
    let (_, list) = channels("c.exr");
    let names: Vec<&str> = list.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, ["B", "G", "R"]);
    assert_eq!((list[2].1.clone(), list[1].1[0]), (values.to_vec(), 2.0));
    assert!(matches!(images::write_exr_y(scene.at("bad.exr"), 3, 3, &values), Err(Error::Bug(_))), "too few");
}
