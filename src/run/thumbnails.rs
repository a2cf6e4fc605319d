//! A small picture of each object, from the held-out view that shows most of it.

use super::pictures::PICTURES_FOLDER;
use crate::Result;
use crate::eval::compared::ScoredPicture;
use crate::files::{atomic, read};
use crate::report::panels::{Kind, encoded};
use crate::scene::colour::to_byte;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Longest side, px.
const SIDE_MAX_PX: u32 = 128;
/// Most objects with a picture.
const OBJECTS_MAX: usize = 300;
/// Share of an object's pixels that may lie outside of its picture on each side, as specks.
const SPECK_SHARE_MAX: f64 = 0.01;
/// Margin around the object, as a share of its longer side.
const MARGIN_SHARE: f64 = 0.08;
/// Brightness factor of colours outside of the object.
const SURROUNDINGS_BRIGHTNESS: f32 = 0.3;
/// Id of pixels without an object.
const NO_OBJECT: u16 = 0;
/// Prefix of file names.
const FILE_PREFIX: &str = "object-";

/// Pictures by object.
#[derive(Default)]
pub(super) struct Thumbnails {
    /// For each object: its pixels in the view, and the encoded picture.
    by_id: BTreeMap<u16, (usize, Vec<u8>)>,
}

/// Returns the path of the picture of an object.
pub(crate) fn path(out: &Path, id: u32) -> PathBuf {
    out.join(PICTURES_FOLDER).join(format!("{FILE_PREFIX}{id}.jpg"))
}

/// Columns and rows of an object's pixels.
#[derive(Default)]
struct PixelBounds {
    columns: Vec<u32>,
    rows: Vec<u32>,
}

impl Thumbnails {
    /// Collects thumbnails from a scored view.
    pub(super) fn observe(&mut self, picture: &ScoredPicture) -> Result<()> {
        let Some(map) = picture.labels else { return Ok(()) };
        let mut places: BTreeMap<u16, PixelBounds> = BTreeMap::new();
        for (index, &id) in (0..).zip(&map.ids) {
            if id != NO_OBJECT && (places.len() < OBJECTS_MAX || places.contains_key(&id)) {
                let of = places.entry(id).or_default();
                of.columns.push(index % map.width);
                of.rows.push(index / map.width);
            }
        }
        for (id, places) in places {
            let count = places.rows.len();
            let is_better = self.by_id.get(&id).map_or(self.by_id.len() < OBJECTS_MAX, |known| known.0 < count);
            if is_better {
                let (size, pixels) = cut(picture, (map.width, map.height), &map.ids, id, places);
                self.by_id.insert(id, (count, encoded(size, &pixels, Kind::Smooth, SIDE_MAX_PX)?));
            }
        }
        Ok(())
    }

    /// Writes the pictures into the run folder.
    pub(super) fn write(&self, out: &Path) -> Result<()> {
        for (&id, (_, file)) in &self.by_id {
            atomic::write(path(out, id.into()), |out| out.write_all(file))?;
        }
        Ok(())
    }
}

/// Crops an object from its view's render, with dark surroundings.
fn cut(
    of: &ScoredPicture,
    size: (u32, u32),
    ids: &[u16],
    id: u16,
    mut places: PixelBounds,
) -> ((u32, u32), Vec<[u8; 3]>) {
    let ends = |values: &mut Vec<u32>| {
        values.sort_unstable();
        let outside = (values.len() as f64 * SPECK_SHARE_MAX) as usize;
        (values[outside], values[values.len() - 1 - outside])
    };
    let ((left, right), (top, bottom)) = (ends(&mut places.columns), ends(&mut places.rows));
    let room = (MARGIN_SHARE * f64::from((right - left).max(bottom - top))).ceil() as u32;
    let (left, top) = (left.saturating_sub(room), top.saturating_sub(room));
    let (right, bottom) = ((right + room).min(size.0 - 1), (bottom + room).min(size.1 - 1));
    let pixel = |index: usize| {
        let light = if ids[index] == id { 1.0 } else { SURROUNDINGS_BRIGHTNESS };
        of.rgb[index].map(|value| to_byte(value * light))
    };
    let row = |y: u32| (left..=right).map(move |x| (y * size.0 + x) as usize);
    ((right - left + 1, bottom - top + 1), (top..=bottom).flat_map(row).map(pixel).collect())
}

/// Deletes the pictures of an earlier end of the run.
pub(super) fn remove_old(out: &Path) -> Result<()> {
    let folder = out.join(PICTURES_FOLDER);
    if !folder.is_dir() {
        return Ok(());
    }
    for path in read::folder(&folder)? {
        let is_ours = path.file_name().is_some_and(|name| name.to_string_lossy().starts_with(FILE_PREFIX));
        if is_ours {
            atomic::remove(&path)?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{LabelMap, Photo};

    /// A picture of 40 x 30 px with an object of 10 x 6 px, and a speck of it.
    fn observe(to: &mut Thumbnails, width: usize) {
        let mut ids = vec![NO_OBJECT; 40 * 30];
        for y in 10..16 {
            ids[y * 40 + 20..y * 40 + 20 + width].fill(7);
        }
        ids[0] = 7;
        let map = LabelMap { width: 40, height: 30, ids };
        let photo = Photo { width: 40, height: 30, rgba: vec![[0, 0, 0, 255]; 1200] };
        let rgb = vec![[0.5, width as f32 / 20.0, 0.0]; 1200];
        to.observe(&ScoredPicture { labels: Some(&map), ..ScoredPicture::new("a", &photo, &rgb) }).expect("seen");
    }

    #[test]
    fn the_view_with_most_of_an_object_is_cut_out_without_specks() {
        let mut all = Thumbnails::default();
        [12, 17, 5].iter().for_each(|&width| observe(&mut all, width));
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::create_dir(folder.path().join(PICTURES_FOLDER)).expect("a folder");
        atomic::write(path(folder.path(), 9), |out| out.write_all(b"old")).expect("written");
        remove_old(folder.path()).expect("removed");
        all.write(folder.path()).expect("written");
        assert!(!path(folder.path(), 9).exists());
        let bytes = crate::files::read::bytes(&path(folder.path(), 7)).expect("a picture");
        let found = image::load_from_memory(&bytes).expect("a JPEG").into_rgb8();
        // From the widest view, with a margin of 8 % of 16 px on each side.
        assert_eq!(found.dimensions(), (17 + 4, 6 + 4));
        let [inside, beside] = [(10, 5), (0, 0)].map(|(x, y)| found.get_pixel(x, y).0[0]);
        assert!(inside > 115 && beside < 60, "{inside} {beside}");
    }
}
