//! Rules of scoring: missing predictions, empty selections, variants of the published scorers, and the HTML page.

use super::{Columns, columns_file, run_on, view};
use labelgs::cli::support::exit_status::exit_status;
use labelgs::eval::page::Page;
use labelgs::eval::protocol::{Protocol, SelectBy};
use labelgs::eval::{PictureObserver, ScoredPicture};
use labelgs::files::image::{read_grey, write_png_grey8};
use labelgs::scene::colour::{HEAT_COLOURS, HEAT_MAX, colour_on_scale};
use labelgs::scenes::truth::read_truth;
use std::collections::BTreeMap;
use tempfile::tempdir;

const VIEWS: (&[&str], usize) = (&["a.jpg", "b.jpg"], 0);

#[test]
fn a_frame_without_a_view_counts_as_nothing_and_is_listed() {
    let folder = tempdir().expect("folder");
    for frame in ["a", "b", "zzz"] {
        columns_file(&folder.path().join(frame).join("cup.png"), 0..2);
    }
    let columns = Columns::new([1, 1, 0, 0, 0, 0, 0, 0]);
    let how = (Protocol::Labelgs, false, SelectBy::Prompt);
    let found = run_on(how, folder.path(), VIEWS, &[], columns).expect("scored");
    assert_eq!((found.views["b"]["cup"].iou, found.views["zzz"]["cup"].iou), (Some(1.0), Some(0.0)));
    assert_eq!((found.headline.iou, found.views["zzz"]["cup"].psnr), (Some(0.5), Some(0.0)));
    assert_eq!(found.missing.len(), 1);
    assert_eq!((&found.missing[0].object[..], found.missing[0].frame.as_deref()), ("cup", Some("zzz")));
    let json = serde_json::to_value(&found).expect("JSON");
    assert_eq!(
        (&json["schema_version"], &json["protocol"], &json["lpips"]),
        (&1.into(), &"labelgs".into(), &"no weights".into())
    );
    assert!(json["missing"][0]["reason"].as_str().is_some_and(|text| text.contains("zzz")));
    assert!(json["objects"]["cup"]["iou"] == 0.5 && json["objects"]["cup"]["labels"][0] == 1, "{json}");
}

#[test]
fn an_empty_selection_is_nothing_unless_the_papers_way_is_asked_for() {
    let folder = tempdir().expect("folder");
    for frame in ["a", "b"] {
        columns_file(&folder.path().join(frame).join("cup.png"), 0..2);
    }
    // Half of label 1 is in the prompt: that is not more than half.
    let run = |compat| {
        let columns = Columns::new([1, 1, 1, 1, 0, 0, 0, 0]);
        run_on((Protocol::Labelgs, compat, SelectBy::Prompt), folder.path(), VIEWS, &[], columns).expect("scored")
    };
    let (strict, compat) = (run(false), run(true));
    assert_eq!(
        (strict.headline.iou, strict.mean.pairs.psnr, strict.mean.pairs.ssim),
        (Some(0.0), Some(0.0), Some(0.0))
    );
    assert!(
        strict.empty[0].reason.contains("32 of 64") || strict.empty[0].reason.contains("16 of 32"),
        "{:?}",
        strict.empty
    );
    // All eight columns are drawn in place of two.
    assert_eq!((compat.headline.key, compat.headline.iou), ("iou_colour", Some(0.25)));
    assert_eq!(compat.empty.len(), 1, "it is listed all the same");
    assert!(compat.rules.iter().any(|rule| rule.contains("whole scene")) && compat.compat);
    assert!(strict.check(None, Some(0.1)).is_err_and(|error| exit_status(&error) == 1));
    assert!(compat.check(Some(1.0), Some(0.2)).is_ok());
}

#[test]
fn dark_objects_are_lost_by_the_colour_rule_only() {
    let folder = tempdir().expect("folder");
    for frame in ["a", "b"] {
        columns_file(&folder.path().join(frame).join("cup.png"), 0..2);
    }
    let run = |compat| {
        let columns = Columns { dark: vec![2], ..Columns::new([1, 2, 0, 0, 0, 0, 0, 0]) };
        run_on((Protocol::Labelgs, compat, SelectBy::Prompt), folder.path(), VIEWS, &[], columns).expect("scored")
    };
    let (strict, compat) = (run(false), run(true));
    assert_eq!((strict.mean.pairs.iou, strict.mean.pairs.iou_colour), (Some(1.0), Some(0.5)));
    assert_eq!((strict.headline.iou, compat.headline.iou), (Some(1.0), Some(0.5)));
    // Grey pictures: channels agree, and the mean of their PSNR is the PSNR of their mean.
    let psnr = |found: &labelgs::eval::protocol::Report| found.mean.pairs.psnr.expect("a number");
    assert!((psnr(&strict) - psnr(&compat)).abs() < 1e-9);
    assert_ne!(strict.mean.pairs.ssim, compat.mean.pairs.ssim, "another window");
}

#[test]
fn truth_is_read_at_its_own_size_up_to_the_views() {
    let folder = tempdir().expect("folder");
    let file = folder.path().join("mask.png");
    let view = view("a.jpg");
    let read = |side: u32, bytes: &[u8]| {
        write_png_grey8(&file, side, side, bytes).expect("written");
        read_truth(&file, &view, &BTreeMap::new())
    };
    let small = read(4, &[vec![1; 4], vec![0; 12]].concat()).expect("a mask of 0 and 1");
    assert_eq!((small.width, small.inside.iter().filter(|&&inside| inside).count()), (4, 4));
    let grey = read(4, &[vec![128; 8], vec![129; 8]].concat()).expect("a mask");
    assert_eq!(grey.inside.iter().filter(|&&inside| inside).count(), 8, "128 is outside");
    let large = read(16, &[vec![255; 128], vec![0; 128]].concat()).expect("a mask");
    assert_eq!((large.width, large.inside.iter().filter(|&&inside| inside).count()), (8, 32));
    write_png_grey8(&file, 8, 4, &[255; 32]).expect("written");
    let text = super::message(read_truth(&file, &view, &BTreeMap::new()));
    assert!(text.contains("8 x 4 px") && text.contains("a.jpg 8 x 8 px") && text.contains("same photos"), "{text}");
    assert_eq!(read_grey(&file).expect("grey").2, [255; 32]);
}

#[test]
fn the_page_shows_each_picture_and_needs_no_network() {
    let folder = tempdir().expect("folder");
    let place = folder.path().join("page");
    let view = view("a.jpg");
    let photo = view.photo().expect("a photo");
    let mut page = Page::new(&place).expect("a folder");
    let (found, truth) =
        ([[true; 32], [false; 32]].concat(), [[true; 16], [false; 16], [true; 16], [false; 16]].concat());
    let rgb = vec![[1.0, 0.5, 0.0]; 64];
    let picture = ScoredPicture {
        object: Some("<cup> & saucer".into()),
        masks: Some((&found, &truth)),
        numbers: vec![("iou", Some(0.25)), ("psnr", None)],
        note: "nothing \"chosen\"".into(),
        ..ScoredPicture::new("a", &photo, &rgb)
    };
    page.observe(&picture).expect("written");
    page.observe(&ScoredPicture::new("b", &photo, &rgb)).expect("written");
    let index = page.finish(&maud::html! { "mean <1>" }).expect("written");
    let html = std::fs::read_to_string(index).expect("HTML");
    assert!(html.contains("&lt;cup&gt; &amp; saucer") && html.contains("iou 0.250") && html.contains("mean &lt;1&gt;"));
    assert!(!html.contains("://") && !html.contains("<cup>") && !html.contains("psnr"), "{html}");
    for name in ["00001-truth.png", "00001-prediction.png", "00001-difference.png", "00002-difference.png"] {
        assert!(html.contains(&format!("src=\"{name}\"")) && place.join(name).is_file(), "{name}");
    }
    let difference = image::open(place.join("00001-difference.png")).expect("PNG").into_rgb8();
    let colours: std::collections::BTreeSet<[u8; 3]> = difference.pixels().map(|pixel| pixel.0).collect();
    assert_eq!(colours.len(), 4, "found and true, only found, only true, neither");
    let plain = image::open(place.join("00002-difference.png")).expect("PNG").into_rgb8();
    let mean = (0.2 + 0.3 + 0.8) / 3.0;
    assert_eq!(
        plain.get_pixel(0, 0).0,
        colour_on_scale(&HEAT_COLOURS, mean / HEAT_MAX),
        "the mean difference of the channels"
    );
    assert!(Page::new(&place).is_err_and(|error| exit_status(&error) == 2), "another page's pictures would stay");
}
