//! What to do with a trained model: render it, give it labels, choose and edit them, score it, write pictures.

pub mod edit;
pub mod masks;
pub mod occlusion;
pub mod output;
pub mod render;
pub mod score;
pub mod vote;
