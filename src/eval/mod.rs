//! Scores: pictures and outlines against the truth, published benchmarks, and pages to look at.

pub mod boundary;
pub mod compared;
pub mod crop;
pub mod evaluate;
pub mod lpips;
pub mod metrics;
pub mod page;
pub mod protocol;
pub mod scores;
pub mod ssim;
pub mod ssim8;
