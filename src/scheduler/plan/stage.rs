//! The stages of a step, which reports sum up the items of a list by.

/// A stage of a training step, in the order of the step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Stage {
    /// From Gaussians to splats.
    #[default]
    Project,
    /// Both radix sorts.
    Sort,
    /// Splats into lists of tiles.
    Tile,
    /// Blending; with labels also the label loss and the lift's votes.
    BlendForward,
    /// Photo loss and its gradient by the picture.
    Loss,
    /// Gradients of the tiles' splats.
    BlendBackward,
    /// Sum of these by splat.
    Gather,
    /// Gradients of the Gaussians.
    ProjectBackward,
    /// Adam, resets and densification.
    Optimise,
    /// Votes to labels.
    Labels,
    /// Counters for the host.
    Report,
}

impl Stage {
    /// All stages.
    pub const ALL: [Self; 11] = [
        Self::Project,
        Self::Sort,
        Self::Tile,
        Self::BlendForward,
        Self::Loss,
        Self::BlendBackward,
        Self::Gather,
        Self::ProjectBackward,
        Self::Optimise,
        Self::Labels,
        Self::Report,
    ];

    /// Name for tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Project => "project",
            Self::Sort => "sort",
            Self::Tile => "tile",
            Self::BlendForward => "blend forward",
            Self::Loss => "loss",
            Self::BlendBackward => "blend backward",
            Self::Gather => "gather",
            Self::ProjectBackward => "project backward",
            Self::Optimise => "optimise",
            Self::Labels => "labels",
            Self::Report => "report",
        }
    }
}
