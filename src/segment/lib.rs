//! Masks of single photos from a promptable segmentation network ([`Network`]), whose weights the user supplies.
//!
//! An encoder processes a photo once ([`Features`]); a decoder answers prompts ([`Prompt`]) with masks.

mod candidate;
mod features;
mod interface;
mod levels;
mod network;
mod prompt;

pub use candidate::Search;
pub use features::{FeatureCache, Features};
pub use levels::{Level, PhotoMasks, masks_of_photo};
pub use network::{Answer, Network, PreparedPhoto, threads_for};
pub use prompt::{Frame, PhotoPoint, Prompt};
