//! What to do with a trained model: choose and edit labels, filter Gaussians, score, write pictures. Plain arrays only;
//! whoever renders hands them in.

pub mod associate;
pub mod ballot;
pub mod boundary;
pub mod catalogue;
pub mod choose;
pub mod compared;
pub mod components;
pub mod crop;
pub mod decide;
pub mod edit;
pub mod evaluate;
pub mod lift;
pub mod lpips;
pub mod metrics;
pub mod occlusion;
pub mod output;
pub mod page;
pub mod prompt;
pub mod protocol;
pub mod rename;
pub mod render;
pub mod repair;
pub mod scores;
pub mod select;
pub mod ssim;
pub mod ssim8;
