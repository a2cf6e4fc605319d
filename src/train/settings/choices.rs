//! Choices among a few ways of training.

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

/// Whether gains of each photo are trained.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[serde(rename_all = "lowercase")]
pub enum ExposureMode {
    /// On if the points of the reconstruction differ in brightness from photo to photo.
    #[default]
    Auto,
    /// Gains are trained.
    On,
    /// All photos have one exposure, as in 3DGS of 2023.
    Off,
}

/// The rule for the number of Gaussians.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[serde(rename_all = "lowercase")]
pub enum StrategyKind {
    /// Growth where it helps most, within a budget that rises over the run.
    #[default]
    Budget,
    /// Relocation of 3DGS-MCMC: dead Gaussians become copies of others, and faint ones move at random.
    Mcmc,
    /// Adaptive density control of 3DGS: every large gradient grows.
    Adc,
}

/// The rule that gives a Gaussian its label.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[serde(rename_all = "lowercase")]
pub enum LabelRule {
    /// The label of the pixels in the step's view where the Gaussian has the largest weight; the last view wins
    /// (LabelGS).
    Main,
    /// The label with the largest sum of weights over the pixels of all views, counted every `vote_every` steps and at
    /// the end.
    #[default]
    Votes,
}

/// How both moments of Adam of a parameter are kept.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[serde(rename_all = "lowercase")]
pub enum Moments {
    /// As two numbers of 32 bits.
    #[default]
    Full,
    /// As two numbers of 16 bits: their ratio, and the logarithm of the second one.
    Half,
}
