//! A simple tracker: connects the masks of a single-image segmenter from frame to frame by overlap.
//!
//! It uses only outlines, so objects must hardly move between frames, as in the videos of `labelgs frames` (LabelGS,
//! densification of views).

use crate::scene::LabelMap;
use crate::scene::labels::LABEL_MAX;
use crate::{Error, Result, Setting};
use std::collections::{BTreeMap, BTreeSet};

/// The rule by which regions in two frames are the same object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Overlap {
    /// Smallest intersection over union of a region and the object's last region.
    pub least: f64,
    /// Number of frames that an object may be absent before it is forgotten.
    pub memory: usize,
}

/// The last region of an object.
struct Track {
    id: u16,
    frame: usize,
    pixels: BTreeSet<u32>,
}

/// Replaces the ids of regions, which may differ in every frame, by ids of objects: 1 to N in the order of appearance.
/// Pairs regions and objects by overlap, the largest first. All frames have the same size. Returns an error if there
/// are more objects than ids.
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
                    let problem = format!("more than {LABEL_MAX} objects appear; lower it");
                    return Err(Error::usage(Setting("min_overlap"), problem));
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

/// Returns the pixels of each region except 0.
fn regions(frame: &LabelMap) -> BTreeMap<u16, BTreeSet<u32>> {
    let mut regions: BTreeMap<u16, BTreeSet<u32>> = BTreeMap::new();
    for (&id, pixel) in frame.ids.iter().zip(0..).filter(|(id, _)| **id != 0) {
        regions.entry(id).or_default().insert(pixel);
    }
    regions
}

/// Returns the object of each region with enough overlap. Every object has at most one region.
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
