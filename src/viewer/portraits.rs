//! Pictures of the labels for the list, made anew when a label has changed.

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

/// Side of a picture, px.
const PORTRAIT_SIDE: u32 = 72;
/// Most labels with a picture.
const LABELS_MAX: usize = 512;
/// Time for pictures before the next request is looked for, if none has come.
const ROUND_TIME_MAX: Duration = Duration::from_millis(400);

/// What a label looked like in its picture, as a checksum.
type AppearanceHash = u64;

/// The pictures that are there.
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

    /// Makes a few pictures. Returns true if it has, and another model is on the device.
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
