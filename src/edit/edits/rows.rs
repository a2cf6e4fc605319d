//! Gaussians of a model by row, in a compact text form.

use labelgs_scene::{Error, Result};
use serde::{Deserialize, Serialize};

/// Rows of a model as alternating lengths of skipped and chosen runs, from the first row. The text form in files is `12
/// 3 5 2` for rows 12, 13, 14, 20 and 21.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(into = "String", try_from = "String")]
pub struct Rows(Vec<u32>);

impl From<Rows> for String {
    fn from(rows: Rows) -> Self {
        rows.0.iter().map(u32::to_string).collect::<Vec<_>>().join(" ")
    }
}

impl TryFrom<String> for Rows {
    type Error = String;

    fn try_from(text: String) -> std::result::Result<Self, String> {
        let number = |word: &str| word.parse().map_err(|error| format!("rows: {word}: {error}"));
        text.split_whitespace().map(number).collect::<std::result::Result<_, _>>().map(Self)
    }
}

impl Rows {
    /// Collects the rows that are true.
    pub fn from_mask(rows: &[bool]) -> Self {
        let mut runs = Vec::new();
        let mut is_in = false;
        let mut length = 0;
        for &row in rows {
            if row != is_in {
                runs.push(length);
                (is_in, length) = (row, 0);
            }
            length += 1;
        }
        if is_in {
            runs.push(length);
        }
        Self(runs)
    }

    /// Returns a flag for each of `count` rows, true for the chosen ones.
    ///
    /// # Errors
    ///
    /// A row that the model does not have.
    pub fn mask(&self, count: usize) -> Result<Vec<bool>> {
        let end: u64 = self.0.iter().map(|&length| u64::from(length)).sum();
        if end > count as u64 {
            return Err(Error::usage("choice", format!("has row {end}; the model has {count}")));
        }
        let mut rows = Vec::with_capacity(count);
        for (index, &length) in self.0.iter().enumerate() {
            rows.resize(rows.len() + length as usize, index % 2 == 1);
        }
        rows.resize(count, false);
        Ok(rows)
    }

    /// Returns the number of rows.
    pub fn count(&self) -> u64 {
        self.0.iter().skip(1).step_by(2).map(|&length| u64::from(length)).sum()
    }
}
