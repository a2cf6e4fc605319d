//! Decodes rows of a 3DGS PLY.

use super::columns::Columns;
use crate::rows::Row;
use labelgs_scene::harmonics::{coefficients, sh0_of};
use labelgs_scene::{Error, MODEL_LABEL_MAX, Result};
use std::path::Path;

/// Number of values in a row before the harmonics.
const VALUES_BEFORE_SH: usize = 14;
/// Standard deviation across a 2DGS disc, as viewers of 2DGS draw it.
const DISC_THICKNESS: f32 = 1e-6;
/// Bounds on the opacity of a filtered Gaussian, so that its logit is finite.
const OPACITY_MIN: f64 = 1e-12;
const OPACITY_MAX: f64 = 1.0 - 1e-12;
/// Bits of the column `state`, which Gaussian editors write.
const SELECTED_BIT: u8 = 1;
const DELETED_BIT: u8 = 4;
/// The label of a Gaussian without an object in the paper's models.
const PAPER_UNLABELLED: f64 = -1.0;

/// Decodes rows and counts what the user should know.
pub(super) struct Decoder<'a> {
    path: &'a Path,
    columns: &'a Columns,
    triples: Vec<[f32; 3]>,
    /// Number of Gaussians that an editor has deleted.
    pub(super) deleted: u64,
    /// Number of labels that are -1.
    minus_one: u64,
}

impl<'a> Decoder<'a> {
    pub(super) fn new(path: &'a Path, columns: &'a Columns) -> Self {
        let triples = vec![[0.0; 3]; coefficients(columns.sh_degree)];
        Self { path, columns, triples, deleted: 0, minus_one: 0 }
    }

    /// Decodes the row with this number in the file, or returns `None` if an editor has deleted it.
    pub(super) fn row(&mut self, index: u64, row: &[f64]) -> Result<Option<Row<'_>>> {
        let Columns { flat, full_colour, filter, label, confidence, state, .. } = *self.columns;
        let rest = self.triples.len();
        let value = |index: usize| row[index] as f32;
        for (k, triple) in self.triples.iter_mut().enumerate() {
            *triple = [0, 1, 2].map(|channel| value(VALUES_BEFORE_SH + k + channel * rest));
        }
        let third = if flat { DISC_THICKNESS.ln() } else { value(9) };
        let (mut opacity, mut scale) = (value(6), [value(7), value(8), third]);
        if let Some(at) = filter {
            (opacity, scale) = blurred(opacity, scale, row[at]);
        }
        let mut label = label.map(|at| self.label_of(index, row[at])).transpose()?;
        let confidence = confidence.map(|at| confidence_of(self.path, index, row[at])).transpose()?;
        if let Some(at) = state {
            let state = row[at] as u8;
            if state & DELETED_BIT != 0 {
                self.deleted += 1;
                return Ok(None);
            }
            label = Some(u32::from(state & SELECTED_BIT));
        }
        Ok(Some(Row {
            position: [row[0], row[1], row[2]],
            sh0: [3, 4, 5].map(|at| full_colour.map_or(value(at), |full| sh0_of(row[at] / full))),
            opacity,
            scale,
            quat: [row[10], row[11], row[12], row[13]],
            rest: &self.triples,
            label,
            confidence,
        }))
    }

    /// Returns notes for the user, after the last row.
    pub(super) fn notes(&self) -> Vec<String> {
        let mut notes: Vec<String> = self.columns.notes().collect();
        if self.columns.state.is_some() {
            let note = "the selection in the column `state` became label 1";
            let deleted = self.deleted;
            let more = if deleted > 0 { format!("; {deleted} deleted Gaussians were omitted") } else { String::new() };
            notes.push(format!("{note}{more}"));
        }
        if self.minus_one > 0 {
            notes.push(format!("{} labels are -1, which means unlabelled (0) in the paper's models", self.minus_one));
        }
        notes
    }

    fn label_of(&mut self, index: u64, value: f64) -> Result<u32> {
        if value == PAPER_UNLABELLED {
            self.minus_one += 1;
            return Ok(0);
        }
        if value.fract() == 0.0 && (0.0..=f64::from(MODEL_LABEL_MAX)).contains(&value) {
            return Ok(value as u32);
        }
        let problem = format!(
            "label {value} is not a whole number from 0 (unlabelled; -1 too) to {MODEL_LABEL_MAX}; renumber the labels \
             in the program that wrote them, or give the column another name in the header to read the file without them"
        );
        Err(Error::data(self.path, format!("vertex {index}"), problem))
    }
}

/// Applies the filter of Mip-Splatting to the logit and log-scales of a Gaussian: squared sizes add up, and the opacity
/// falls as the volume grows.
fn blurred(opacity: f32, scale: [f32; 3], filter: f64) -> (f32, [f32; 3]) {
    if filter == 0.0 {
        return (opacity, scale);
    }
    let sizes = scale.map(|scale| f64::from(scale).exp());
    let larger = sizes.map(|size| size.hypot(filter));
    let shrunk: f64 = sizes.iter().zip(&larger).map(|(size, larger)| size / larger).product();
    let share = shrunk / (1.0 + (-f64::from(opacity)).exp());
    let share = if share.is_nan() { share } else { share.clamp(OPACITY_MIN, OPACITY_MAX) };
    ((share / (1.0 - share)).ln() as f32, larger.map(|size| size.ln() as f32))
}

fn confidence_of(path: &Path, index: u64, value: f64) -> Result<f32> {
    if (0.0..=1.0).contains(&value) {
        return Ok(value as f32);
    }
    let problem = format!("label_confidence {value} is not from 0 to 1; correct it or leave out the column");
    Err(Error::data(path, format!("vertex {index}"), problem))
}
