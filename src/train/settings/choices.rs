//! Enumerated training settings.

use crate::Setting;
use serde::{Deserialize, Serialize};

/// The source of the occluders for the label loss.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[serde(rename_all = "lowercase")]
pub enum Occlusion {
    /// No occluders: all pixels outside of an object's mask should be black.
    None,
    /// Depth rendered from the model every `occlusion_every` steps. The paper uses monocular depth from a network
    /// instead.
    #[default]
    Rendered,
    /// Lists from the file of --occluders.
    #[cfg_attr(feature = "cli", value(skip))]
    File,
}

/// Whether the exposure of each photo is trained.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[serde(rename_all = "lowercase")]
pub enum ExposureMode {
    /// On if the points of the reconstruction change in brightness from photo to photo.
    #[default]
    Auto,
    /// Train gains for each photo.
    On,
    /// Assume the same exposure for all photos, as 3DGS of 2023.
    Off,
}

/// The strategy for the number of Gaussians.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[serde(rename_all = "lowercase")]
pub enum StrategyKind {
    /// Add Gaussians where they help most, within a budget that rises during the run.
    #[default]
    Budget,
    /// Relocation (3DGS-MCMC): dead Gaussians become copies of others, and faint ones move at random.
    Mcmc,
    /// Adaptive density control of 3DGS: clone or split every Gaussian with a large gradient.
    Adc,
}

/// The rule that gives a Gaussian its label.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[serde(rename_all = "lowercase")]
pub enum LabelRule {
    /// The label of the pixels where the Gaussian has the largest weight, in the view of the step; the last view wins
    /// (LabelGS).
    Main,
    /// The label with the largest total weight over the pixels of all views, counted every `vote_every` steps and at
    /// the end.
    #[default]
    Votes,
}

/// How Adam's two moments of a parameter are stored.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[serde(rename_all = "lowercase")]
pub enum Moments {
    /// Two 32-bit numbers.
    #[default]
    Full,
    /// Two 16-bit numbers: the ratio of the moments, and the logarithm of the second moment.
    Half,
}

impl Moments {
    /// Fewest Gaussians with the advice: an update of them on a GPU moves gigabytes.
    const ADVISED_MIN: u64 = 2_000_000;

    /// Returns the advice to use 16-bit numbers for so many Gaussians on a GPU, if they are not used already.
    pub(crate) fn advice(self, gaussians: u64) -> Option<String> {
        let is_advised = self == Self::Full && gaussians >= Self::ADVISED_MIN;
        is_advised.then(|| {
            format!("{} saves 240 bytes of each Gaussian, and time in each step", Setting("moments").to("half"))
        })
    }
}
