//! Masks of different views that show one object, and their repair, on models of a few Gaussians.

use labelgs::label::masks::associate::{Owners, Segment, associate};
use labelgs::label::masks::repair::{adopt, mend, name_groups, rename};
use labelgs::label::masks::{Naming, Repairs};
use labelgs::scene::LabelMap;
use std::collections::{BTreeMap, BTreeSet};

/// A view that sees each Gaussian with weight 2 in the mask of the given id; `None`: not seen.
fn view(rows: &[Option<u16>]) -> Owners {
    let ids: Vec<u16> =
        rows.iter().flatten().copied().collect::<std::collections::BTreeSet<u16>>().into_iter().collect();
    let place = |id: u16| ids.iter().position(|&own| own == id).expect("own id") as u16;
    Owners { rows: rows.iter().map(|id| id.map(|id| (place(id), 2.0))).collect(), ids }
}

fn some(ids: &[u16]) -> Owners {
    view(&ids.iter().map(|&id| Some(id)).collect::<Vec<_>>())
}

#[test]
fn ids_of_each_view_become_objects() {
    // Two objects of four Gaussians each, and background 0. Each view has its own ids.
    let views = [
        some(&[1, 1, 1, 1, 2, 2, 2, 2, 0, 0]),
        some(&[7, 7, 7, 7, 3, 3, 3, 0, 0, 0]),
        view(&[Some(2), Some(2), Some(2), None, None, None, Some(1), Some(1), Some(0), Some(0)]),
    ];
    let expected: [Vec<Segment>; 2] = [vec![(0, 1), (1, 7), (2, 2)], vec![(0, 2), (1, 3), (2, 1)]];
    assert_eq!(associate(&views), expected);
}

#[test]
fn masks_of_one_view_stay_apart() {
    // The second view divides the object: one half joins, the other stays alone.
    let views = [some(&[1, 1, 1, 1, 1]), some(&[4, 4, 4, 5, 5])];
    assert_eq!(associate(&views), [vec![(0, 1), (1, 4)], vec![(1, 5)]]);
}

#[test]
fn masks_of_different_things_stay_apart() {
    let views = [some(&[1, 1, 1, 1, 0, 0, 0, 0]), some(&[0, 0, 0, 1, 1, 1, 1, 0])];
    // The masks share one of seven Gaussians; equal ids do not matter.
    assert_eq!(associate(&views), [vec![(0, 1)], vec![(1, 1)]]);
    assert_eq!(associate(&[Owners::default(), some(&[3])]), [vec![(1, 3)]], "a view without masks");
}

fn areas(groups: &[Vec<Segment>]) -> BTreeMap<Segment, u64> {
    groups.iter().flatten().map(|&segment| (segment, 100)).collect()
}

#[test]
fn names_go_by_majority_or_by_size() {
    // Ids 1 and 2 were swapped in view 2, and view 3 calls the first object 5.
    let groups = [vec![(0, 1), (1, 1), (2, 2), (3, 5)], vec![(0, 2), (1, 2), (2, 1)], vec![(3, 1)]];
    let names = name_groups(&groups, &areas(&groups), Naming::Majority);
    assert_eq!((names[&(2, 2)], names[&(3, 5)], names[&(2, 1)]), (1, 1, 2));
    assert_eq!(names[&(3, 1)], 3, "what is left over gets a free id");
    let fresh = name_groups(&groups, &areas(&groups), Naming::Fresh);
    assert_eq!((fresh[&(2, 2)], fresh[&(0, 2)], fresh[&(3, 1)]), (1, 2, 3));
}

fn map(ids: &[u16]) -> LabelMap {
    LabelMap { width: ids.len() as u32, height: 1, ids: ids.to_vec() }
}

#[test]
fn masks_get_the_names_of_their_groups() {
    let names = BTreeMap::from([((4, 9), 2)]);
    assert_eq!(rename(4, &map(&[0, 9, 9, 3]), &names), map(&[0, 2, 2, 0]), "masks of no group go");
}

/// Runs of (id, length).
fn runs(runs: &[(u16, usize)]) -> LabelMap {
    map(&runs.iter().flat_map(|&(id, length)| std::iter::repeat_n(id, length)).collect::<Vec<_>>())
}

#[test]
fn a_mask_over_two_objects_is_divided_and_its_outline_stays() {
    let mut repairs = Repairs::default();
    let mask = runs(&[(0, 20), (1, 60), (0, 20)]);
    let shown = runs(&[(0, 22), (1, 30), (2, 26), (0, 22)]);
    let mended = mend(3, &mask, &shown, &mut repairs);
    // Pixels without a Gaussian go to the larger part.
    assert_eq!(mended, runs(&[(0, 20), (1, 32), (2, 26), (1, 2), (0, 20)]));
    assert_eq!(repairs.divided, [((3, 1), vec![1, 2])]);
}

#[test]
fn a_mask_of_another_object_gets_its_id_and_a_right_one_stays() {
    let mut repairs = Repairs::default();
    let mask = runs(&[(1, 50), (2, 50)]);
    let shown = runs(&[(3, 48), (2, 52)]);
    assert_eq!(mend(0, &mask, &shown, &mut repairs), runs(&[(3, 50), (2, 50)]));
    assert_eq!(repairs.renamed, [((0, 1), 3)]);
    assert!(repairs.divided.is_empty() && repairs.filled.is_empty());
}

#[test]
fn an_object_that_was_missed_is_filled_in_but_no_border() {
    let mut repairs = Repairs::default();
    let mask = runs(&[(0, 50), (2, 40), (0, 10)]);
    // Object 1 is missing in the mask; object 2 extends a little beyond its mask.
    let shown = runs(&[(1, 30), (0, 15), (2, 50), (0, 5)]);
    assert_eq!(mend(5, &mask, &shown, &mut repairs), runs(&[(1, 30), (0, 20), (2, 40), (0, 10)]));
    assert_eq!(repairs.filled, [(5, 1)]);
}

#[test]
fn a_mask_that_decided_nothing_gets_the_ids_of_objects_and_keeps_its_outlines() {
    let mut repairs = Repairs::default();
    let mask = runs(&[(7, 40), (0, 20), (9, 30), (4, 10)]);
    let shown = runs(&[(0, 25), (1, 45), (2, 20), (0, 10)]);
    assert_eq!(adopt(6, &mask, &shown, &BTreeSet::new(), &mut repairs), runs(&[(1, 40), (0, 20), (2, 30), (0, 10)]));
    assert_eq!((repairs.renamed, repairs.left_out), (vec![((6, 7), 1), ((6, 9), 2)], vec![(6, 4)]));
    let kept = adopt(6, &mask, &shown, &BTreeSet::from([1, 2, 4]), &mut Repairs::default());
    assert_eq!(kept.ids[95], 4, "an id that agrees stays where the model shows nothing");
}
