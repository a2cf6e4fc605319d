//! Files of each benchmark, written here, with a known score.

use super::{Columns, columns_file, layout, run_on};
use labelgs::eval::protocol::{Prompt, Protocol, SelectBy};
use tempfile::tempdir;

#[test]
fn labelgs_takes_the_first_frame_as_the_prompt() {
    let folder = tempdir().expect("folder");
    let truth = folder.path();
    for (frame, columns) in [("01", 0..3), ("05", 0..3), ("09", 0..4)] {
        columns_file(&truth.join(frame).join("red cup.png"), columns);
    }
    columns_file(&truth.join("05/late.png"), 5..6);
    // Labels 1 and 4 lie in the prompt, 2 has half of its pixels there, which is not more than half.
    let columns = Columns::new([1, 4, 2, 2, 0, 3, 3, 3]);
    let found =
        run_on((Protocol::Labelgs, false, SelectBy::Prompt), truth, (&["01.jpg", "05.jpg", "09.jpg"], 1), &[], columns)
            .expect("scored");
    assert_eq!(found.objects["red cup"].labels, [1, 4]);
    assert_eq!(found.views.keys().collect::<Vec<_>>(), ["05", "09"], "the prompt is no test");
    // Two columns found; the ground truth has three, then four.
    assert_eq!(found.views["05"]["red cup"].iou, Some(2.0 / 3.0));
    assert_eq!(found.views["09"]["red cup"].iou, Some(0.5));
    assert_eq!(found.views["05"]["red cup"].accuracy, Some(7.0 / 8.0));
    assert_eq!(found.headline.iou, Some((2.0 / 3.0 + 0.5) / 2.0));
    assert_eq!((found.mean.pair_count, found.mean.object_count), (2, 1));
    assert!(found.left_out.iter().any(|text| text.contains("late")), "{:?}", found.left_out);
    // One of eight columns is 0.8 instead of 0, or the other way round.
    let expected = -10.0 * (0.8_f64 * 0.8 / 8.0).log10();
    let psnr = found.views["05"]["red cup"].psnr.expect("a number");
    assert!((psnr - expected).abs() < 1e-4, "{psnr}");
}

#[test]
fn lerf_mask_chooses_by_name_and_averages_over_prompts() {
    let folder = tempdir().expect("folder");
    let truth = folder.path();
    columns_file(&truth.join("0/apple.png"), 0..2);
    columns_file(&truth.join("1/apple.png"), 0..4);
    columns_file(&truth.join("1/old camera.png"), 6..8);
    let run = |compat| {
        let views = (&["a.jpg", "b.jpg", "c.jpg"][..], 1);
        let names = [(1, "Apple"), (9, "old camera")];
        let columns = Columns::new([1, 1, 0, 0, 0, 0, 2, 2]);
        run_on((Protocol::LerfMask, compat, SelectBy::Name), truth, views, &names, columns).expect("scored")
    };
    let found = run(false);
    assert_eq!(found.objects["apple"].labels, [1], "names differ in case only");
    assert_eq!(found.views["0"]["apple"].iou, Some(1.0), "number 0 is the first test view");
    assert_eq!(found.views["1"]["apple"].iou, Some(0.5));
    assert_eq!(found.views["1"]["old camera"].iou, Some(0.0), "label 9 has no Gaussian");
    assert_eq!((found.empty.len(), &found.empty[0].object[..]), (1, "old camera"));
    assert_eq!((found.headline.average, found.headline.iou), ("objects", Some(0.375)));
    assert_eq!(found.mean.pairs.iou, Some(0.5));
    let compat = run(true);
    assert_eq!((compat.headline.iou, compat.mean.object_count), (Some(0.75), 1), "what is absent is not counted");
    assert!(compat.left_out.iter().any(|text| text.contains("old camera")), "{:?}", compat.left_out);
    assert!(compat.rules.iter().any(|rule| rule.contains("excluded")));
}

#[test]
fn three_d_ovs_reads_its_classes() {
    let folder = tempdir().expect("folder");
    let truth = folder.path();
    for class in ["gray sofa", "pikachu", "stray"] {
        columns_file(&truth.join("00").join(format!("{class}.png")), 0..2);
        columns_file(&truth.join("07").join(format!("{class}.png")), 0..2);
    }
    let by_name = (Protocol::ThreeDOvs, false, SelectBy::Name);
    let views = (&["00.jpg", "07.jpg"][..], 0);
    std::fs::write(truth.join("classes.txt"), "gray sofa\npikachu\nghost\n").expect("written");
    let names = [(3, "gray sofa"), (4, "pikachu")];
    let found = run_on(by_name, truth, views, &names, Columns::new([3, 3, 4, 0, 0, 0, 0, 0])).expect("scored");
    assert_eq!((found.objects["gray sofa"].mean.iou, found.objects["pikachu"].mean.iou), (Some(1.0), Some(0.0)));
    assert_eq!((found.headline.iou, found.headline.average, found.mean.pair_count), (Some(0.5), "pairs", 4));
    let listed = found.left_out.join("; ");
    assert!(listed.contains("stray") && listed.contains("ghost"), "{listed}");
    // By masks instead of names: the first frame is the prompt.
    let by_prompt = (Protocol::ThreeDOvs, false, SelectBy::Prompt);
    let found = run_on(by_prompt, truth, views, &[], Columns::new([3, 3, 4, 0, 0, 0, 0, 0])).expect("scored");
    assert_eq!((found.headline.iou, found.mean.pair_count), (Some(1.0), 2));
}

#[test]
fn nvos_follows_the_strokes() {
    let folder = tempdir().expect("folder");
    let truth = folder.path();
    columns_file(&truth.join("masks/scene_left/IMG_2_mask.png"), 0..3);
    columns_file(&truth.join("masks/scene_centre/IMG_2_mask.png"), 6..8);
    columns_file(&truth.join("masks/other/IMG_7_mask.png"), 6..8);
    for scene in ["scene_left", "scene_centre"] {
        let folder = truth.join("reference_image").join(scene);
        std::fs::create_dir_all(&folder).expect("folder");
        std::fs::write(folder.join("IMG_1.JPG"), "only its name is used").expect("written");
    }
    columns_file(&truth.join("scribbles/scene_left/pos_0_scene.png"), 0..4);
    columns_file(&truth.join("scribbles/scene_left/neg_0_scene.png"), 3..8);
    columns_file(&truth.join("reference_image/scene_centre/IMG_1_mask.png"), 5..8);
    // Label 3 has a column under both kinds of strokes, and more under the other kind.
    let columns = Columns::new([1, 2, 2, 3, 3, 3, 4, 4]);
    let views = (&["IMG_1.JPG", "IMG_2.JPG"][..], 1);
    let found = run_on((Protocol::Nvos, false, SelectBy::Prompt), truth, views, &[], columns).expect("scored");
    assert_eq!(found.objects.keys().collect::<Vec<_>>(), ["scene_centre", "scene_left"], "not the other scene");
    assert_eq!(found.objects["scene_left"].labels, [1, 2]);
    assert_eq!(found.objects["scene_centre"].labels, [4], "a mask of the reference view is used where there is one");
    assert_eq!((found.headline.iou, found.mean.pairs.accuracy), (Some(1.0), Some(1.0)));
    let names = layout(Protocol::Nvos, truth, "other", SelectBy::Name).expect("a layout");
    assert_eq!((names.tasks.len(), &names.tasks[0].prompt), (1, &Prompt::Name));
}

#[test]
fn binary_masks_are_of_one_object_or_of_several() {
    let folder = tempdir().expect("folder");
    let flat = folder.path().join("truck");
    for (frame, columns) in [("a", 0..2), ("b", 0..2), ("c", 0..1)] {
        columns_file(&flat.join(format!("{frame}.png")), columns.clone());
        columns_file(&folder.path().join("many/2").join(format!("{frame}.png")), columns);
    }
    columns_file(&folder.path().join("many/cab/b.png"), 4..6);
    columns_file(&folder.path().join("many/cab/c.png"), 4..6);
    let views = (&["a.png", "b.png", "c.png"][..], 0);
    let columns = || Columns::new([2, 2, 0, 0, 5, 0, 0, 0]);
    let found = run_on((Protocol::Binary, false, SelectBy::Prompt), &flat, views, &[], columns()).expect("scored");
    assert_eq!((found.objects["truck"].labels.clone(), found.headline.iou), (vec![2], Some(0.75)));
    let many = folder.path().join("many");
    let found = run_on((Protocol::Binary, false, SelectBy::Prompt), &many, views, &[], columns()).expect("scored");
    assert_eq!(found.views["c"]["cab"].iou, Some(0.5), "its own first frame is its prompt");
    assert!(!found.views["b"].contains_key("cab"));
    // A folder's name may be an id.
    let found =
        run_on((Protocol::Binary, false, SelectBy::Name), &many, views, &[(5, "cab")], columns()).expect("scored");
    assert_eq!((found.objects["2"].labels.clone(), found.objects["2"].frames), (vec![2], 3));
}
