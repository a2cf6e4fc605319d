//! Predicts the memory use on a device that is not present.

use super::growth::vote_capacity;
use super::{Engine, EngineSize, capacity};
use crate::error::Result;
use crate::gpu::limits::PlanLimits;
use crate::pass::buffers::TABLE;
use crate::pass::{GroupBlend, KernelShape, Update};
use crate::scheduler::plan::{MemoryReport, PlanOptions};

/// Share of a GPU's memory that a plan counts, percent: the engine uses 90 % of the memory that the driver reports as
/// free (`gpu/probe.rs`), and a desktop leaves some 95 % of it free.
const PLANNED_PERCENT: u64 = 85;

/// Returns kernels and limits of a typical GPU with `memory` bytes: subgroups of 32, bindings and allocations of up to
/// 4 GiB.
pub(crate) fn card(memory: u64) -> (KernelShape, PlanLimits) {
    const BINDING_BYTES_MAX: u64 = u32::MAX as u64 & !0xffff;
    let limits = PlanLimits {
        max_storage_range: BINDING_BYTES_MAX,
        max_allocation: BINDING_BYTES_MAX,
        max_memory: memory / 100 * PLANNED_PERCENT,
        ..PlanLimits::default()
    };
    // GPUs bind far more buffers than the default limits allow.
    let limits = PlanLimits { max_storage_buffers: 1 << 20, ..limits };
    let own = KernelShape::new(32, false);
    let shape = KernelShape { loss_tile: 16, narrow_labels: true, narrow_keys: true, ..own };
    let shape = KernelShape { group_walks: true, update: Update::Lazy, ..shape };
    (shape.with_sweeps_of(KernelShape::SWEEP_ITEMS).with_group_blend_of(GroupBlend::DEFAULT), limits.for_gpu())
}

/// Predicts the memory of an engine of this size on a device with these kernels and limits.
///
/// # Errors
///
/// A buffer or the total exceeds the limits.
pub(crate) fn predict_for(shape: &KernelShape, limits: &PlanLimits, size: &EngineSize) -> Result<MemoryReport> {
    let size = &size.in_bands(shape);
    let capacity = capacity(shape, size);
    let lists = Engine::lists_of(shape, &capacity, size);
    let steps = MemoryReport::predict(TABLE, &capacity.counts(), &lists, limits, PlanOptions::default())?;
    let votes = predict_votes(shape, limits, size)?.filter(|votes| votes.total > steps.total);
    Ok(votes.unwrap_or(steps))
}

/// Predicts the memory of a training while it counts votes; `None` if counting needs no other memory than steps.
pub(crate) fn predict_votes(
    shape: &KernelShape,
    limits: &PlanLimits,
    size: &EngineSize,
) -> Result<Option<MemoryReport>> {
    let size = &size.in_bands(shape);
    let Some((counting, list)) = vote_capacity(shape, &capacity(shape, size), size) else { return Ok(None) };
    MemoryReport::predict(TABLE, &counting.counts(), &[list], limits, PlanOptions::default()).map(Some)
}
