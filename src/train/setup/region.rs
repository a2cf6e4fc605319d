//! A region of a scene that is trained alone, with the rest frozen.

use crate::error::{Error, Result};
use crate::scene::{Gaussians, Zone};
use crate::train::shared::exposure;
use std::collections::BTreeMap;

/// A region of a larger scene. Its first model has the region's Gaussians, followed by frozen Gaussians that are drawn
/// but not trained.
#[derive(Clone, Debug, PartialEq)]
pub struct Region {
    /// Number of frozen Gaussians at the end of the model.
    pub frozen: u32,
    /// Where Gaussians grow.
    pub zone: Zone,
    /// Extent of the whole scene, world units, on which learning rates and size limits depend.
    pub extent: f64,
    /// Fixed exposures of photos, by name; may be empty.
    pub exposures: BTreeMap<String, exposure::Rows>,
}

impl Region {
    /// Returns the number of frozen Gaussians of a training.
    pub(in crate::train) fn frozen(region: Option<&Self>) -> u32 {
        region.map_or(0, |region| region.frozen)
    }

    /// Refuses a first model without a Gaussian to train.
    pub(in crate::train) fn check(&self, model: &Gaussians) -> Result<()> {
        let (all, frozen) = (model.len(), self.frozen);
        if (frozen as usize) < all {
            return Ok(());
        }
        Err(Error::usage(
            "frozen",
            format!("is {frozen}, but the first model has only {all} Gaussians, so none would be trained"),
        ))
    }
}
