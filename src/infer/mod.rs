//! What to do with a trained model: choose and edit labels, filter Gaussians, score, write pictures. Plain arrays only;
//! whoever renders hands them in.

pub mod catalogue;
pub mod choose;
pub mod components;
pub mod edit;
pub mod evaluate;
pub mod metrics;
pub mod occlusion;
pub mod output;
pub mod prompt;
pub mod rename;
pub mod render;
pub mod scores;
pub mod select;
pub mod ssim;
