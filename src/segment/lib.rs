//! Masks of single photos by a promptable segmentation network ([`Network`]), whose weights the user names.
//!
//! An encoder sees a photo once ([`Features`]); a decoder answers prompts ([`Prompt`]) with masks.

mod candidate;
mod features;
mod interface;
mod levels;
mod network;
mod prompt;

pub use candidate::Search;
pub use features::{FeatureCache, Features};
pub use levels::{Level, PhotoMasks, masks_of_photo};
pub use network::{Answer, Network, Prepared, threads_for};
pub use prompt::{Frame, Place, Prompt};
