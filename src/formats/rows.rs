//! Rows of any model file. Rows that cannot be rendered are dropped and counted.

use super::format::ReadModel;
use glam::DVec3;
use labelgs_scene::origin::far_origin;
use labelgs_scene::{Gaussians, Result};
use std::path::Path;

/// Largest log-scale: the square of its exponential fits into f32, as covariances require.
pub(super) const LOG_SCALE_MAX: f32 = 44.0;

/// Fewest Gaussians for detecting activated values; fewer may look activated by chance.
const ACTIVATED_MIN: u64 = 16;

/// A row before activation, as in [`Gaussians`].
#[derive(Clone, Copy, Debug, Default)]
pub struct Row<'a> {
    /// World position.
    pub position: [f64; 3],
    /// (w, x, y, z), of any non-zero length.
    pub quat: [f64; 4],
    /// Logarithms of the standard deviations.
    pub scale: [f32; 3],
    /// Opacity before the sigmoid.
    pub opacity: f32,
    /// Colour coefficients of degree 0.
    pub sh0: [f32; 3],
    /// Triples (r, g, b) above degree 0.
    pub rest: &'a [[f32; 3]],
    /// Label, if the file has labels.
    pub label: Option<u32>,
    /// Confidence of the label, if the file has confidences.
    pub confidence: Option<f32>,
}

/// Separates renderable rows from others, and counts the others.
#[derive(Debug, Default)]
pub(super) struct RowFilter {
    total: u64,
    not_finite: u64,
    no_rotation: u64,
    too_large: u64,
    odd_opacities: u64,
    odd_scales: u64,
}

impl RowFilter {
    /// Returns the rotation of a renderable row.
    pub(super) fn rotation_of(&mut self, row: &Row) -> Option<[f32; 4]> {
        self.total += 1;
        let finite = row.position.iter().all(|&value| (value as f32).is_finite())
            && row.quat.iter().all(|&value| (value as f32).is_finite())
            && row.scale.iter().chain(&row.sh0).chain(row.rest.iter().flatten()).all(|value| value.is_finite())
            && row.opacity.is_finite();
        if !finite {
            self.not_finite += 1;
            return None;
        }
        if row.scale.iter().any(|&scale| scale > LOG_SCALE_MAX) {
            self.too_large += 1;
            return None;
        }
        let quat = rotation(row.quat);
        self.no_rotation += u64::from(quat.is_none());
        self.odd_opacities += u64::from(quat.is_some() && !(0.0..=1.0).contains(&row.opacity));
        self.odd_scales += u64::from(quat.is_some() && row.scale.iter().any(|&scale| scale <= 0.0));
        quat
    }

    /// Returns the number of dropped rows.
    pub(super) fn dropped(&self) -> u64 {
        self.not_finite + self.no_rotation + self.too_large
    }

    /// Returns true if the values look activated, although formats store logits and logarithms.
    pub(super) fn looks_activated(&self) -> bool {
        self.total - self.dropped() >= ACTIVATED_MIN && self.odd_opacities + self.odd_scales == 0
    }

    /// Returns a note on the dropped rows, if there are any.
    pub(super) fn note(&self) -> Option<String> {
        let all = [
            (self.not_finite, "with a value that is not finite"),
            (self.no_rotation, "with a zero rotation"),
            (self.too_large, "with an infinite size"),
        ];
        let some: Vec<String> = all.iter().filter(|r| r.0 > 0).map(|(count, why)| format!("{count} {why}")).collect();
        let (dropped, total) = (self.dropped(), self.total);
        (dropped > 0).then(|| format!("left out {dropped} of {total} Gaussians: {}", some.join(", ")))
    }
}

/// Rows of a file, in order.
#[derive(Debug, Default)]
pub(super) struct Rows {
    to: Gaussians,
    positions: Vec<DVec3>,
    pub(super) sieve: RowFilter,
}

impl Rows {
    /// Creates an empty list for rows of a degree, either all or none with label and confidence.
    pub(super) fn new(sh_degree: u32, labelled: bool, confident: bool) -> Self {
        let to = Gaussians {
            sh_degree,
            labels: labelled.then(Vec::new),
            label_confidence: (labelled && confident).then(Vec::new),
            ..Gaussians::default()
        };
        Self { to, ..Self::default() }
    }

    /// Appends a row, or counts the reason for dropping it.
    pub(super) fn push(&mut self, row: &Row) {
        let Some(quat) = self.sieve.rotation_of(row) else { return };
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

    /// Returns the model, with a note on dropped rows. Its positions are relative to `origin`, or without one in the
    /// file at `path`, to the origin beside it.
    pub(super) fn finish(self, path: &Path, origin: Option<DVec3>) -> Result<ReadModel> {
        let mut notes = Vec::new();
        let origin = match origin {
            Some(origin) => origin,
            None => super::origin::read(path, self.sieve.total, &mut notes)?,
        };
        notes.extend(self.sieve.note());
        let (dropped, far) = (self.sieve.dropped(), far_origin(&self.positions));
        Ok(ReadModel { gaussians: self.gaussians(origin, far), dropped, notes, ..ReadModel::default() })
    }

    /// Returns the rows, whose positions are relative to `origin`, relative to `far` instead.
    pub(super) fn gaussians(mut self, origin: DVec3, far: DVec3) -> Gaussians {
        self.to.origin = origin + far;
        self.to.means = self.positions.iter().map(|&position| (position - far).as_vec3().to_array()).collect();
        self.to
    }
}

/// Returns the stored rotation, normalised only if its squared length does not fit into f32; `None` for zero.
fn rotation(quat: [f64; 4]) -> Option<[f32; 4]> {
    let length = quat.iter().map(|v| v * v).sum::<f64>().sqrt();
    if length == 0.0 {
        return None;
    }
    let usual = (1e-6..=1e6).contains(&length);
    Some(quat.map(|v| if usual { v as f32 } else { (v / length) as f32 }))
}
