//! Scores, label choice and selections against slow or hand-made answers.

use labelgs::infer::choose::{candidates, choose_labels, require_labels};
use labelgs::infer::metrics::{Overlap, paper_score, psnr};
use labelgs::infer::scores::{ObjectRender, Scores, ViewScores};
use labelgs::infer::select::{extract, remove, summarise};
use labelgs::infer::ssim::{ssim, ssim_map, window};
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

#[test]
fn labels_are_chosen_by_containment() {
    let view = map(4, &[1, 1, 2, 2, 1, 3, 3, 0]);
    let mask = [true, true, true, false, false, false, true, true];
    // 1: two of three; 2: one of two is not more than half; 3: one of two; 0 never.
    assert_eq!(choose_labels(&view, &mask), [1]);
    let found: Vec<_> = candidates(&view, &mask).iter().map(|c| (c.label, c.inside, c.pixels)).collect();
    assert_eq!(found, [(1, 2, 3), (2, 1, 2), (3, 1, 2)]);
    let narrow = [false, false, true, false, false, false, false, false];
    let message = require_labels("--mask", &view, &narrow).expect_err("nothing").to_string();
    assert!(message.contains("2 (1 of its 2 pixels"), "{message}");
    let background = [false, false, false, false, false, false, false, true];
    assert!(require_labels("--mask", &view, &background).is_err());
    assert!(require_labels("--mask", &view, &[true]).is_err());
}

fn model() -> Gaussians {
    Gaussians {
        means: vec![[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [4.0, 4.0, 4.0], [1.0, 1.0, 1.0]],
        quats: vec![[1.0, 0.0, 0.0, 0.0]; 4],
        scales: vec![[0.0; 3]; 4],
        opacities: vec![0.0, 3.0_f32.ln(), -2000.0, 0.0],
        sh0: vec![[0.5; 3]; 4],
        sh_rest: Vec::new(),
        sh_degree: 0,
        labels: Some(vec![2, 2, 5, 0]),
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
fn extract_and_remove_share_the_model_out() {
    let (object, rest) = (extract(&model(), &[2]).expect("2"), remove(&model(), &[2]).expect("2"));
    assert_eq!((object.labels, rest.labels), (Some(vec![2, 2]), Some(vec![5, 0])));
    let message = extract(&model(), &[2, 7, 9]).expect_err("no 7").to_string();
    assert!(message.contains("7, 9") && message.contains("2, 5") && message.contains("0 for the"), "{message}");
    assert!(extract(&model(), &[]).is_err());
    assert!(remove(&model(), &[0, 2, 5]).is_err());
    let unlabelled = Gaussians { labels: None, ..model() };
    let message = extract(&unlabelled, &[1]).expect_err("no labels").to_string();
    assert!(message.contains("no labelled"), "{message}");
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
    view.add_object(1, Some(object), &photo, Some(&mask), Some(&whole), None).expect("sizes");
    view.add_object(2, None, &photo, Some(&mask), None, None).expect("sizes");
    view.add_object(9, None, &photo, Some(&mask), None, None).expect("sizes");
    let scores = Scores::new(BTreeMap::from([("a.png".to_owned(), view)]));
    assert_eq!(scores.objects[&1].iou_map, Some(0.5));
    assert_eq!(scores.objects[&2].iou_map, Some(0.8));
    assert_eq!(scores.mean.objects.iou_map, Some(0.65));
    assert_eq!((scores.objects[&1].iou_object, scores.objects[&2].iou_object), (Some(0.5), Some(0.0)));
    assert_eq!(scores.objects[&2].paper_iou, Some(0.0), "an empty object is no full scene");
    assert!(!scores.objects.contains_key(&9), "neither there nor expected");
    let json = serde_json::to_value(&scores).expect("JSON");
    assert!(json["mean"]["psnr"].is_null(), "an infinite PSNR has no number: {json}");
    assert_eq!(json["mean"]["iou_map"], 0.65);
    assert_eq!(json["views"]["a.png"]["objects"]["1"]["iou_map"], 0.5);
    assert!(scores.check(Some(40.0), Some(0.6)).is_ok());
    let failed = scores.check(None, Some(0.7)).expect_err("0.65");
    assert_eq!(failed.exit_status(), 1);
    assert!(Scores::default().check(Some(1.0), None).is_err());
}
