//! Notes problems of all masks of a scene that affect training.

use labelgs_files::photo_files::PhotoFiles;
use labelgs_masks::check::{held_out, no_object, one_area};
use labelgs_masks::mask::read_mask;
use labelgs_masks::soft_edges::{self, Edges};
use labelgs_scene::{Dataset, LabelMap, Pixels};
use rayon::prelude::*;
use std::path::Path;

/// Most masks whose edges are examined.
const SAMPLE_MAX: usize = 16;

/// Returns notes on masks that mark no object, belong to no training photo, or have soft edges.
pub(super) fn notes(masks: &PhotoFiles, dataset: &Dataset) -> Vec<String> {
    let found = [unused(dataset), soft(masks)].into_iter().flatten();
    found.map(|problem| format!("{}: {problem}", masks.folder.display())).collect()
}

/// Explains why training learns no object from the masks.
fn unused(dataset: &Dataset) -> Option<String> {
    let masks: Vec<&Pixels<LabelMap>> = dataset.train.iter().filter_map(|view| view.mask.as_ref()).collect();
    if masks.is_empty() {
        return held_out(dataset, |view| view.mask.is_some());
    }
    let Some(id) = masks.iter().find_map(|mask| mask.objects().first().copied()) else {
        return Some(no_object(masks.len()));
    };
    // Pixels are only read for masks with a single id.
    let is_whole = |mask: &&Pixels<LabelMap>| {
        mask.objects() == [id] && mask.get().is_ok_and(|mask| mask.ids.iter().all(|&found| found == id))
    };
    masks.iter().all(is_whole).then(|| one_area(masks.len(), id))
}

fn soft(masks: &PhotoFiles) -> Option<String> {
    let files: Vec<(&str, &Path)> = masks.files().collect();
    let chosen: Vec<_> = files.iter().step_by(files.len().div_ceil(SAMPLE_MAX).max(1)).collect();
    let edges = |&&(name, path): &&(&'_ str, &Path)| {
        let map = read_mask(path).ok()?;
        Some((name.to_owned(), Edges::measure(&map.ids, map.width, map.height)))
    };
    let edges: Vec<(String, Edges)> = chosen.par_iter().filter_map(edges).collect();
    soft_edges::problem(&edges.iter().map(|(name, edges)| (name.as_str(), edges)).collect::<Vec<_>>())
}
