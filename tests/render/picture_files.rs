//! Pictures of a view as files.

use exr::prelude::read_first_flat_layer_from_file;
use labelgs::render::{Format, PictureKind, Render, write_pictures};
use std::path::Path;

/// All samples of an EXR, channels by name.
fn exr(path: &Path) -> Vec<(String, Vec<f32>)> {
    let image = read_first_flat_layer_from_file(path).expect("EXR");
    let channels = image.layer_data.channel_data.list;
    channels.iter().map(|c| (c.name.to_string(), c.sample_data.values_as_f32().collect())).collect()
}

#[test]
fn each_kind_of_picture_has_its_file() {
    let folder = tempfile::tempdir().expect("folder");
    let rendered = Render {
        width: 2,
        height: 1,
        rgb: vec![[0.0, 0.5, 1.5], [-1.0, 0.25, f32::NAN]],
        depth: vec![2.0, 0.0],
        alpha: vec![1.0, 0.5],
        labels: vec![0, 60_000],
        top_id: vec![16_777_215, -1],
        top_weight: vec![0.75, 0.0],
    };
    let all = [
        PictureKind::TopWeight,
        PictureKind::Rgb,
        PictureKind::Depth,
        PictureKind::Alpha,
        PictureKind::Labels,
        PictureKind::TopId,
    ];
    let names = |format| {
        let written = write_pictures(folder.path(), "left_00", &rendered, &all, (format, false)).expect("written");
        let name = |path: &std::path::PathBuf| path.file_name().expect("name").to_string_lossy().into_owned();
        written.iter().map(name).collect::<Vec<_>>().join(" ")
    };
    let common = "left_00.labels.png left_00.labels-colour.png left_00.top-id.exr left_00.top-weight.exr";
    assert_eq!(names(Format::Png), format!("left_00.rgb.png left_00.depth.png left_00.alpha.png {common}"));
    assert_eq!(names(Format::Exr), format!("left_00.rgb.exr left_00.depth.exr left_00.alpha.exr {common}"));

    let png = |name: &str| image::open(folder.path().join(name)).expect("PNG");
    assert_eq!(png("left_00.rgb.png").into_rgb8().into_raw(), [0, 128, 255, 0, 64, 0]);
    assert_eq!(png("left_00.labels.png").into_luma16().into_raw(), [0, 60_000]);
    assert_eq!(png("left_00.alpha.png").into_luma16().into_raw(), [65_535, 32_768]);
    assert_eq!(png("left_00.labels-colour.png").into_rgb8().into_raw()[..3], [0, 0, 0]);
    assert_eq!(exr(&folder.path().join("left_00.top-id.exr")), [("Y".to_owned(), vec![16_777_215.0, -1.0])]);
    assert_eq!(exr(&folder.path().join("left_00.depth.exr")), [("Y".to_owned(), vec![2.0, 0.0])]);
    let rgb = exr(&folder.path().join("left_00.rgb.exr"));
    assert_eq!(rgb.iter().map(|channel| channel.0.as_str()).collect::<Vec<_>>(), ["B", "G", "R"]);
    assert_eq!((rgb[0].1[0], rgb[2].1[1]), (1.5, -1.0), "an EXR is not clamped");
}

/// 32-bit ids are exact in an EXR, as rows beyond the whole numbers of floats are; a 16-bit PNG is refused.
#[test]
fn large_ids_and_rows_are_whole_numbers_of_32_bits() {
    let folder = tempfile::tempdir().expect("folder");
    let (labels, rows) = ([2_147_483_647, 16_777_217, 0], [16_777_217, -1, 2_147_483_647]);
    let rendered = Render { width: 3, height: 1, labels: labels.to_vec(), top_id: rows.to_vec(), ..Render::default() };
    let write = |format| {
        write_pictures(folder.path(), "a", &rendered, &[PictureKind::Labels, PictureKind::TopId], (format, true))
    };
    let error = write(Format::Png).expect_err("16 bits").to_string();
    assert!(error.contains("above 65535") && error.contains("exr"), "{error}");
    write(Format::Exr).expect("written");
    let words = |name: &str| {
        let image = read_first_flat_layer_from_file(folder.path().join(name)).expect("EXR");
        match &image.layer_data.channel_data.list[0].sample_data {
            exr::prelude::FlatSamples::U32(words) => words.clone(),
            other => panic!("{name}: {other:?}"),
        }
    };
    assert_eq!(words("a.labels.exr"), labels);
    assert_eq!(words("a.top-id.exr"), [16_777_217, u32::MAX, 2_147_483_647]);
}

#[test]
fn a_picture_of_another_size_is_refused() {
    let folder = tempfile::tempdir().expect("folder");
    let rendered = Render { width: 2, height: 2, alpha: vec![1.0], ..Render::default() };
    assert!(write_pictures(folder.path(), "a", &rendered, &[PictureKind::Alpha], (Format::Png, false)).is_err());
}
