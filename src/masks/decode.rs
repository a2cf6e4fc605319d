//! Combines the masks of a photo into a map of source ids.

use super::Overlap;
use super::content::{read_binary, read_ids};
use super::detect::{Content, Reading};
use super::marks::{Mark, Shape, require_aspect};
use super::spans::Spans;
use labelgs_files::image::check_size;
use labelgs_scene::{Error, Result, View};
use std::cmp::Reverse;
use std::collections::BTreeMap;
use std::path::Path;

/// Number of pixels that two source ids share, with the smaller id first.
pub(super) type SharedPixels = BTreeMap<(u32, u32), u64>;

/// The mask of a photo with source ids.
pub(super) struct DecodedMask {
    pub(super) size: (u32, u32),
    pub(super) ids: Vec<u32>,
    pub(super) shared: SharedPixels,
    /// Number of pixels that several objects share.
    pub(super) shared_pixels: u64,
    /// Number of black and white images that needed a threshold.
    pub(super) cut: usize,
}

/// Reads the masks of a photo.
pub(super) fn decode(reading: &Reading, photo: usize, view: &View) -> Result<DecodedMask> {
    match &reading.content {
        Content::Ids { kind, of_photo, .. } => {
            let path = reading.root.join(of_photo[photo].as_deref().unwrap_or_default());
            let (size, ids) = read_ids(&path, *kind, |found| fits(&path, found, view))?;
            Ok(DecodedMask { size, ids, shared: SharedPixels::new(), shared_pixels: 0, cut: 0 })
        }
        Content::Marks { of_photo, .. } => blend(&reading.root, &of_photo[photo], view, reading.overlap),
    }
}

fn fits(path: &Path, found: (u32, u32), view: &View) -> Result<()> {
    require_aspect("the mask", found, view).map_err(|problem| Error::data(path, "", problem))
}

/// Paints the masks of a photo over each other.
fn blend(root: &Path, marks: &[Mark], view: &View, rule: Overlap) -> Result<DecodedMask> {
    let mut layers = Vec::with_capacity(marks.len());
    let (mut size, mut cut) = (None, 0);
    let photo = view.camera.size();
    for (at, mark) in marks.iter().enumerate() {
        let (own, spans) = match &mark.shape {
            Shape::Png(file) => {
                let path = root.join(file);
                let mask = read_binary(&path, |found| fits(&path, found, view))?;
                cut += usize::from(!mask.sharp);
                (mask.size, Spans::from_mask(&mask.inside))
            }
            // Shapes without a size of their own get the photo's.
            Shape::Rle(rle) => (photo, check_size(root, photo).map(|()| rle.spans(photo))?),
            Shape::Polygons(polygons) => (photo, check_size(root, photo).map(|()| polygons.spans(photo))?),
        };
        let all = *size.get_or_insert(own);
        if let (Shape::Png(file), true) = (&mark.shape, all != own) {
            let problem = format!(
                "has {} x {} px and another mask of {} {} x {} px; masks of a photo need one size",
                own.0, own.1, view.name, all.0, all.1
            );
            return Err(Error::data(root.join(file), "", problem));
        }
        // Later layers cover earlier ones.
        let area = if rule == Overlap::Smaller { Reverse(spans.area()) } else { Reverse(0) };
        layers.push(((!mark.is_crowd, area, at), mark.id, spans));
    }
    layers.sort_by_key(|(order, ..)| *order);
    let size = size.unwrap_or(photo);
    let (ids, shared, shared_pixels) = paint(size, layers.iter().map(|(_, id, spans)| (*id, spans)));
    Ok(DecodedMask { size, ids, shared, shared_pixels, cut })
}

fn paint<'a>(
    (width, height): (u32, u32),
    layers: impl Iterator<Item = (u32, &'a Spans)>,
) -> (Vec<u32>, SharedPixels, u64) {
    let mut ids = vec![0; width as usize * height as usize];
    let mut counted = vec![false; ids.len()];
    let mut shared = SharedPixels::new();
    for (id, spans) in layers {
        for run in spans.runs() {
            let (ids, counted) = (&mut ids[run.clone()], &mut counted[run]);
            // Count whole runs, because neighbours mostly have the same id.
            let mut at = 0;
            for part in ids.chunk_by(|a, b| a == b) {
                if part[0] != 0 && part[0] != id {
                    *shared.entry((id.min(part[0]), id.max(part[0]))).or_default() += part.len() as u64;
                    counted[at..at + part.len()].fill(true);
                }
                at += part.len();
            }
            ids.fill(id);
        }
    }
    (ids, shared, counted.iter().filter(|&&counted| counted).count() as u64)
}
