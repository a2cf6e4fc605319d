//! Estimates number, size and training time of the blocks of a planned scene.

use super::need::{BlockNeed, BlockSize, CommonNeed, TargetGpu};
use super::plan::BLOCKS_MAX;
use crate::error::{Error, Result, Setting};

/// Gaussians in a block's zone per Gaussian in its core: a margin of a tenth on all four sides.
const ZONE_PER_CORE_GAUSSIANS: f64 = 1.44;
/// Sum of the blocks' views per view of the scene: photos at a border belong to the blocks on both sides.
const BLOCK_VIEWS_PER_SCENE_VIEW: f64 = 2.0;

/// A scene that may not exist yet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlannedScene {
    /// GPU memory, bytes.
    pub card: u64,
    /// Gaussians of the whole scene.
    pub gaussians: u64,
    /// Gaussians of its coarse model.
    pub coarse: u64,
    /// Number of photos.
    pub views: u64,
    /// Size of a photo, px.
    pub image: (u32, u32),
    /// Largest label; `None` without labels.
    pub max_label: Option<u32>,
    /// Steps of a block with up to 300 views.
    pub steps: u32,
    /// Measured step time, s, and the number of Gaussians it was measured with, at this photo size.
    pub pace: Option<(f64, u64)>,
}

/// The blocks of a planned scene, all of equal size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// Number of blocks.
    pub blocks: usize,
    /// Gaussians that each block trains.
    pub gaussians: u64,
    /// Frozen Gaussians of the surroundings.
    pub frozen: u64,
    /// Views per block.
    pub views: u64,
    /// Resources that each block needs.
    pub need: BlockNeed,
}

/// Divides a planned scene into the fewest equal blocks that fit the GPU. A block's photos are assumed to show half of
/// the coarse Gaussians outside of it, but at most those of three neighbours.
///
/// # Errors
///
/// The GPU is too small for any number of blocks.
pub fn estimate(sketch: &PlannedScene) -> Result<Estimate> {
    let card = TargetGpu::new(sketch.card);
    let pixels = u64::from(sketch.image.0) * u64::from(sketch.image.1);
    let measured = sketch.pace.map_or(sketch.gaussians, |(_, gaussians)| gaussians);
    let common = CommonNeed {
        image: sketch.image,
        max_label: sketch.max_label,
        pace: sketch.pace.map(|(seconds, _)| seconds),
        coarse: (pixels, measured),
    };
    for blocks in 1..=BLOCKS_MAX {
        let share = 1.0 / blocks as f64;
        let zone = if blocks == 1 { 1.0 } else { (ZONE_PER_CORE_GAUSSIANS * share).min(1.0) };
        let gaussians = (sketch.gaussians as f64 * zone).round() as u64;
        let outside = (0.5 * (1.0 - zone)).min(3.0 * share);
        let frozen = (sketch.coarse as f64 * outside).round() as u64;
        let shared = if blocks == 1 { 1.0 } else { BLOCK_VIEWS_PER_SCENE_VIEW };
        let views = ((sketch.views as f64 * shared * share).ceil() as u64).min(sketch.views);
        let need = common.need(&card, BlockSize { gaussians, frozen, views: views as usize }, sketch.steps)?;
        if card.fits(&need) {
            return Ok(Estimate { blocks, gaussians, frozen, views, need });
        }
    }
    Err(Error::usage(
        Setting("card"),
        format!("is {} bytes, too small for {BLOCKS_MAX} blocks of this scene", sketch.card),
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    const CITY: PlannedScene = PlannedScene {
        card: 24 << 30,
        gaussians: 100_000_000,
        coarse: 10_000_000,
        views: 5000,
        image: (1600, 1064),
        max_label: Some(500),
        steps: 30_000,
        pace: Some((0.02, 1_000_000)),
    };

    #[test]
    fn a_larger_card_takes_fewer_blocks() {
        let of = |card: u64| estimate(&PlannedScene { card: card << 30, ..CITY }).expect("blocks");
        let [small, usual, large] = [12, 24, 80].map(of);
        assert!(small.blocks > usual.blocks && usual.blocks > large.blocks, "{small:?} {usual:?} {large:?}");
        for found in [small, usual, large] {
            assert!(found.gaussians * found.blocks as u64 >= CITY.gaussians, "{found:?}");
            assert!(found.views * found.blocks as u64 >= CITY.views && found.need.minutes.is_some(), "{found:?}");
        }
        // One block fewer would not fit.
        assert!(usual.need.device as f64 <= 0.8 * f64::from(24 << 20) * 1024.0, "{usual:?}");
    }

    #[test]
    fn a_small_scene_is_one_block_and_a_tiny_card_none() {
        let one = estimate(&PlannedScene { gaussians: 1_000_000, ..CITY }).expect("a block");
        assert_eq!((one.blocks, one.frozen, one.views), (1, 0, 5000));
        assert!(estimate(&PlannedScene { card: 1 << 20, ..CITY }).is_err());
    }
}
