//! Predicts the memory and time that a block needs.

use crate::engine::{EngineSize, LabelSize, card, predict_for};
use crate::error::{Error, Result};
use crate::gpu::limits::PlanLimits;
use crate::pass::KernelShape;

/// Largest share of the GPU memory that a plan may use. Crowded views need more (splat, tile) pairs than planned.
const PLANNED_MEMORY_SHARE_MAX: f64 = 0.8;
/// Views up to which a block has the given number of steps. Blocks with more views have proportionally more steps.
const VIEWS_PER_RUN: f64 = 300.0;
/// Host memory of the program and driver, bytes (measured: 236 MiB with a small block on lavapipe).
const PROGRAM_BYTES: u64 = 256 << 20;
/// Objects per step with object layers.
const LAYERS_PER_STEP: u32 = 10;

/// The GPU that trains the blocks.
#[derive(Clone, Debug)]
pub(super) struct TargetGpu {
    shape: KernelShape,
    limits: PlanLimits,
    /// Memory, bytes.
    memory: u64,
}

/// Inputs of the prediction that all blocks share.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct CommonNeed {
    /// Largest photo, px.
    pub image: (u32, u32),
    /// Largest label; `None` for a scene without labels.
    pub max_label: Option<u32>,
    /// Seconds per step of the coarse run.
    pub pace: Option<f64>,
    /// Pixels per photo and Gaussians of the coarse run.
    pub coarse: (u64, u64),
}

/// What a block needs.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BlockNeed {
    /// Device memory, bytes.
    pub device: u64,
    /// Host memory, bytes.
    pub host: u64,
    /// Number of steps.
    pub steps: u32,
    /// Training time in minutes, if the pace is known.
    pub minutes: Option<f64>,
}

impl TargetGpu {
    /// Assumes a typical GPU with this much memory.
    pub(super) fn new(memory: u64) -> Self {
        let (shape, limits) = card(memory);
        Self { shape, limits, memory }
    }

    pub(super) fn fits(&self, need: &BlockNeed) -> bool {
        need.device as f64 <= PLANNED_MEMORY_SHARE_MAX * self.memory as f64
    }
}

/// The contents of a block.
#[derive(Clone, Copy, Debug)]
pub(super) struct BlockSize {
    /// Gaussians after growth, without frozen ones.
    pub gaussians: u64,
    /// Frozen Gaussians.
    pub frozen: u64,
    /// Number of views.
    pub views: usize,
}

impl CommonNeed {
    /// Predicts the need of a block. `steps` are the steps of a run with few views.
    pub(super) fn need(&self, card: &TargetGpu, block: BlockSize, steps: u32) -> Result<BlockNeed> {
        let BlockSize { gaussians, frozen, views } = block;
        let all = gaussians + frozen;
        let labels = self.max_label.map(|max_label| LabelSize {
            max_label,
            layers: LAYERS_PER_STEP,
            vote_columns: max_label + 1,
        });
        let frozen = u32::try_from(frozen).unwrap_or(u32::MAX);
        let size = EngineSize::new(all, self.image).for_training().with_labels(labels).with_frozen(frozen);
        let device = match predict_for(&card.shape, &card.limits, &size) {
            // A buffer exceeds the largest binding.
            Err(Error::OutOfMemory { .. }) => u64::MAX,
            other => other?.total,
        };
        let steps = (f64::from(steps) * (views as f64 / VIEWS_PER_RUN).max(1.0)).round() as u32;
        let pixels = u64::from(self.image.0) * u64::from(self.image.1);
        let larger = (pixels as f64 / self.coarse.0.max(1) as f64).max(all as f64 / self.coarse.1.max(1) as f64);
        let minutes = self.pace.map(|seconds| f64::from(steps) * (seconds * larger.max(1.0)) / 60.0);
        // A photo takes 4 bytes per pixel, a mask 2. Checkpoints are written from a copy.
        let host = PROGRAM_BYTES + (views as u64 * pixels * 6).min(crate::scenes::PHOTO_MEMORY) + 800 * gaussians;
        Ok(BlockNeed { device, host, steps, minutes })
    }
}
