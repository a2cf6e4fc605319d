//! What to do with a trained model: choose labels, filter Gaussians, score, write pictures. Plain arrays only; whoever
//! renders hands them in.

pub mod boundary;
pub mod choose;
pub mod compared;
pub mod crop;
pub mod evaluate;
pub mod lpips;
pub mod metrics;
pub mod occlusion;
pub mod output;
pub mod page;
pub mod protocol;
pub mod render;
pub mod scores;
pub mod select;
pub mod ssim;
pub mod ssim8;
