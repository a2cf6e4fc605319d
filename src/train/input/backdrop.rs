//! The background of a step.

use super::sampler::stream;
use crate::scene::Photo;
use crate::train::TrainConfig;
use rand::Rng;
use std::borrow::Cow;

/// First random stream for colours; the step is added.
const COLOUR_STREAM: u64 = 5 << 32;

/// Returns the background colour of a step: r, g, b, 0 to 1.
pub(in crate::train) fn colour(config: &TrainConfig, step: u32) -> [f32; 3] {
    if !config.random_background {
        return config.background;
    }
    let mut random = stream(config.seed, COLOUR_STREAM + u64::from(step));
    [(); 3].map(|()| random.random_range(0.0..1.0))
}

/// Returns the photo over that colour, as the loss compares it.
pub(in crate::train) fn photo<'a>(photo: &'a Photo, config: &TrainConfig, step: u32) -> Cow<'a, [[u8; 4]]> {
    // Photos keep their opacity only with random colours.
    let over = config.random_background.then(|| photo.over(colour(config, step))).flatten();
    over.map_or(Cow::Borrowed(&photo.rgba), Cow::Owned)
}
