//! What is odd about the masks of a scene as a whole, for a training.

use labelgs_masks::check::{held_out, no_object, one_area};
use labelgs_masks::mask::read_mask;
use labelgs_masks::mask_folder::MaskFolder;
use labelgs_masks::soft_edges::{self, Edges};
use labelgs_scene::{Dataset, LabelMap, Pixels, View};
use rayon::prelude::*;
use std::path::Path;

/// Most masks whose edges are looked at.
const SAMPLE: usize = 16;

/// Returns notes on masks that mark no object, belong to no training photo, or have soft edges.
pub(super) fn notes(masks: &MaskFolder, dataset: &Dataset) -> Vec<String> {
    let found = [unused(dataset), soft(masks)].into_iter().flatten();
    found.map(|problem| format!("{}: {problem}", masks.folder.display())).collect()
}

/// Says why a training learns no object from the masks.
fn unused(dataset: &Dataset) -> Option<String> {
    let names =
        |views: &'_ [View]| views.iter().filter(|view| view.mask.is_some()).map(|view| view.name.clone()).collect();
    let (train, test): (Vec<String>, Vec<String>) = (names(&dataset.train), names(&dataset.test));
    if train.is_empty() {
        return (!test.is_empty()).then(|| held_out(&test.iter().map(String::as_str).collect::<Vec<_>>()));
    }
    let masks = || dataset.train.iter().filter_map(|view| view.mask.as_ref());
    let Some(id) = masks().find_map(|mask| mask.objects().first().copied()) else {
        return Some(no_object(train.len()));
    };
    // The pixels are read for masks of one id only.
    let is_whole = |mask: &Pixels<LabelMap>| {
        mask.objects() == [id] && mask.get().is_ok_and(|mask| mask.ids.iter().all(|&found| found == id))
    };
    masks().all(is_whole).then(|| one_area(train.len(), id))
}

fn soft(masks: &MaskFolder) -> Option<String> {
    let files: Vec<(&str, &Path)> = masks.files().collect();
    let chosen: Vec<_> = files.iter().step_by(files.len().div_ceil(SAMPLE).max(1)).collect();
    let edges = |&&(name, path): &&(&'_ str, &Path)| {
        let map = read_mask(path).ok()?;
        Some((name.to_owned(), Edges::of(&map.ids, map.width, map.height)))
    };
    let edges: Vec<(String, Edges)> = chosen.par_iter().filter_map(edges).collect();
    soft_edges::problem(&edges.iter().map(|(name, edges)| (name.as_str(), edges)).collect::<Vec<_>>())
}
