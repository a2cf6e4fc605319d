//! From votes to labels.

use labelgs::label::vote::ballot::Ballot;
use labelgs::label::vote::decide::{Agreement, agreement, decide, trust};
use labelgs::scene::LabelMap;

/// A ballot of rows in whole pixels.
fn ballot(labels: &[u16], rows: &[&[u64]]) -> Ballot {
    let cells = |(row, votes): (u32, &&[u64])| {
        let cells = votes.iter().zip(0..).filter(|(votes, _)| **votes > 0);
        cells.map(|(votes, column)| (row, column, votes << 16)).collect::<Vec<_>>()
    };
    Ballot::new(labels.to_vec(), rows.len(), (0..).zip(rows).flat_map(cells).collect())
}

/// Places in a row, one unit apart.
fn places(count: usize) -> Vec<[f32; 3]> {
    (0..count).map(|index| [index as f32, 0.0, 0.0]).collect()
}

#[test]
fn most_votes_win_and_the_background_may() {
    let rows: [&[u64]; 4] = [&[1, 5, 2], &[9, 5, 2], &[0, 3, 3], &[4, 0, 4]];
    let decision = decide(&ballot(&[0, 7, 9], &rows), &places(4)).expect("decided");
    assert_eq!(decision.labels, [7, 0, 7, 0], "equal votes go to the smaller label");
    assert_eq!(decision.confidence, [0.625, 0.5625, 0.5, 0.5]);
}

/// What splits those across contours of masks.
#[test]
fn weight_on_other_labels_than_the_main_one() {
    let rows: [&[u64]; 4] = [&[1, 5, 2], &[0, 0, 8], &[0, 0, 0], &[4, 0, 4]];
    let ballot = ballot(&[0, 7, 9], &rows);
    assert_eq!([0, 1, 2, 3].map(|row| ballot.spread(row)), [(8.0, 3.0), (8.0, 0.0), (0.0, 0.0), (8.0, 4.0)]);
}

#[test]
fn unseen_gaussians_take_the_label_of_their_neighbours() {
    // The last two rows have no votes: one inside the object, one on the background's side.
    let rows: [&[u64]; 12] =
        [&[0, 5], &[0, 5], &[0, 5], &[0, 5], &[0, 5], &[8, 0], &[8, 0], &[8, 0], &[8, 0], &[8, 0], &[0, 0], &[0, 0]];
    let mut means = places(12);
    means[10] = [1.5, 0.1, 0.0];
    means[11] = [7.5, 0.1, 0.0];
    let complete = decide(&ballot(&[0, 4], &rows), &means).expect("decided");
    assert_eq!(complete.labels[10..], [4, 0]);
    assert!(complete.confidence[10] > 0.5 && complete.confidence[10] < 1.0);
    assert_eq!(complete.labels[..10], [4, 4, 4, 4, 4, 0, 0, 0, 0, 0], "Gaussians with votes ignore their neighbours");
}

/// A dense table of Gaussians and labels would take 12 GB; the votes that were cast take some kilobytes.
#[test]
fn memory_grows_with_votes_and_not_with_labels() {
    let (labels, count) = ((0..30_000).collect::<Vec<u16>>(), 50_000_u32);
    let votes = (0..count).flat_map(|row| [(row, (row % 29_999) as u16 + 1, 5 << 16), (row, 0, 2 << 16)]);
    let ballot = Ballot::new(labels, count as usize, votes.collect());
    let decision = decide(&ballot, &places(count as usize)).expect("decided");
    assert!((0..count).all(|row| decision.labels[row as usize] == row % 29_999 + 1));
}

#[test]
fn gaussians_without_votes_or_neighbours_stay_unlabelled() {
    let rows: [&[u64]; 2] = [&[0, 0], &[0, 0]];
    assert_eq!(decide(&ballot(&[0, 4], &rows), &places(2)).expect("decided").labels, [0, 0]);
    assert_eq!(decide(&ballot(&[0], &[]), &[]).expect("decided").labels, [0_u32; 0]);
    assert!(decide(&ballot(&[0, 4], &rows), &places(3)).is_err(), "rows must fit");
}

#[test]
fn a_mask_is_trusted_as_far_as_the_others() {
    let map = |ids: &[u16]| LabelMap { width: ids.len() as u32, height: 1, ids: ids.to_vec() };
    let found = agreement(&map(&[0, 0, 1, 1, 2, 2, 2, 2]), &map(&[0, 0, 1, 1, 1, 1, 1, 2]));
    assert_eq!(found, [(0, (2, 2)), (1, (2, 2)), (2, (1, 4))].into());
    // Label 1 is shown half as well in the last view as in all together; label 2 is shown nowhere, and label 3, a thin
    // object, badly everywhere.
    let views: [Agreement; 3] = [
        [(1, (40, 40)), (2, (0, 9)), (3, (1, 10))].into(),
        [(1, (30, 30)), (2, (0, 5)), (3, (1, 10))].into(),
        [(1, (10, 30)), (3, (1, 10))].into(),
    ];
    let trusts = trust(&views);
    assert_eq!(trusts[..2], [[(1, 1.0), (2, 1.0), (3, 1.0)].into(), [(1, 1.0), (2, 1.0), (3, 1.0)].into()]);
    assert_eq!((trusts[2][&1], trusts[2][&3]), (((1.0 / 3.0) / 0.8_f64).powi(2) as f32, 1.0));
    assert_eq!(trust(&[]), []);
}

#[test]
fn contours_are_found_in_a_square() {
    let mut map = LabelMap { width: 7, height: 5, ids: vec![0; 35] };
    map.ids[2 * 7 + 3] = 4;
    let near = map.near_contour(1);
    let expected: Vec<bool> = (0..35).map(|i: i32| (i % 7 - 3).abs() <= 1 && (i / 7 - 2).abs() <= 1).collect();
    assert_eq!(near, expected);
    assert!(map.near_contour(0).iter().all(|near| !near));
}

#[test]
fn a_smaller_map_has_the_ids_at_the_middle_of_its_pixels() {
    let map = LabelMap { width: 5, height: 2, ids: vec![1, 2, 3, 4, 5, 6, 7, 8, 9, 10] };
    assert_eq!(map.resized(5, 2), map);
    assert_eq!(map.resized(3, 1).ids, [6, 8, 10]);
    assert_eq!(map.resized(1, 2).ids, [3, 8]);
}
