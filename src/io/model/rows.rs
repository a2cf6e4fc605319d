//! Rows of any model file: those that cannot be rendered are left out and counted.

use super::format::ReadModel;
use crate::error::Result;
use crate::scene::Gaussians;
use crate::scene::origin::far_origin;
use glam::DVec3;
use std::path::Path;

/// Largest log-scale: the square of its exponential fits into f32, as covariances need it.
pub(super) const LOG_SCALE_MAX: f32 = 44.0;

/// A row, before activation, as in [`Gaussians`].
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Row<'a> {
    pub(super) position: [f64; 3],
    /// (w, x, y, z), of any length but 0.
    pub(super) quat: [f64; 4],
    pub(super) scale: [f32; 3],
    pub(super) opacity: f32,
    pub(super) sh0: [f32; 3],
    /// Triples (r, g, b) above degree 0.
    pub(super) rest: &'a [[f32; 3]],
    pub(super) label: Option<u32>,
    pub(super) confidence: Option<f32>,
}

/// Rows of a file, in order.
#[derive(Debug, Default)]
pub(super) struct Rows {
    to: Gaussians,
    positions: Vec<DVec3>,
    total: u64,
    not_finite: u64,
    no_rotation: u64,
    too_large: u64,
}

impl Rows {
    /// Makes an empty list for rows of a degree, all with or all without label and confidence.
    pub(super) fn new(sh_degree: u32, labelled: bool, confident: bool) -> Self {
        let to = Gaussians {
            sh_degree,
            labels: labelled.then(Vec::new),
            label_confidence: (labelled && confident).then(Vec::new),
            ..Gaussians::default()
        };
        Self { to, ..Self::default() }
    }

    /// Appends a row, or counts the reason for leaving it out.
    pub(super) fn push(&mut self, row: &Row) {
        self.total += 1;
        let finite = row.position.iter().all(|&value| (value as f32).is_finite())
            && row.quat.iter().all(|&value| (value as f32).is_finite())
            && row.scale.iter().chain(&row.sh0).chain(row.rest.iter().flatten()).all(|value| value.is_finite())
            && row.opacity.is_finite();
        if !finite {
            self.not_finite += 1;
            return;
        }
        if row.scale.iter().any(|&scale| scale > LOG_SCALE_MAX) {
            self.too_large += 1;
            return;
        }
        let Some(quat) = rotation(row.quat) else {
            self.no_rotation += 1;
            return;
        };
        self.to.sh0.push(row.sh0);
        self.to.opacities.push(row.opacity);
        self.to.scales.push(row.scale);
        self.to.quats.push(quat);
        self.to.sh_rest.extend_from_slice(row.rest);
        if let Some(labels) = self.to.labels.as_mut() {
            labels.push(row.label.unwrap_or_default());
        }
        if let Some(shares) = self.to.label_confidence.as_mut() {
            shares.push(row.confidence.unwrap_or_default());
        }
        self.positions.push(DVec3::from_array(row.position));
    }

    /// Returns the model, with a note on the rows left out. Its positions are relative to `origin`; without one in the
    /// file at `path`, to the one beside it.
    pub(super) fn finish(mut self, path: &Path, origin: Option<DVec3>) -> Result<ReadModel> {
        let dropped = self.not_finite + self.no_rotation + self.too_large;
        let mut notes = Vec::new();
        let origin = match origin {
            Some(origin) => origin,
            None => super::origin::read(path, self.total, &mut notes)?,
        };
        let far = far_origin(&self.positions);
        self.to.origin = origin + far;
        self.to.means = self.positions.iter().map(|&position| (position - far).as_vec3().to_array()).collect();
        let all = [
            (self.not_finite, "with a value that is not finite"),
            (self.no_rotation, "with a zero rotation"),
            (self.too_large, "with an infinite size"),
        ];
        let some: Vec<String> = all.iter().filter(|r| r.0 > 0).map(|(count, why)| format!("{count} {why}")).collect();
        if dropped > 0 {
            notes.push(format!("left out {dropped} of {} Gaussians: {}", self.total, some.join(", ")));
        }
        Ok(ReadModel { gaussians: self.to, names: None, dropped, notes })
    }
}

/// Returns the rotation as stored, normalised only if its squared length does not fit into f32; `None` for zero.
fn rotation(quat: [f64; 4]) -> Option<[f32; 4]> {
    let length = quat.iter().map(|v| v * v).sum::<f64>().sqrt();
    if length == 0.0 {
        return None;
    }
    let usual = (1e-6..=1e6).contains(&length);
    Some(quat.map(|v| if usual { v as f32 } else { (v / length) as f32 }))
}
