//! Scores: pictures and outlines against the truth, published benchmarks, and pages to look at.

pub(crate) mod boundary;
pub(crate) mod compared;
pub(crate) mod crop;
pub(crate) mod evaluate;
pub(crate) mod lpips;
pub(crate) mod metrics;
pub(crate) mod page;
pub mod protocol;
pub(crate) mod scores;
pub(crate) mod ssim;
pub(crate) mod ssim8;

pub use compared::{Compared, Watch};
pub use evaluate::{AmodalTruth, Rendering, evaluate};
pub use metrics::psnr;
pub use scores::{MeanScores, ObjectScores, Scores, ViewScores};
pub use ssim::ssim;
