//! Scores of a model.

mod metrics; // PSNR, SSIM, IoU and boundary scores
mod protocol; // scores of the published benchmarks
mod removal; // scores of removals, and filling from the command line
