//! Changes of a model and of the names of its labels, one after the other, as an editor makes them and a file keeps them.
//!
//! An [`Edit`] is one change; [`Document::apply`] makes it; [`EditsFile`] is the list of all of them, which makes the same
//! bytes of the same model again.

mod apply;
mod file;
mod rows;

pub use apply::{Document, Sights};
pub use file::EditsFile;
pub use rows::Rows;

use serde::{Deserialize, Serialize};

/// Longest name of a label, bytes.
const NAME_MAX: usize = 200;

/// A change of labels or of Gaussians. Rows are those of the model before the change.
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
    /// Makes several labels one, with the smallest id.
    Merge {
        /// The labels.
        labels: Vec<u32>,
    },
    /// Makes labels of the connected parts of a label. The largest part keeps the id.
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
        /// Continue the surfaces around them where no view ever looked.
        #[serde(default)]
        fill: bool,
    },
    /// Gives Gaussians a label.
    Assign {
        /// Which Gaussians.
        #[serde(default)]
        rows: Rows,
        /// The label; 0 takes theirs away, none makes a new one.
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
    /// Adds copies of Gaussians beside them, with a label of their own.
    Duplicate {
        /// Which Gaussians.
        #[serde(default)]
        rows: Rows,
        /// From a Gaussian to its copy, world units.
        shift: [f64; 3],
        /// The name of the new label, if any.
        #[serde(default)]
        name: Option<String>,
    },
}

impl Edit {
    /// Returns what is wrong with the values, if anything.
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
                Some("a copy is at a finite place".to_owned())
            }
            _ => None,
        }
    }

    /// Returns the labels that it names.
    pub fn labels(&self) -> &[u32] {
        match self {
            Self::Rename { label, .. } | Self::Split { label } => std::slice::from_ref(label),
            Self::Merge { labels } | Self::Recolour { labels, .. } | Self::Remove { labels, .. } => labels,
            Self::Assign { .. } | Self::Delete { .. } | Self::Keep { .. } | Self::Duplicate { .. } => &[],
        }
    }

    /// Returns the Gaussians that it names.
    pub fn rows(&self) -> Option<&Rows> {
        match self {
            Self::Assign { rows, .. } | Self::Delete { rows } | Self::Keep { rows } | Self::Duplicate { rows, .. } => {
                Some(rows)
            }
            _ => None,
        }
    }

    /// Returns the same for other Gaussians, if it is about some.
    pub fn with_rows(mut self, chosen: Rows) -> Self {
        match &mut self {
            Self::Assign { rows, .. } | Self::Delete { rows } | Self::Keep { rows } | Self::Duplicate { rows, .. } => {
                *rows = chosen;
            }
            _ => {}
        }
        self
    }

    /// Returns true if the model has other Gaussians afterwards.
    pub fn changes_rows(&self) -> bool {
        matches!(self, Self::Remove { .. } | Self::Delete { .. } | Self::Keep { .. } | Self::Duplicate { .. })
    }
}

fn name_problem(name: &str) -> Option<String> {
    if name.trim().is_empty() {
        Some("a name has at least one letter".to_owned())
    } else if name.len() > NAME_MAX {
        Some(format!("a name has at most {NAME_MAX} bytes"))
    } else if name.contains(char::is_control) {
        Some("a name is one line of text without control characters".to_owned())
    } else {
        None
    }
}
