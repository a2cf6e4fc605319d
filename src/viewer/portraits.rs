//! Images of the labels for the list, made anew when a label has changed.

use super::hub::Hub;
use crate::edit::catalogue::Catalogue;
use crate::engine::Engine;
use crate::error::Result;
use crate::files::image::png_rgba8;
use crate::render::portrait::portrait;
use crate::scene::{Camera, Gaussians, UNLABELLED};
use glam::DVec3;
use serde_json::json;
use std::collections::BTreeMap;
use std::time::{Duration, Instant};

/// Side of an image, px.
const PORTRAIT_SIDE: u32 = 72;
/// Maximum number of labels with a thumbnail.
const LABELS_MAX: usize = 512;
/// Maximum time for thumbnails before the next look for requests.
const ROUND_TIME_MAX: Duration = Duration::from_millis(400);

/// Checksum of the Gaussians in a thumbnail.
type AppearanceHash = u64;

/// The images that are there.
#[derive(Debug, Default)]
pub(super) struct Portraits {
    /// Labels and what they look like now.
    wanted: BTreeMap<u32, AppearanceHash>,
    made: BTreeMap<u32, AppearanceHash>,
}

impl Portraits {
    /// Looks for labels that have changed.
    pub(super) fn note(&mut self, model: &Gaussians) {
        self.wanted.clear();
        if model.labels.is_none() {
            return;
        }
        for id in Catalogue::new(model, None).gaussians.into_keys().filter(|&id| id != UNLABELLED).take(LABELS_MAX) {
            self.wanted.insert(id, 0);
        }
        for row in 0..model.len() {
            if let Some(look) = self.wanted.get_mut(&model.label(row)) {
                let colour = model.sh0[row].map(f32::to_bits);
                let place = model.means[row].map(f32::to_bits);
                for word in colour.into_iter().chain(place) {
                    // FNV-1a.
                    *look = (*look ^ u64::from(word)).wrapping_mul(0x0100_0000_01b3);
                }
            }
        }
        self.made.retain(|id, _| self.wanted.contains_key(id));
    }

    /// Makes a few images. Returns true if it has, and another model is on the device.
    pub(super) fn make_some(
        &mut self,
        engine: &mut Engine,
        model: &Gaussians,
        (cameras, up, near): (&[&Camera], DVec3, f32),
        hub: &Hub,
    ) -> Result<bool> {
        let is_due = |(id, look): &(&u32, &AppearanceHash)| self.made.get(id) != Some(*look);
        let due: Vec<(u32, AppearanceHash)> =
            self.wanted.iter().filter(is_due).map(|(&id, &look)| (id, look)).collect();
        let end = Instant::now() + ROUND_TIME_MAX;
        for &(id, look) in &due {
            let pixels = portrait(engine, (model, id), (cameras, up), (PORTRAIT_SIDE, near))?;
            hub.set_portrait(id, png_rgba8((PORTRAIT_SIDE, PORTRAIT_SIDE), &pixels)?);
            self.made.insert(id, look);
            if Instant::now() > end || hub.has_work() {
                break;
            }
        }
        if !due.is_empty() {
            let versions: BTreeMap<u32, String> =
                self.made.iter().map(|(&id, look)| (id, format!("{look:x}"))).collect();
            hub.publish("thumbs", &json!({ "kind": "thumbs", "versions": versions }));
        }
        Ok(!due.is_empty())
    }
}
