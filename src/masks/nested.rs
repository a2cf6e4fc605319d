//! Nested masks of photos: all masks that a segmenter found, with scores, in the format of Segment Anything.

use super::mask_folder::png_key;
use super::rle::Rle;
use super::sam::{LIST_SUFFIX, annotations, is_list};
use labelgs_files::names::below;
use labelgs_files::{atomic, label_table};
use labelgs_scene::{Error, LabelMap, Result};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// The masks of a photo in few layers; within a layer, masks do not overlap.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct NestedMasks {
    /// Mask numbers from 1, or 0 for none. All layers have the same size.
    pub layers: Vec<LabelMap>,
    /// How far each mask can be trusted ([`quality`]).
    pub qualities: Vec<f64>,
}

impl NestedMasks {
    /// Distributes masks of the same size over as few layers as first fit finds.
    fn new((width, height): (u32, u32), masks: &[Vec<bool>], qualities: Vec<f64>) -> Self {
        let mut layers: Vec<LabelMap> = Vec::new();
        for (mask, number) in masks.iter().zip(1_u16..) {
            let pixels = || mask.iter().enumerate().filter(|(_, inside)| **inside).map(|(at, _)| at);
            let free = layers.iter().position(|layer| pixels().all(|at| layer.ids[at] == 0));
            let layer = free.unwrap_or_else(|| {
                layers.push(LabelMap { width, height, ids: vec![0; mask.len()] });
                layers.len() - 1
            });
            pixels().for_each(|at| layers[layer].ids[at] = number);
        }
        Self { layers, qualities }
    }
}

/// Returns how far a mask can be trusted, 0 to 1, from its score times its stability. The exponent separates good masks
/// from mediocre ones, so that a whole replaces its parts only if it is as reliable as they are.
pub fn quality(sure: f64) -> f64 {
    sure.clamp(0.0, 1.0).powi(4)
}

/// Returns true if a folder contains mask lists and no images.
pub fn has_lists(folder: &Path) -> Result<bool> {
    let files = below(folder)?;
    if files.iter().any(|file| png_key(file).is_some()) {
        return Ok(false);
    }
    let list = files.iter().find(|file| file.ends_with(LIST_SUFFIX) && !file.ends_with(label_table::FILE_NAME));
    list.map_or(Ok(false), |file| is_list(&folder.join(file)))
}

/// Returns the nested mask file of each photo in a folder, or `None` if the folder has none.
pub fn files_of_photos(folder: &Path, photos: &[&str]) -> Result<Option<Vec<Option<PathBuf>>>> {
    let files = below(folder)?;
    let found = super::sam::files_of_photos(photos, &files, LIST_SUFFIX);
    let any = found.iter().any(Option::is_some);
    let path = |name: String| folder.join(format!("{name}{LIST_SUFFIX}"));
    Ok(any.then(|| found.into_iter().map(|name| name.map(path)).collect()))
}

/// Reads the masks of a photo.
pub fn read(path: &Path) -> Result<NestedMasks> {
    let list = annotations(path)?;
    let (mut masks, mut qualities, mut size) = (Vec::new(), Vec::new(), None);
    for (at, annotation) in list.iter().enumerate().take(usize::from(u16::MAX)) {
        let wrong = |problem: String| Error::data(path, format!("mask {at}"), problem);
        let rle = Rle::read(&annotation.segmentation).map_err(wrong)?;
        if *size.get_or_insert(rle.size) != rle.size {
            return Err(wrong(format!("has {} x {} px, unlike the first mask", rle.size.0, rle.size.1)));
        }
        let mut inside = vec![false; rle.size.0 as usize * rle.size.1 as usize];
        rle.spans(rle.size).runs().for_each(|run| inside[run].fill(true));
        masks.push(inside);
        let sure = annotation.predicted_iou.unwrap_or(1.0) * annotation.stability_score.unwrap_or(1.0);
        if !sure.is_finite() {
            return Err(wrong("has a score that is not a finite number".to_owned()));
        }
        qualities.push(quality(sure));
    }
    Ok(NestedMasks::new(size.unwrap_or_default(), &masks, qualities))
}

/// A mask to write.
#[derive(Clone, Debug)]
pub struct FoundMask {
    /// Pixels inside, `[height][width]`.
    pub inside: Vec<bool>,
    /// The network's estimate of the mask's IoU with an object.
    pub score: f32,
    /// IoU between the mask cut at a higher and at a lower level.
    pub stability: f32,
}

/// Writes the masks of a photo; its size is in px.
pub fn write(path: &Path, (width, height): (u32, u32), masks: &[FoundMask]) -> Result<()> {
    let entry = |mask: &FoundMask| -> Value {
        // Down the columns, outside first.
        let mut counts = vec![0_u64];
        let mut last = false;
        for x in 0..width as usize {
            for y in 0..height as usize {
                let inside = mask.inside[y * width as usize + x];
                if inside != last {
                    counts.push(0);
                    last = inside;
                }
                *counts.last_mut().expect("one at least") += 1;
            }
        }
        let area = mask.inside.iter().filter(|inside| **inside).count();
        json!({
            "segmentation": { "size": [height, width], "counts": counts },
            "area": area,
            "predicted_iou": mask.score,
            "stability_score": mask.stability,
        })
    };
    let list: Vec<Value> = masks.iter().map(entry).collect();
    atomic::write(path, |out| serde_json::to_writer(out, &list).map_err(Into::into))
}
