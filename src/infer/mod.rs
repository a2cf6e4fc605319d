//! What to do with a trained model: choose labels, filter Gaussians, score, write pictures. Plain arrays only; whoever
//! renders hands them in.

pub mod associate;
pub mod ballot;
pub mod boundary;
pub mod choose;
pub mod compared;
pub mod crop;
pub mod decide;
pub mod evaluate;
pub mod lift;
pub mod lpips;
pub mod metrics;
pub mod occlusion;
pub mod output;
pub mod page;
pub mod protocol;
pub mod render;
pub mod repair;
pub mod scores;
pub mod select;
pub mod ssim;
pub mod ssim8;
