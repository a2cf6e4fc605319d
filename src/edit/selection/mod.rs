//! Gaussians chosen by hand: by what is drawn over a picture, by a place, by what is alike, and by what is near.
//!
//! Each rule returns a choice, one flag for each row of the model; [`Combine`] joins it with the one before.

mod nearby;
mod region;

pub use nearby::Nearby;
pub(crate) use nearby::{colour, normal};
pub use region::{Region, Shape, Side, beyond, in_region, in_sphere};

use serde::Deserialize;

/// How a new choice joins the one before.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Combine {
    /// It takes its place.
    #[default]
    Replace,
    /// It is added.
    Add,
    /// It is taken away.
    Take,
    /// Only what both have is left.
    Within,
}

impl Combine {
    /// Returns what becomes of `before`.
    pub fn join(self, before: &[bool], found: &[bool]) -> Vec<bool> {
        let join = |(&before, &found): (&bool, &bool)| match self {
            Self::Replace => found,
            Self::Add => before || found,
            Self::Take => before && !found,
            Self::Within => before && found,
        };
        before.iter().zip(found).map(join).collect()
    }
}
