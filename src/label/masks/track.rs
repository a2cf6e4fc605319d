//! Ids that go from frame to frame by overlap: the simplest tracker, for the masks of a segmenter of single pictures.
//!
//! It knows nothing but outlines, so it needs frames in which objects hardly move: those of `labelgs densify`, which are
//! there for that (LabelGS, densification of views).

use crate::scene::LabelMap;
use crate::scene::labels::LABEL_MAX;
use crate::{Error, Result};
use std::collections::{BTreeMap, BTreeSet};

/// When two regions are the same object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Overlap {
    /// Least intersection over union of a region and the object's last region.
    pub least: f64,
    /// Frames that an object may be out of sight before it is forgotten.
    pub memory: usize,
}

/// An object's last region.
struct Track {
    id: u16,
    frame: usize,
    pixels: BTreeSet<u32>,
}

/// The frames with ids of objects, 1 to N in the order of their appearance, instead of the ids of their regions, which may
/// mean something else in every frame. Regions and objects are paired by overlap, the most alike first. All frames have
/// one size; an error if more objects appear than there are ids.
pub fn track(frames: &[LabelMap], how: Overlap) -> Result<Vec<LabelMap>> {
    let mut tracks: Vec<Track> = Vec::new();
    let mut next = 0_u32;
    let mut named = Vec::new();
    for (index, frame) in frames.iter().enumerate() {
        let regions = regions(frame);
        tracks.retain(|track| index - track.frame <= how.memory + 1);
        let mut found = pair(&tracks, &regions, how.least);
        for &region in regions.keys() {
            if let std::collections::btree_map::Entry::Vacant(unknown) = found.entry(region) {
                next += 1;
                if next > LABEL_MAX {
                    let problem = format!("more than {LABEL_MAX} objects appear; lower `min_overlap`");
                    return Err(Error::usage("min_overlap", problem));
                }
                unknown.insert(next as u16);
            }
        }
        let ids = frame.ids.iter().map(|region| found.get(region).copied().unwrap_or(0)).collect();
        for (region, pixels) in regions {
            let id = found[&region];
            tracks.retain(|track| track.id != id);
            tracks.push(Track { id, frame: index, pixels });
        }
        named.push(LabelMap { ids, ..frame.clone() });
    }
    Ok(named)
}

/// Pixels of each region but 0.
fn regions(frame: &LabelMap) -> BTreeMap<u16, BTreeSet<u32>> {
    let mut regions: BTreeMap<u16, BTreeSet<u32>> = BTreeMap::new();
    for (&id, pixel) in frame.ids.iter().zip(0..).filter(|(id, _)| **id != 0) {
        regions.entry(id).or_default().insert(pixel);
    }
    regions
}

/// The object of each region that overlaps one enough; every object has one region at most.
fn pair(tracks: &[Track], regions: &BTreeMap<u16, BTreeSet<u32>>, least: f64) -> BTreeMap<u16, u16> {
    let mut pairs = Vec::new();
    for (&region, pixels) in regions {
        for track in tracks {
            let common = track.pixels.intersection(pixels).count();
            let share = common as f64 / (track.pixels.len() + pixels.len() - common) as f64;
            if common > 0 && share >= least {
                pairs.push((share, track.id, region));
            }
        }
    }
    pairs.sort_by(|a, b| b.0.total_cmp(&a.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    let (mut found, mut taken) = (BTreeMap::new(), BTreeSet::new());
    for (_, id, region) in pairs {
        if !taken.contains(&id) && !found.contains_key(&region) {
            taken.insert(id);
            found.insert(region, id);
        }
    }
    found
}
