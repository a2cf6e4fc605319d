//! Edits of a model and its label names, made one after the other by an editor and kept in a file.
//!
//! An [`Edit`] is one change, and [`Document::apply`] makes it. [`EditsFile`] lists all edits; replaying it on the same
//! model produces the same bytes.

mod apply;
mod file;
mod rows;

pub use apply::{Document, Sights};
pub use file::EditsFile;
pub use rows::Rows;

use serde::{Deserialize, Serialize};

/// Longest name of a label, bytes.
const NAME_MAX: usize = 200;

/// A change of labels or Gaussians. Rows are those of the model before the change.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "edit", rename_all = "lowercase", deny_unknown_fields)]
pub enum Edit {
    /// Names a label.
    Rename {
        /// The label.
        label: u32,
        /// Its name.
        name: String,
    },
    /// Merges several labels into the one with the smallest id.
    Merge {
        /// The labels.
        labels: Vec<u32>,
    },
    /// Splits a label into its connected parts. The largest part keeps the id.
    Split {
        /// The label.
        label: u32,
    },
    /// Mixes a colour into the Gaussians.
    Recolour {
        /// The labels.
        labels: Vec<u32>,
        /// r, g, b, 0 to 1.
        colour: [f32; 3],
        /// Share of the new colour, 0 to 1.
        mix: f32,
    },
    /// Removes the Gaussians of labels.
    Remove {
        /// The labels.
        labels: Vec<u32>,
        /// Also continue the surrounding surfaces over the hole, where no view ever looked.
        #[serde(default)]
        fill: bool,
    },
    /// Gives Gaussians a label.
    Assign {
        /// Which Gaussians.
        #[serde(default)]
        rows: Rows,
        /// The label; 0 removes labels, and `None` creates one.
        #[serde(default)]
        label: Option<u32>,
        /// The name of a new label, if any.
        #[serde(default)]
        name: Option<String>,
    },
    /// Removes Gaussians.
    Delete {
        /// Which Gaussians.
        #[serde(default)]
        rows: Rows,
    },
    /// Removes all other Gaussians.
    Keep {
        /// Which Gaussians stay.
        #[serde(default)]
        rows: Rows,
    },
    /// Adds shifted copies of Gaussians with a new label.
    Duplicate {
        /// Which Gaussians.
        #[serde(default)]
        rows: Rows,
        /// Shift from a Gaussian to its copy, world units.
        shift: [f64; 3],
        /// The name of the new label, if any.
        #[serde(default)]
        name: Option<String>,
    },
}

impl Edit {
    /// Returns what is wrong with the edit's values, if anything.
    fn problem(&self) -> Option<String> {
        match self {
            Self::Rename { name, .. }
            | Self::Assign { name: Some(name), .. }
            | Self::Duplicate { name: Some(name), .. } => name_problem(name),
            Self::Recolour { colour, mix, .. }
                if !colour.iter().chain([mix]).all(|value| (0.0..=1.0).contains(value)) =>
            {
                Some("colour and share are from 0 to 1".to_owned())
            }
            Self::Merge { labels } if labels.len() < 2 => Some("choose at least two labels to merge".to_owned()),
            Self::Duplicate { shift, .. } if !shift.iter().all(|value| value.is_finite()) => {
                Some("the shift of a copy must be finite".to_owned())
            }
            _ => None,
        }
    }

    /// Returns the labels that the edit names.
    pub fn labels(&self) -> &[u32] {
        match self {
            Self::Rename { label, .. } | Self::Split { label } => std::slice::from_ref(label),
            Self::Merge { labels } | Self::Recolour { labels, .. } | Self::Remove { labels, .. } => labels,
            Self::Assign { .. } | Self::Delete { .. } | Self::Keep { .. } | Self::Duplicate { .. } => &[],
        }
    }

    /// Returns the Gaussians that the edit names.
    pub fn rows(&self) -> Option<&Rows> {
        match self {
            Self::Assign { rows, .. } | Self::Delete { rows } | Self::Keep { rows } | Self::Duplicate { rows, .. } => {
                Some(rows)
            }
            _ => None,
        }
    }

    /// Replaces the Gaussians that the edit names, if it names any.
    pub fn with_rows(mut self, chosen: Rows) -> Self {
        match &mut self {
            Self::Assign { rows, .. } | Self::Delete { rows } | Self::Keep { rows } | Self::Duplicate { rows, .. } => {
                *rows = chosen;
            }
            _ => {}
        }
        self
    }

    /// Returns true if the edit adds or removes Gaussians.
    pub fn changes_rows(&self) -> bool {
        matches!(self, Self::Remove { .. } | Self::Delete { .. } | Self::Keep { .. } | Self::Duplicate { .. })
    }
}

fn name_problem(name: &str) -> Option<String> {
    if name.trim().is_empty() {
        Some("a name needs at least one letter".to_owned())
    } else if name.len() > NAME_MAX {
        Some(format!("a name has at most {NAME_MAX} bytes"))
    } else if name.contains(char::is_control) {
        Some("a name must be one line of text without control characters".to_owned())
    } else {
        None
    }
}
