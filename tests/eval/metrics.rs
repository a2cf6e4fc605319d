//! Scores, choice of labels and selections against brute force or values worked out by hand.

use labelgs::cli::support::exit_status::exit_status;
use labelgs::edit::choose::{candidates, choose_labels, require_labels};
use labelgs::edit::{Catalogue, MIN_LABEL_CONFIDENCE, extract, remove, summarise};
use labelgs::eval::boundary::{boundary_iou, rim, rim_width};
use labelgs::eval::crop::Crop;
use labelgs::eval::metrics::{Overlap, paper_score};
use labelgs::eval::scores::{ObjectRender, ObjectTruth};
use labelgs::eval::specks::specks;
use labelgs::eval::ssim::{ssim_map, window};
use labelgs::eval::ssim8::{ssim8, to_bytes};
use labelgs::eval::{Scores, ViewScores, psnr, ssim};
use labelgs::scene::{Gaussians, LabelMap, Photo};
use std::collections::BTreeMap;

/// A repeatable number in 0 to 1.
fn random(index: usize) -> f64 {
    let mut word = (index as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    word = (word ^ (word >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    ((word ^ (word >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
}

fn photo(width: u32, height: u32) -> Photo {
    let byte = |index: usize| (random(index) * 256.0) as u8;
    let pixel = |i: usize| [byte(3 * i), byte(3 * i + 1), byte(3 * i + 2), 255];
    Photo { width, height, rgba: (0..(width * height) as usize).map(pixel).collect() }
}

fn colours(photo: &Photo) -> Vec<[f32; 3]> {
    photo.rgba.iter().map(|p| [p[0], p[1], p[2]].map(|byte| f32::from(byte) / 255.0)).collect()
}

fn map(width: u32, ids: &[u16]) -> LabelMap {
    LabelMap { width, height: ids.len() as u32 / width, ids: ids.to_vec() }
}

#[test]
fn psnr_by_hand() {
    let mut photo = Photo { width: 2, height: 1, rgba: vec![[255, 0, 51, 255], [0, 0, 0, 0]] };
    // Clamped to 1, 0, 0.3: one error of 0.1 among three values; the second pixel is not valid.
    let render = [[1.5, -0.5, 0.3], [0.5, 0.5, 0.5]];
    let expected = -10.0 * (0.01_f64 / 3.0).log10();
    assert!((psnr(&render, &photo) - expected).abs() < 1e-5);
    photo.rgba[1][3] = 255;
    let expected = -10.0 * ((0.01_f64 + 0.75) / 6.0).log10();
    assert!((psnr(&render, &photo) - expected).abs() < 1e-5);
    assert_eq!(psnr(&colours(&photo), &photo), f64::INFINITY);
}

#[test]
fn ssim_equals_the_direct_sum() {
    let (width, height) = (17, 13);
    let a: Vec<f64> = (0..width * height).map(random).collect();
    let b: Vec<f64> = (0..width * height).map(|i| 0.7 * a[i] + 0.3 * random(i + 999)).collect();
    let w = window();
    assert!((w.iter().sum::<f64>() - 1.0).abs() < 1e-15 && (w[5] / w[4] - (0.5_f64 / 2.25).exp()).abs() < 1e-12);
    let found = ssim_map(&a, &b, width, height);
    for y in 0..height {
        for x in 0..width {
            let mut sums = [0.0; 5];
            for dy in 0..11 {
                for dx in 0..11 {
                    let (row, column) = ((y + dy).wrapping_sub(5), (x + dx).wrapping_sub(5));
                    if row < height && column < width {
                        let (p, q) = (a[row * width + column], b[row * width + column]);
                        let terms = [p, q, p * p, q * q, p * q];
                        (0..5).for_each(|i| sums[i] += w[dy] * w[dx] * terms[i]);
                    }
                }
            }
            let [p, q, pp, qq, pq] = sums;
            let expected = (2.0 * p * q + 1e-4) * (2.0 * (pq - p * q) + 9e-4)
                / ((p * p + q * q + 1e-4) * (pp - p * p + qq - q * q + 9e-4));
            assert!((found[y * width + x] - expected).abs() < 1e-12, "{x} {y}");
        }
    }
}

#[test]
fn ssim_of_equal_images_is_one() {
    let mut photo = photo(20, 15);
    let mut render = colours(&photo);
    assert!((ssim(&render, &photo) - 1.0).abs() < 1e-6);
    photo.rgba[7][3] = 0;
    render[7] = [9.0; 3];
    assert!((ssim(&render, &photo) - 1.0).abs() < 1e-6, "an invalid pixel counts");
    render[100] = [0.0; 3];
    assert!(ssim(&render, &photo) < 0.999);
}

#[test]
fn iou_by_hand() {
    let pairs = [(true, true), (true, false), (false, true), (false, false)];
    assert_eq!(Overlap::count(pairs).iou(), Some(1.0 / 3.0));
    assert_eq!(Overlap::count([(false, false)]).iou(), None);
}

#[test]
fn paper_score_by_hand() {
    let photo = Photo { width: 2, height: 1, rgba: vec![[255, 0, 0, 255], [255, 255, 255, 255]] };
    // Wrong by 0.1, 0.2 and 0.4 in the first pixel; the second is outside the mask, black, and faintly covered.
    let object = [[0.9, 0.2, 0.4], [0.0, 0.02, 0.0]];
    let found = paper_score(&object, &photo, &[true, false]);
    let channel = |square: f64| -10.0 * (square / 2.0).log10();
    let expected = (channel(0.01) + channel(0.04 + 0.0004) + channel(0.16)) / 3.0;
    assert!((found.psnr - expected).abs() < 1e-5);
    assert_eq!(found.iou, Some(0.5));
}

/// A mask of the pixels of `columns` and `rows`, ends excluded.
fn box_mask(width: usize, height: usize, columns: (usize, usize), rows: (usize, usize)) -> Vec<bool> {
    let inside = |i: usize| (columns.0..columns.1).contains(&(i % width)) && (rows.0..rows.1).contains(&(i / width));
    (0..width * height).map(inside).collect()
}

#[test]
fn a_rim_is_the_mask_less_its_repeated_erosion() {
    assert_eq!((rim_width(4, 3), rim_width(1440, 1080), rim_width(100, 75)), (1, 36, 3));
    let (width, height) = (23, 17);
    for seed in 0..6 {
        let mask: Vec<bool> = (0..width * height).map(|i| random(i + 1000 * seed) < 0.97).collect();
        let mut eroded = mask.clone();
        for reach in 1..4 {
            let before = eroded.clone();
            let keeps = |i: usize| {
                let (x, y) = ((i % width) as i64, (i / width) as i64);
                let mut around = (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (x + dx, y + dy)));
                around.all(|(x, y)| {
                    (0..width as i64).contains(&x)
                        && (0..height as i64).contains(&y)
                        && before[y as usize * width + x as usize]
                })
            };
            eroded = (0..width * height).map(keeps).collect();
            let expected: Vec<bool> = mask.iter().zip(&eroded).map(|(&mask, &deep)| mask && !deep).collect();
            assert_eq!(rim(&mask, width, height, reach), expected, "seed {seed} reach {reach}");
        }
    }
}

#[test]
fn specks_by_hand() {
    #[rustfmt::skip]
    let found = map(10, &[
        1, 1, 1, 1, 1, 0, 0, 0, 0, 0,
        1, 5, 1, 1, 1, 0, 7, 7, 0, 0,
        1, 1, 1, 1, 1, 0, 0, 0, 0, 0,
        1, 1, 6, 1, 1, 0, 0, 0, 0, 9,
        1, 6, 1, 1, 4, 0, 3, 3, 0, 0,
        1, 1, 1, 1, 1, 0, 0, 2, 0, 0,
    ]);
    let none = map(10, &[0; 60]);
    // 5, 7, 9 and both 6, which share a corner only; 4 lies between two others, and 2 and 3 touch.
    assert_eq!(specks(&found, &none), 5);
    let truth = map(10, &found.ids.iter().map(|&id| if id == 7 { 7 } else { 0 }).collect::<Vec<_>>());
    assert_eq!(specks(&found, &truth), 4, "what is there is none");
    assert_eq!(specks(&none, &truth), 0);
    // 12 pixels are an object.
    let block = |rows: usize| map(8, &(0..64).map(|i| u16::from(i % 8 < 4 && i / 8 < rows)).collect::<Vec<_>>());
    let empty = map(8, &[0; 64]);
    assert_eq!((specks(&block(2), &empty), specks(&block(3), &empty)), (1, 0));
}

#[test]
fn boundary_iou_by_hand() {
    // Two squares of 4 x 4 px, one a column further: the rims have 12 pixels each and share 3 above and 3 below.
    let (truth, found) = (box_mask(10, 10, (2, 6), (2, 6)), box_mask(10, 10, (3, 7), (2, 6)));
    let overlap = Overlap::count(found.iter().copied().zip(truth.iter().copied()));
    assert_eq!(overlap.iou(), Some(12.0 / 20.0));
    assert_eq!(boundary_iou(&found, &truth, (10, 10), |_| true), Some(6.0 / 18.0));
    // Without the upper half: three shared, of six each.
    assert_eq!(boundary_iou(&found, &truth, (10, 10), |index| index >= 40), Some(3.0 / 9.0));
    assert_eq!(boundary_iou(&[false; 100], &[false; 100], (10, 10), |_| true), None);
    assert_eq!(boundary_iou(&[true; 100], &[true; 100], (10, 10), |_| true), Some(1.0), "the border is a rim");
}

#[test]
fn crops_by_hand() {
    let around = |columns, rows| Crop::around(&box_mask(100, 50, columns, rows), 100, 50);
    // 20 x 10 px and 15 % on each side: 37 to 63 and 18.5 to 31.5, which has the shape of the image.
    assert_eq!(around((40, 60), (20, 30)), Some(Crop { start: (37, 18), end: (63, 31) }));
    // 0 to 11.5 and 0 to 46: 92 % of the height, so 92 px wide about 5.75.
    let tall = around((0, 10), (0, 40)).expect("a crop");
    assert_eq!(tall, Crop { start: (0, 0), end: (51, 46) });
    assert_eq!((tall.size(), tall.indices(100).nth(51)), ((51, 46), Some(100)));
    assert_eq!(around((0, 100), (0, 50)), Some(Crop { start: (0, 0), end: (100, 50) }));
    assert_eq!(around((5, 5), (0, 0)), None);
}

#[test]
fn ssim_of_bytes_equals_the_direct_sum() {
    let (width, height) = (11, 9);
    let byte = |index: usize| (random(index) * 256.0) as u8;
    let a: Vec<[u8; 3]> = (0..width * height).map(|i| [byte(i), byte(i + 500), byte(i + 900)]).collect();
    let b: Vec<[u8; 3]> = (0..width * height).map(|i| [byte(i) / 2, byte(i + 500), byte(i + 77)]).collect();
    let (mut sum, mut count) = (0.0, 0.0);
    for channel in 0..3 {
        for (x, y) in (0..height - 6).flat_map(|y| (0..width - 6).map(move |x| (x, y))) {
            let cells = || (y..y + 7).flat_map(|row| (x..x + 7).map(move |column| row * width + column));
            let mean = |p: &[[u8; 3]]| cells().map(|i| f64::from(p[i][channel])).sum::<f64>() / 49.0;
            let (p, q) = (mean(&a), mean(&b));
            let cov = |s: &[[u8; 3]], m: f64, t: &[[u8; 3]], n: f64| {
                cells().map(|i| (f64::from(s[i][channel]) - m) * (f64::from(t[i][channel]) - n)).sum::<f64>() / 48.0
            };
            let (c1, c2) = (2.55_f64.powi(2), 7.65_f64.powi(2));
            sum += (2.0 * p * q + c1) * (2.0 * cov(&a, p, &b, q) + c2)
                / ((p * p + q * q + c1) * (cov(&a, p, &a, p) + cov(&b, q, &b, q) + c2));
            count += 1.0;
        }
    }
    // `ssim8` sums squares; this loop sums squared differences.
    assert!((ssim8(&a, &b, width, height).expect("large enough") - sum / count).abs() < 1e-9);
    assert_eq!(ssim8(&a, &a, width, height), Some(1.0));
    assert_eq!(ssim8(&a[..24], &b[..24], 6, 4), None);
    assert_eq!(to_bytes([0.5, -1.0, 7.0]), [128, 0, 255]);
}

#[test]
fn hidden_parts_are_scored_where_the_truth_is_known() {
    // Object 1 continues behind object 2 for two pixels; the last pixel is not part of it.
    let photo = Photo { width: 5, height: 1, rgba: vec![[255, 255, 255, 255]; 5] };
    let mask = map(5, &[1, 1, 2, 2, 2]);
    let whole = [true, true, true, true, false];
    let alone = [[255, 0, 0, 255], [255, 0, 0, 255], [255, 0, 0, 255], [0, 255, 0, 128], [9, 9, 9, 0]];
    let colour = [[1.0; 3], [1.0; 3], [0.9, 0.0, 0.0], [0.0, 128.0 / 255.0, 0.0], [1.0; 3]];
    let object = ObjectRender { colour: &colour, alpha: &[1.0, 1.0, 0.4, 0.9, 0.7] };
    let truth =
        ObjectTruth { photo: &photo, mask: Some(&mask), whole: Some(&whole), hidden: None, alone: Some(&alone) };
    let scored = |truth| {
        let mut view = ViewScores::default();
        view.add_object(1, Some(object), truth).expect("sizes");
        view.objects[&1]
    };
    let found = scored(truth);
    // Object 2: one true positive, one false negative, one false positive.
    assert_eq!(found.iou_hidden, Some(1.0 / 3.0));
    // One channel of six is off by a tenth.
    let expected = -10.0 * (0.01_f64 / 6.0).log10();
    assert!(found.psnr_hidden.is_some_and(|psnr| (psnr - expected).abs() < 1e-5), "{found:?}");
    assert_eq!(scored(ObjectTruth { alone: None, ..truth }).psnr_hidden, None);
    let visible_only = scored(ObjectTruth { whole: None, ..truth });
    assert_eq!((visible_only.iou_hidden, visible_only.psnr_hidden), (None, None));
    let nothing_hidden = map(5, &[1, 1, 1, 1, 0]);
    let shown = scored(ObjectTruth { mask: Some(&nothing_hidden), ..truth });
    assert_eq!((shown.iou_hidden, shown.psnr_hidden), (None, None), "nothing to compare");
    assert!(found.object_ssim.is_some() && found.iou_object == Some(3.0 / 5.0), "{found:?}");
}

#[test]
fn labels_are_chosen_by_containment() {
    let view = map(4, &[1, 1, 2, 2, 1, 3, 3, 0]);
    let mask = [true, true, true, false, false, false, true, true];
    // 1: two of three; 2: one of two is not more than half; 3: one of two; 0 never.
    assert_eq!(choose_labels(&view, &mask), [1]);
    let found: Vec<_> = candidates(&view, &mask).iter().map(|c| (c.label, c.inside, c.pixels)).collect();
    assert_eq!(found, [(1, 2, 3), (2, 1, 2), (3, 1, 2)]);
    let narrow = [false, false, true, false, false, false, false, false];
    let message = require_labels("--mask", &view, &narrow, &Catalogue::default()).expect_err("nothing").to_string();
    assert!(message.contains("2 (1 of its 2 pixels"), "{message}");
    let background = [false, false, false, false, false, false, false, true];
    assert!(require_labels("--mask", &view, &background, &Catalogue::default()).is_err());
    assert!(require_labels("--mask", &view, &[true], &Catalogue::default()).is_err());
}

fn model() -> Gaussians {
    Gaussians {
        antialiased: false,
        origin: glam::DVec3::ZERO,
        means: vec![[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [4.0, 4.0, 4.0], [1.0, 1.0, 1.0]],
        quats: vec![[1.0, 0.0, 0.0, 0.0]; 4],
        scales: vec![[0.0; 3]; 4],
        opacities: vec![0.0, 3.0_f32.ln(), -2000.0, 0.0],
        sh0: vec![[0.5; 3]; 4],
        sh_rest: Vec::new(),
        sh_degree: 0,
        labels: Some(vec![2, 2, 5, 0]),
        label_confidence: None,
    }
}

#[test]
fn labels_are_summarised() {
    let rows = summarise(&model());
    assert_eq!(rows.iter().map(|row| (row.label, row.count)).collect::<Vec<_>>(), [(0, 1), (2, 2), (5, 1)]);
    assert!((rows[1].opacity_mass - 1.25).abs() < 1e-6);
    assert!((rows[1].centre[0] - 2.0 * 0.75 / 1.25).abs() < 1e-6);
    assert_eq!((rows[1].min, rows[1].max), ([0.0; 3], [2.0, 0.0, 0.0]));
    assert_eq!(rows[2].centre, [4.0; 3], "invisible, but somewhere");
    let unlabelled = Gaussians { labels: None, ..model() };
    assert_eq!(summarise(&unlabelled).iter().map(|row| (row.label, row.count)).collect::<Vec<_>>(), [(0, 4)]);
}

#[test]
fn extract_and_remove_divide_the_model() {
    let (object, rest) =
        (extract(&model(), &[2], MIN_LABEL_CONFIDENCE).expect("2"), remove(&model(), &[2]).expect("2"));
    assert_eq!((object.labels, rest.labels), (Some(vec![2, 2]), Some(vec![5, 0])));
    let message = extract(&model(), &[2, 7, 9], MIN_LABEL_CONFIDENCE).expect_err("no 7").to_string();
    assert!(
        message.contains("label 7, 9;") && message.contains("the model has 2, 5, and 0 for the unlabelled"),
        "{message}"
    );
    let doubtful = Gaussians { label_confidence: Some(vec![0.59, 0.6, 0.5, 0.4]), ..model() };
    let of = |least| extract(&doubtful, &[2], least).expect("2").means;
    assert!(of(0.0) == object.means && of(2.0).is_empty());
    assert_eq!(of(MIN_LABEL_CONFIDENCE), [model().means[1]], "a Gaussian below 0.6 is left out");
    assert!(extract(&model(), &[], MIN_LABEL_CONFIDENCE).is_err());
    assert!(remove(&model(), &[0, 2, 5]).is_err());
    let unlabelled = Gaussians { labels: None, ..model() };
    let message = extract(&unlabelled, &[1], MIN_LABEL_CONFIDENCE).expect_err("no labels").to_string();
    assert!(message.contains("no labelled"), "{message}");
}

#[test]
fn a_view_that_is_much_worse_than_the_others_is_found() {
    let of = |values: &[f64]| {
        let view = |&psnr: &f64| ViewScores { psnr, ..ViewScores::default() };
        Scores::new((0..).zip(values).map(|(index, psnr)| (format!("{index}.png"), view(psnr))).collect())
    };
    assert_eq!(of(&[36.0, 35.0, 22.5, 37.0, 34.0]).odd_view(), Some(("2.png", 22.5, 35.0)));
    assert_eq!(of(&[36.0, 35.0, 31.0, 37.0, 34.0]).odd_view(), None, "views differ");
    assert_eq!(of(&[22.0, 35.0]).odd_view(), Some(("0.png", 22.0, 35.0)));
    assert_eq!((of(&[22.0]).odd_view(), of(&[]).odd_view()), (None, None));
    assert_eq!(of(&[f64::INFINITY, f64::INFINITY]).odd_view(), None);
}

#[test]
fn scores_are_averaged_over_pairs() {
    let photo = photo(12, 2);
    let render = colours(&photo);
    let mask = map(12, &[1, 1, 2, 2, 2, 2, 0, 0, 0, 0, 0, 0, 1, 1, 2, 2, 2, 2, 0, 0, 0, 0, 0, 0]);
    let predicted = map(12, &[1, 2, 2, 2, 2, 2, 0, 0, 0, 0, 0, 0, 1, 2, 2, 2, 2, 2, 0, 0, 0, 0, 0, 7]);
    let mut view = ViewScores::new(&render, &photo, Some(&predicted), Some(&mask)).expect("sizes");
    assert_eq!(view.objects.keys().copied().collect::<Vec<_>>(), [1, 2]);
    let whole: Vec<bool> = (0..24).map(|i| i % 12 < 4).collect();
    let alpha: Vec<f32> = (0..24).map(|i| if i % 12 < 2 { 0.8 } else { 0.3 }).collect();
    let object = ObjectRender { colour: &render, alpha: &alpha };
    let truth = ObjectTruth { photo: &photo, mask: Some(&mask), whole: None, hidden: None, alone: None };
    view.add_object(1, Some(object), ObjectTruth { whole: Some(&whole), ..truth }).expect("sizes");
    view.add_object(2, None, truth).expect("sizes");
    view.add_object(9, None, truth).expect("sizes");
    let scores = Scores::new(BTreeMap::from([("a.png".to_owned(), view)]));
    assert_eq!(scores.objects[&1].iou_map, Some(0.5));
    assert_eq!(scores.objects[&2].iou_map, Some(0.8));
    assert_eq!(scores.mean.objects.iou_map, Some(0.65));
    assert_eq!(scores.mean.specks, Some(1.0), "the 7");
    // In two rows every pixel is on a rim.
    assert_eq!((scores.objects[&1].boundary_iou, scores.mean.objects.boundary_iou), (Some(0.5), Some(0.65)));
    assert_eq!((scores.objects[&1].iou_object, scores.objects[&2].iou_object), (Some(0.5), Some(0.0)));
    assert_eq!(scores.objects[&2].paper_iou, Some(0.0), "an empty object is no full scene");
    assert!(!scores.objects.contains_key(&9), "neither there nor expected");
    let json = serde_json::to_value(&scores).expect("JSON");
    assert!(json["mean"]["psnr"].is_null(), "an infinite PSNR has no number: {json}");
    assert_eq!(json["mean"]["iou_map"], 0.65);
    assert_eq!(json["views"]["a.png"]["objects"]["1"]["iou_map"], 0.5);
    assert!(scores.check(Some(40.0), Some(0.6)).is_ok());
    let failed = scores.check(None, Some(0.7)).expect_err("0.65");
    assert_eq!(exit_status(&failed), 1);
    assert!(Scores::default().check(Some(1.0), None).is_err());
}
