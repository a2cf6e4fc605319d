//! The columns of a 3DGS PLY, and its rows.

use crate::error::{Error, Result};
use crate::io::model::rows::{Row, Rows};
use crate::io::ply::Table;
use crate::scene::MODEL_LABEL_MAX;
use std::path::Path;

/// Columns of every 3DGS PLY, in the order of decoding.
const REQUIRED: [&str; 14] = [
    "x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", "opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2",
    "rot_3",
];

/// Bits of the column `state` that editors of Gaussians write.
const SELECTED: u8 = 1;
const DELETED: u8 = 4;

/// The columns that a file has.
#[derive(Clone, Debug)]
pub(super) struct Columns {
    pub(super) sh_degree: u32,
    names: Vec<String>,
    labelled: bool,
    confident: bool,
    edited: bool,
}

impl Columns {
    /// Finds them in a header.
    pub(super) fn of(path: &Path, table: &Table) -> Result<Self> {
        let sh_degree = sh_degree(path, table)?;
        let has = |name: &str| table.names().any(|found| found == name);
        if has("red") && !has("f_dc_0") {
            let problem = "holds coloured points, not Gaussians: it has `red` and no `f_dc_0`; train on them first";
            return Err(Error::data(path, "header", problem));
        }
        let rest = ((sh_degree + 1) * (sh_degree + 1) - 1) as usize;
        let mut names: Vec<String> = REQUIRED.map(String::from).to_vec();
        names.extend((0..rest * 3).map(|index| format!("f_rest_{index}")));
        let (labelled, edited) = (has("label"), !has("label") && has("state"));
        let confident = labelled && has("label_confidence");
        for (there, name) in [(labelled, "label"), (confident, "label_confidence"), (edited, "state")] {
            names.extend(there.then(|| name.to_owned()));
        }
        Ok(Self { sh_degree, names, labelled, confident, edited })
    }

    /// Their names, in the order of decoding.
    pub(super) fn names(&self) -> Vec<&str> {
        self.names.iter().map(String::as_str).collect()
    }

    /// Returns true if rows have labels.
    pub(super) fn have_labels(&self) -> bool {
        self.labelled || self.edited
    }

    /// Returns true if an editor has selected or deleted Gaussians.
    pub(super) fn is_edited(&self) -> bool {
        self.edited
    }

    /// Returns an empty list for the rows.
    pub(super) fn rows(&self) -> Rows {
        Rows::new(self.sh_degree, self.have_labels(), self.confident)
    }

    /// Returns room for the coefficients of a row.
    pub(super) fn triples(&self) -> Vec<[f32; 3]> {
        vec![[0.0; 3]; ((self.sh_degree + 1) * (self.sh_degree + 1) - 1) as usize]
    }

    /// Returns the row of the values with this number in a file; `None` if an editor has deleted it.
    pub(super) fn row<'a>(
        &self,
        (path, index): (&Path, u64),
        row: &[f64],
        triples: &'a mut [[f32; 3]],
    ) -> Result<Option<Row<'a>>> {
        let rest = triples.len();
        let (row, labelling) = row.split_at(REQUIRED.len() + rest * 3);
        let value = |index: usize| row[index] as f32;
        for (k, triple) in triples.iter_mut().enumerate() {
            *triple = [0, 1, 2].map(|channel| value(REQUIRED.len() + k + channel * rest));
        }
        let mut label = None;
        if self.labelled {
            label = Some(label_of(path, index, labelling[0])?);
        } else if self.edited {
            let state = labelling[0] as u8;
            if state & DELETED != 0 {
                return Ok(None);
            }
            label = Some(u32::from(state & SELECTED));
        }
        let share = labelling.get(1).filter(|_| self.confident);
        Ok(Some(Row {
            position: [row[0], row[1], row[2]],
            sh0: [value(3), value(4), value(5)],
            opacity: value(6),
            scale: [value(7), value(8), value(9)],
            quat: [row[10], row[11], row[12], row[13]],
            rest: triples,
            label,
            confidence: share.map(|&share| confidence_of(path, index, share)).transpose()?,
        }))
    }
}

/// Returns the degree for the number of `f_rest_*` columns.
fn sh_degree(path: &Path, table: &Table) -> Result<u32> {
    let count = table.names().filter(|name| name.starts_with("f_rest_")).count();
    match count {
        0 => Ok(0),
        9 => Ok(1),
        24 => Ok(2),
        45 => Ok(3),
        _ => {
            let problem = format!("{count} `f_rest_` properties; 0, 9, 24 or 45 (SH degree 0 to 3) are supported");
            Err(Error::data(path, "header", problem))
        }
    }
}

fn label_of(path: &Path, index: u64, value: f64) -> Result<u32> {
    if value.fract() == 0.0 && (0.0..=f64::from(MODEL_LABEL_MAX)).contains(&value) {
        return Ok(value as u32);
    }
    let problem =
        format!("label {value} is not a whole number from 0 (unlabelled) to {MODEL_LABEL_MAX}; renumber the labels");
    Err(Error::data(path, format!("vertex {index}"), problem))
}

fn confidence_of(path: &Path, index: u64, value: f64) -> Result<f32> {
    if (0.0..=1.0).contains(&value) {
        return Ok(value as f32);
    }
    let problem = format!("label_confidence {value} is not from 0 to 1; correct it or leave out the column");
    Err(Error::data(path, format!("vertex {index}"), problem))
}
