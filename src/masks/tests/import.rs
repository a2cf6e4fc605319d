//! Every mask format is imported exactly; broken and ambiguous masks are refused.

use super::fixtures::*;
use super::forms::*;
use labelgs_files::LabelTable;
use labelgs_files::label_table::FILE_NAME;
use labelgs_masks::{Format, ImportOptions, ImportSummary, Overlap, import, read_mask};
use labelgs_scene::{Dataset, Error};
use labelgs_scenes::{self as scenes, LoadOptions};
use png::{BitDepth, ColorType};
use std::fs;
use std::path::Path;

fn dataset(scene: &Scene) -> Dataset {
    scenes::open(scene.path(), &LoadOptions { photos: false, test_every: None, ..LoadOptions::default() })
        .expect("a scene")
}

pub fn run(
    scene: &Scene,
    folder: &str,
    change: impl FnOnce(&mut ImportOptions),
) -> labelgs_scene::Result<ImportSummary> {
    let mut options = ImportOptions { folder: scene.path().join(folder), ..ImportOptions::default() };
    change(&mut options);
    let output = scene.path().join("out");
    let _ = fs::remove_dir_all(&output);
    import(&dataset(scene), &options, &output)
}

pub fn auto(scene: &Scene, folder: &str) -> labelgs_scene::Result<ImportSummary> {
    run(scene, folder, |_| ())
}

/// Checks that imported masks equal the ground truth with ids 1, 2, 3 replaced by `ids`, and that training reads them.
#[track_caller]
pub fn same_as_truth(scene: &Scene, done: &ImportSummary, ids: [u16; 3]) {
    let masks = scene.path().join("out");
    for photo in 0..PHOTOS {
        let expected: Vec<u16> =
            truth(photo).into_iter().map(|id| if id == 0 { 0 } else { ids[usize::from(id) - 1] }).collect();
        assert_eq!(read_mask(masks.join(format!("{}.png", name(photo)))).expect("a mask").ids, expected, "{photo}");
    }
    let table = LabelTable::read(&masks.join(FILE_NAME)).expect("a table");
    assert_eq!(table.labels, done.labels);
    let pixels = |object: u16| (0..PHOTOS).flat_map(truth).filter(|&id| id == object).count() as u64;
    for object in 1..=3 {
        let entry = table.entry(u32::from(ids[usize::from(object) - 1])).expect("an entry");
        assert_eq!((entry.pixels, entry.views), (pixels(object), PHOTOS as u32));
    }
    let options = LoadOptions { masks: Some(masks), ..LoadOptions::default() };
    assert!(scenes::open(scene.path(), &options).expect("a scene").all().iter().all(|view| view.mask.is_some()));
}

pub fn names(done: &ImportSummary) -> Vec<Option<&str>> {
    done.labels.iter().map(|entry| entry.name.as_deref()).collect()
}

pub fn sources(done: &ImportSummary) -> Vec<Option<&str>> {
    done.labels.iter().map(|entry| entry.source.as_deref()).collect()
}

#[test]
fn id_pictures_of_every_kind_come_back() {
    use Format::{DevaLong, DevaShort, Grey16, ObjectMask, Palette};
    let long = [300, 256, 70_000];
    let cases = [
        ("short", ColorType::Grayscale, BitDepth::Eight, [200, 7, 255], DevaShort),
        ("object_mask", ColorType::Grayscale, BitDepth::Eight, [200, 7, 255], ObjectMask),
        ("wide", ColorType::Grayscale, BitDepth::Sixteen, [65_535, 256, 65_534], Grey16),
        ("davis", ColorType::Indexed, BitDepth::Eight, [3, 1, 2], Palette),
        ("long", ColorType::Rgb, BitDepth::Eight, long, DevaLong),
    ];
    for (folder, colour, depth, ids, expected) in cases {
        let scene = scene();
        id_pictures(&scene.path().join(folder), colour, depth, ids);
        if expected == DevaLong {
            scene.write(&format!("{folder}/pred.json"), pred(ids));
        }
        let done = auto(&scene, folder).expect(folder);
        assert_eq!((done.format, done.bits, done.masks), (expected, 8, PHOTOS));
        let mut sorted = ids;
        sorted.sort_unstable();
        let new = ids.map(|id| sorted.iter().position(|&found| found == id).expect("there") as u16 + 1);
        same_as_truth(&scene, &done, new);
        assert_eq!(
            sources(&done),
            sorted.map(|id| id.to_string()).iter().map(|s| Some(s.as_str())).collect::<Vec<_>>()
        );
        let named = run(&scene, folder, |options| options.format = expected).expect(folder);
        assert_eq!(named.labels, done.labels);
    }
}

#[test]
fn a_run_of_deva_is_found_by_its_folder_and_named_by_its_categories() {
    let scene = scene();
    let ids = [300, 256, 70_000];
    id_pictures(&scene.path().join("deva/Annotations"), ColorType::Rgb, BitDepth::Eight, ids);
    scene.write("deva/pred.json", pred(ids));
    scene.photo("deva/Visualizations/00.jpg", 12, 8);
    for folder in ["deva", "deva/Annotations"] {
        // The name of the parent folder identifies the run only if the images were not moved.
        let done = run(&scene, folder, |o| o.pred = Some(scene.path().join("deva/pred.json"))).expect("imported");
        assert_eq!(
            (done.format, names(&done)),
            (Format::DevaLong, vec![Some("category 0"), Some("category 0 2"), None])
        );
        same_as_truth(&scene, &done, [2, 1, 3]);
        assert_eq!(auto(&scene, folder).expect("imported").labels, done.labels);
    }
    let categories = pred(ids).replacen('{', r#"{"categories": [{"id": 0, "name": "cup"}], "#, 1);
    scene.write("deva/pred.json", categories);
    assert_eq!(names(&auto(&scene, "deva").expect("imported")), [Some("cup"), Some("cup 2"), None]);
}

#[test]
fn black_and_white_folders_come_back_in_both_orders() {
    let objects = ["", "cup", "apple", "big plate"];
    let sorted = [Some("apple"), Some("big plate"), Some("cup")];
    let cases = [
        ("by_object", false, false, Format::BinaryFolders),
        ("by_photo", true, false, Format::PhotoFolders),
        ("lerf/test_mask", true, false, Format::LerfMask),
        ("ovs/segmentations", true, true, Format::ThreeDOvs),
    ];
    for (folder, by_photo, classes, expected) in cases {
        for white in [255, 1] {
            let scene = scene();
            let root = scene.path().join(folder);
            binary(white, &[1, 2, 3], |object, photo| {
                let (object, photo) = (objects[usize::from(object)], name(photo));
                root.join(if by_photo { format!("{photo}/{object}.png") } else { format!("{object}/{photo}.png") })
            });
            if classes {
                scene.write(&format!("{folder}/classes.txt"), "apple\nbig plate\ncup\nspoon\n");
            }
            let done = auto(&scene, folder.split('/').next().expect("a folder")).expect(folder);
            assert_eq!((done.format, names(&done), sources(&done)), (expected, sorted.to_vec(), sorted.to_vec()));
            same_as_truth(&scene, &done, [3, 1, 2]);
            assert_eq!(done.notes.iter().any(|note| note.contains("spoon")), classes, "{:?}", done.notes);
            assert_eq!(run(&scene, folder, |o| o.format = expected).expect(folder).labels, done.labels);
        }
    }
}

#[test]
fn folders_with_numbers_are_ordered_by_number() {
    let scene = scene();
    let numbers = ["", "10", "9", "2"];
    binary(255, &[1, 2, 3], |object, photo| {
        scene.path().join(format!("m/{}/{}.png", numbers[usize::from(object)], name(photo)))
    });
    let done = auto(&scene, "m").expect("imported");
    assert_eq!(sources(&done), [Some("2"), Some("9"), Some("10")]);
    same_as_truth(&scene, &done, [3, 2, 1]);
}

#[test]
fn more_than_255_ids_need_16_bits_and_more_than_65535_do_not_fit() {
    let scene = scene();
    let write = |photo: usize, (width, height): (u32, u32), first: u32, count: u32| {
        let ids = (0..width * height).map(|index| if index < count { first + index } else { 0 });
        let bytes: Vec<u8> = ids.flat_map(|id| id.to_le_bytes().into_iter().take(3)).collect();
        let path = scene.path().join(format!("m/{}.png", name(photo)));
        png(&path, (width, height), ColorType::Rgb, BitDepth::Eight, &bytes);
    };
    let long = |options: &mut ImportOptions| options.format = Format::DevaLong;
    write(0, (24, 16), 1000, 300);
    let done = run(&scene, "m", long).expect("imported");
    assert_eq!((done.bits, done.labels.len(), done.photos_without_mask.len()), (16, 300, PHOTOS - 1));
    let ids = read_mask(scene.path().join("out/00.png")).expect("a mask");
    assert_eq!((ids.width, ids.ids[299], ids.ids[300]), (24, 300, 0));
    write(0, (240, 160), 1000, 38_000);
    write(1, (240, 160), 39_000, 27_535);
    assert_eq!(run(&scene, "m", long).expect("imported").labels.len(), 65_535);
    write(1, (240, 160), 39_000, 27_536);
    let message = refusal(run(&scene, "m", long));
    assert!(message.contains("65536 different ids") && message.contains("at most 65535"), "{message}");
}

#[test]
fn shared_pixels_need_a_rule() {
    let scene = scene();
    let write = |object: &str, columns: std::ops::Range<usize>| {
        let bytes: Vec<u8> = (0..96).map(|index| if columns.contains(&(index % 12)) { 255 } else { 0 }).collect();
        grey8(&scene.path().join(format!("m/{object}/00.png")), &bytes);
    };
    write("a", 0..4);
    write("b", 2..10);
    let message = refusal(auto(&scene, "m"));
    for part in ["16 pixels in 1 photos", "00.png: 16 of a and b", "`overlap = smaller`", "`overlap = later`"] {
        assert!(message.contains(part), "{part}: {message}");
    }
    assert!(!scene.path().join("out").exists(), "nothing is written before everything is read");
    for (rule, middle) in [(Overlap::Smaller, 1), (Overlap::Later, 2)] {
        let done = run(&scene, "m", |options| options.overlap = rule).expect("imported");
        assert_eq!((done.overlaps.pixels, done.overlaps.photos), (16, 1));
        let ids = read_mask(scene.path().join("out/00.png")).expect("a mask").ids;
        assert_eq!(ids[..12], [1, 1, middle, middle, 2, 2, 2, 2, 2, 2, 0, 0]);
    }
}

#[test]
fn soft_edges_are_cut_only_when_asked() {
    let scene = scene();
    let bytes: Vec<u8> = (0..96).map(|index| [0, 0, 100, 127, 128, 200, 255, 255, 255, 90, 0, 0][index % 12]).collect();
    grey8(&scene.path().join("m/cup/00.png"), &bytes);
    let message = refusal(auto(&scene, "m"));
    assert!(message.contains("cup/00.png is not") && message.contains("format = binary-folders"), "{message}");
    let done = run(&scene, "m", |options| options.format = Format::BinaryFolders).expect("imported");
    assert!(done.notes.iter().any(|note| note.contains("1 masks have more values")), "{:?}", done.notes);
    let ids = read_mask(scene.path().join("out/00.png")).expect("a mask").ids;
    assert_eq!(ids[..12], [0, 0, 0, 0, 1, 1, 1, 1, 1, 0, 0, 0]);
}

#[test]
fn soft_id_pictures_are_imported_only_as_told() {
    let scene = scene();
    let row = [0, 0, 0, 60, 190, 255, 255, 255, 120, 30, 0, 0];
    (0..PHOTOS).for_each(|photo| grey8(&scene.path().join(format!("m/{}.png", name(photo))), &row.repeat(8)));
    let message = refusal(auto(&scene, "m"));
    assert!(
        message.contains("5 of 5 examined masks have soft edges") && message.contains("`format = binary`"),
        "{message}"
    );
    let told = run(&scene, "m", |options| options.format = Format::DevaShort).expect("imported");
    assert!(told.labels.len() == 5 && told.notes.iter().any(|note| note.contains("soft edges")), "{:?}", told.notes);
    let sharp = run(&scene, "m", |options| options.format = Format::Binary).expect("imported");
    assert_eq!((sharp.labels.len(), names(&sharp)), (1, vec![Some("object")]));
    let ids = read_mask(scene.path().join("out/00.png")).expect("a mask").ids;
    assert_eq!(ids[..12], [0, 0, 0, 0, 1, 1, 1, 1, 0, 0, 0, 0]);
}

#[test]
fn grey_that_is_stored_as_colours_is_read_as_grey() {
    let scene = scene();
    let write = |photo: usize, ids: [u8; 3], colour: ColorType| {
        let value = |id: u16| if id == 0 { 0 } else { ids[usize::from(id) - 1] };
        let pixel = |id: u16| match colour {
            ColorType::Rgba => vec![value(id), value(id), value(id), 255],
            ColorType::Rgb => vec![value(id); 3],
            ColorType::GrayscaleAlpha => vec![value(id), 255],
            _ => vec![value(id)],
        };
        let bytes: Vec<u8> = truth(photo).into_iter().flat_map(pixel).collect();
        png(&scene.path().join(format!("m/{}.PNG", name(photo))), SIZE, colour, BitDepth::Eight, &bytes);
    };
    let kinds = [ColorType::Rgba, ColorType::Rgb, ColorType::GrayscaleAlpha, ColorType::Grayscale, ColorType::Rgba];
    kinds.into_iter().enumerate().for_each(|(photo, colour)| write(photo, [200, 7, 255], colour));
    let done = auto(&scene, "m").expect("imported");
    assert_eq!(done.format, Format::DevaShort);
    same_as_truth(&scene, &done, [2, 1, 3]);
    // A single coloured image; the black frame of a tracker is of the same kind.
    id_pictures(&scene.path().join("long"), ColorType::Rgb, BitDepth::Eight, [300, 256, 70_000]);
    png(&scene.path().join("long/03.png"), SIZE, ColorType::Rgb, BitDepth::Eight, &[0; 288]);
    scene.write("long/pred.json", pred([300, 256, 70_000]));
    assert_eq!(auto(&scene, "long").expect("imported").format, Format::DevaLong);
}

#[test]
fn ambiguous_masks_are_refused_with_the_flags_that_decide() {
    // A folder of mirrored black and white id images, or the object `left`.
    let scene = Scene::new();
    scene.colmap_bin("sparse/0", &[pinhole()], &["left/a.png", "left/b.png"]);
    ["left/a.png", "left/b.png"].iter().for_each(|name| scene.photo(&format!("images/{name}"), 12, 8));
    ["a", "b"].iter().for_each(|name| {
        let bytes: Vec<u8> = (0..96).map(|index| u8::from(index % 12 > 6)).collect();
        grey8(&scene.path().join(format!("m/left/{name}.png")), &bytes);
    });
    let message = refusal(auto(&scene, "m"));
    for part in ["NAME.png (2 photos)", "OBJECT/NAME.png (2 photos)", "format = binary-folders", "deva-short"] {
        assert!(message.contains(part), "{part}: {message}");
    }
    let sources_as = |format| run(&scene, "m", |o| o.format = format).expect("imported").labels[0].source.clone();
    assert_eq!(sources_as(Format::DevaShort).as_deref(), Some("1"));
    assert_eq!(sources_as(Format::BinaryFolders).as_deref(), Some("left"));
    assert!(scene.path().join("out/left/b.png").is_file());
    // With three values it can only be id images.
    grey8(&scene.path().join("m/left/a.png"), &(0..96).map(|index| index % 3).collect::<Vec<u8>>());
    assert_eq!(auto(&scene, "m").expect("imported").format, Format::DevaShort);
}

#[test]
fn colours_are_ids_only_if_told_or_proved() {
    let scene = scene();
    let ids = [300, 256, 70_000];
    id_pictures(&scene.path().join("m"), ColorType::Rgb, BitDepth::Eight, ids);
    let message = refusal(auto(&scene, "m"));
    assert!(message.contains("format = deva-long") && message.contains("`pred`"), "{message}");
    same_as_truth(&scene, &run(&scene, "m", |o| o.format = Format::DevaLong).expect("imported"), [2, 1, 3]);
    let wrong = scene.write("pred.json", pred([300, 256, 9]));
    let message = refusal(run(&scene, "m", |options| options.pred = Some(wrong)));
    assert!(message.contains("1 of 3 ids") && message.contains("70000"), "{message}");
    let right = scene.write("pred.json", pred(ids));
    assert_eq!(run(&scene, "m", |o| o.pred = Some(right)).expect("imported").format, Format::DevaLong);
    let broken = scene.write("pred.json", "{}");
    assert!(refusal(run(&scene, "m", |o| o.pred = Some(broken))).contains("annotations"));
    let zero = scene.write("pred.json", pred([0, 1, 2]));
    assert!(refusal(run(&scene, "m", |o| o.pred = Some(zero))).contains("id 0"));
}

#[test]
fn each_broken_folder_has_its_message() {
    let refused = |prepare: &dyn Fn(&Path), expected: &str| {
        let scene = scene();
        id_pictures(&scene.path().join("m"), ColorType::Grayscale, BitDepth::Eight, [1, 2, 3]);
        prepare(&scene.path().join("m"));
        let message = refusal(auto(&scene, "m"));
        assert!(message.contains(expected), "{expected}: {message}");
        assert!(!scene.path().join("out").exists());
    };
    let gone = |folder: &Path| fs::remove_dir_all(folder).expect("removed");
    refused(&|folder| gone(folder), "no such mask folder");
    refused(
        &|folder| {
            gone(folder);
            fs::create_dir(folder).expect("made");
        },
        "expected for example 00.png",
    );
    refused(
        &|folder| {
            gone(folder);
            grey8(&folder.join("other.png"), &[1; 96]);
        },
        "it holds other.png",
    );
    refused(
        &|folder| png(&folder.join("01.png"), SIZE, ColorType::Grayscale, BitDepth::Sixteen, &[0; 192]),
        "4 8-bit grey (00.png), 1 16-bit grey (01.png)",
    );
    refused(
        &|folder| png(&folder.join("01.png"), (12, 12), ColorType::Grayscale, BitDepth::Eight, &[1; 144]),
        "12 x 12 px and its photo 01.png 12 x 8 px",
    );
    refused(
        &|folder| (0..PHOTOS).for_each(|photo| grey8(&folder.join(name(photo)).with_extension("png"), &[0; 96])),
        "no mask marks an object",
    );
    refused(
        &|folder| {
            for photo in 0..PHOTOS {
                png(&folder.join(name(photo)).with_extension("png"), SIZE, ColorType::Rgba, BitDepth::Eight, &[1; 384]);
            }
        },
        "transparent pixels",
    );
    refused(
        &|folder| {
            for photo in 0..PHOTOS {
                let bytes: Vec<u8> = [0, 1, 0, 2, 0, 3].repeat(96);
                png(&folder.join(name(photo)).with_extension("png"), SIZE, ColorType::Rgb, BitDepth::Sixteen, &bytes);
            }
        },
        "cannot hold ids",
    );
    refused(&|folder| fs::write(folder.join("01.png"), b"no png").expect("written"), "not a readable PNG");
    refused(
        &|folder| {
            gone(folder);
            grey8(&folder.join("object_mask/00.png"), &[1; 96]);
            grey8(&folder.join("test_mask/00/cup.png"), &[1; 96]);
        },
        "`format = object-mask` or `format = lerf-mask`",
    );
    refused(
        &|folder| {
            gone(folder);
            png(&folder.join("cup/00.png"), SIZE, ColorType::GrayscaleAlpha, BitDepth::Eight, &[255, 9].repeat(96));
        },
        "cup/00.png is not",
    );
}

#[test]
fn a_named_form_that_the_pictures_do_not_have_is_refused() {
    let scene = scene();
    id_pictures(&scene.path().join("m"), ColorType::Grayscale, BitDepth::Eight, [1, 2, 3]);
    let message = refusal(run(&scene, "m", |options| options.format = Format::Palette));
    assert!(message.contains("8-bit grey image where palette is expected"), "{message}");
    assert!(refusal(run(&scene, "m", |options| options.format = Format::LerfMask)).contains("00/OBJECT.png"));
    fs::create_dir_all(scene.path().join("full/x")).expect("made");
    let options = ImportOptions { folder: scene.path().join("m"), ..ImportOptions::default() };
    let error = import(&dataset(&scene), &options, &scene.path().join("full")).expect_err("not empty");
    assert!(matches!(error, Error::Usage { .. }), "{error}");
}

#[test]
fn strays_and_gaps_are_listed() {
    let scene = scene();
    let folder = scene.path().join("m");
    id_pictures(&folder, ColorType::Grayscale, BitDepth::Eight, [1, 2, 3]);
    fs::rename(folder.join("03.png"), folder.join("3.png")).expect("renamed");
    let done = auto(&scene, "m").expect("imported");
    assert_eq!((done.photos_without_mask, done.masks_without_photo), (vec!["03.png".into()], vec!["3.png".into()]));
    assert_eq!(done.masks, PHOTOS - 1);
    assert!(!scene.path().join("out/03.png").exists());
}

#[test]
fn photos_that_differ_only_in_their_extension_get_masks_of_their_own() {
    let scene = Scene::new();
    let photos = ["a.jpg", "a.png", "b.jpeg"];
    scene.colmap_bin("sparse/0", &[pinhole()], &photos);
    photos.iter().for_each(|name| scene.photo(&format!("images/{name}"), 12, 8));
    grey8(&scene.path().join("m/a.jpg.png"), &[5; 96]);
    grey8(&scene.path().join("m/a.png.png"), &[6; 96]);
    // DEVA removes four characters.
    grey8(&scene.path().join("m/b..png"), &[7; 96]);
    auto(&scene, "m").expect("imported");
    let id = |name: &str| read_mask(scene.path().join("out").join(name)).expect(name).ids[0];
    assert_eq!([id("a.jpg.png"), id("a.png.png"), id("b.png")], [1, 2, 3]);
}
