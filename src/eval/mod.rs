//! Scores of a model against ground truth.
//!
//! [`evaluate`] renders held-out views and objects and returns their [`Scores`]: PSNR, SSIM, IoU. [`protocol`] runs
//! published benchmarks of object masks. [`psnr`] and [`ssim()`] score single pictures. A [`PictureObserver`] receives
//! every scored picture with its ground truth. [`removals`] scores what is left where objects were removed.

pub mod boundary;
pub(crate) mod compared;
mod corrected;
pub mod crop;
pub(crate) mod evaluate;
pub mod lpips;
pub mod metrics;
pub mod page;
mod places;
pub mod protocol;
pub(crate) mod regions;
pub(crate) mod removal;
pub mod scores;
pub mod specks;
pub mod ssim;
pub mod ssim8;
pub mod subject;
pub(crate) mod target;

pub use compared::{PictureObserver, ScoredPicture};
pub use evaluate::{AmodalTruth, Rendering, evaluate};
pub use lpips::Weights as LpipsWeights;
pub use metrics::psnr;
pub use places::{PlaceGroups, PlaceScore, score_by_place};
pub use protocol::score::Distance;
pub use regions::RegionScores;
pub use removal::{HoleScores, ObjectRemoval, RemovalScores, RemovalTruth, RuleScores, removals, sights};
pub use scores::{MeanScores, ObjectScores, Scores, ViewScores};
pub use ssim::ssim;
pub use subject::{Subject, WholeModel};
