//! Enumerated training settings.

use serde::{Deserialize, Serialize};

/// The source of the occluders for the label loss.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[serde(rename_all = "lowercase")]
pub enum Occlusion {
    /// No occluders: every pixel outside an object's mask is expected to be black.
    None,
    /// Depth of the model itself, rendered every `occlusion_every` steps. The paper uses monocular depth of a network
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
    /// On if the brightness of reconstruction points varies between photos.
    #[default]
    Auto,
    /// Exposures are trained.
    On,
    /// All photos have the same exposure, as in 3DGS of 2023.
    Off,
}

/// The strategy for the number of Gaussians.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[serde(rename_all = "lowercase")]
pub enum StrategyKind {
    /// Growth where it helps most, within a budget that rises during the run.
    #[default]
    Budget,
    /// Relocation (3DGS-MCMC): dead Gaussians become copies of others, and faint ones move at random.
    Mcmc,
    /// Adaptive density control (3DGS): Gaussians with large gradients grow.
    Adc,
}

/// The rule that gives a Gaussian its label.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[serde(rename_all = "lowercase")]
pub enum LabelRule {
    /// The label of pixels in the step's view where the Gaussian has the largest weight; the last view wins (LabelGS).
    Main,
    /// The label with the largest sum of weights over all views, counted every `vote_every` steps and at the end.
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
    /// Two 16-bit numbers: their ratio, and the logarithm of the second moment.
    Half,
}
