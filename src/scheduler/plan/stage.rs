//! Stages of a step; reports sum times by stage.

/// A stage of a training step, in execution order.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Stage {
    /// Projection of Gaussians to splats.
    #[default]
    Project,
    /// Both radix sorts.
    Sort,
    /// Binning of splats into tile lists.
    Tile,
    /// Forward blending; with labels also the label loss and the lift's votes.
    BlendForward,
    /// Photo loss and its gradient with respect to the picture.
    Loss,
    /// Backward blending: gradients of (splat, tile) pairs.
    BlendBackward,
    /// Sum of these gradients per splat.
    Gather,
    /// Gradients of the Gaussians.
    ProjectBackward,
    /// Adam, resets and densification.
    Optimise,
    /// Labels from votes.
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
