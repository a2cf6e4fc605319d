//! A part of a scene that is trained alone, in the light of the rest.

use crate::error::{Error, Result};
use crate::scene::{Gaussians, Zone};
use crate::train::shared::exposure;
use std::collections::BTreeMap;

/// A part of a larger scene. Its first model has the Gaussians of the part, then others that are drawn and not trained.
#[derive(Clone, Debug, PartialEq)]
pub struct Region {
    /// Number of Gaussians at the end of the model that stay as they are.
    pub frozen: u32,
    /// Where Gaussians grow.
    pub zone: Zone,
    /// Extent of the whole scene, world units: learning rates and limits of size follow from it.
    pub extent: f64,
    /// Exposures of photos, by name, that stay as they are; empty for none.
    pub exposures: BTreeMap<String, exposure::Rows>,
}

impl Region {
    /// Returns the frozen Gaussians of a training.
    pub(in crate::train) fn frozen(region: Option<&Self>) -> u32 {
        region.map_or(0, |region| region.frozen)
    }

    /// Refuses a first model without a Gaussian to train.
    pub(in crate::train) fn check(&self, model: &Gaussians) -> Result<()> {
        let (all, frozen) = (model.len(), self.frozen);
        if (frozen as usize) < all {
            return Ok(());
        }
        Err(Error::usage("frozen", format!("is {frozen}, and the first model has {all} Gaussians: none is trained")))
    }
}
