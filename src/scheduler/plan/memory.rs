//! Sizes of buffers, and memory of pass lists, predicted before anything is allocated.

use super::Limits;
use super::buffers::{BufferDecl, Class, Table};
use super::pass::PassList;
use super::{GUARD_BYTES, Plan, PlanOptions};
use crate::error::{Error, Result};
use crate::gpu::MemoryKind;

/// Bytes of the staging memory for transfers to and from device memory: one half for each direction.
pub(crate) const STAGING_BYTES: u64 = 8 << 20;

/// Bytes of one copy of each buffer of a table, for at least one element.
pub(super) fn sizes(table: &'static Table, counts: &[u64]) -> Result<Vec<u64>> {
    table.iter().map(|decl| bytes_of(decl, counts)).collect()
}

/// Bytes of one copy of a buffer, for at least one element: Vulkan has no empty buffers.
pub(crate) fn bytes_of(decl: &BufferDecl, counts: &[u64]) -> Result<u64> {
    if decl.element_bytes == 0 || !decl.element_bytes.is_multiple_of(4) {
        let (name, bytes) = (decl.name, decl.element_bytes);
        return Err(Error::Bug(format!("elements of buffer {name} have {bytes} bytes; expected a multiple of 4")));
    }
    let count = decl.count(counts)?.max(1);
    count.checked_mul(u64::from(decl.element_bytes)).filter(|&bytes| bytes < 1 << 62).ok_or_else(|| {
        Error::OutOfMemory {
            what: decl.name.to_owned(),
            needed: u64::MAX,
            limit_name: "the address space".to_owned(),
            limit: 1 << 62,
            cure: (decl.domain.cure)((1 << 62) / u64::from(decl.element_bytes)),
        }
    })
}

/// Returns the memory kind of a buffer's copy. Copies after the frames' copies are staging.
pub(crate) fn kind(class: Class, copy: usize, limits: &Limits) -> MemoryKind {
    match class {
        Class::Model | Class::Persistent | Class::Step => MemoryKind::Device,
        Class::PerFrame if limits.stages && copy < limits.frames => MemoryKind::Device,
        Class::PerFrame => MemoryKind::Upload,
        Class::Report => MemoryKind::Download,
    }
}

/// Bytes allocated for one copy of a buffer with its own memory.
pub(crate) fn allocated_bytes(bytes: u64, options: PlanOptions, alignment: u64) -> u64 {
    (bytes + if options.guards { GUARD_BYTES } else { 0 }).next_multiple_of(alignment)
}

/// Bytes allocated for one copy of a buffer with its own memory; 0 if it has no elements, so that unused features cost
/// no memory. No list may bind a buffer of 0 bytes.
pub(crate) fn own_bytes(decl: &BufferDecl, counts: &[u64], options: PlanOptions, alignment: u64) -> Result<u64> {
    let bytes = bytes_of(decl, counts)?;
    Ok(if decl.count(counts)? == 0 { 0 } else { allocated_bytes(bytes, options, alignment) })
}

/// One buffer of a [`MemoryReport`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MemoryRow {
    /// Name of the buffer.
    pub name: &'static str,
    /// Its class.
    pub class: Class,
    /// Number of elements.
    pub count: u64,
    /// Bytes per element.
    pub element_bytes: u32,
    /// Bytes of all copies; for Step buffers the size without aliasing.
    pub bytes: u64,
}

/// Memory use of the engine.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MemoryReport {
    /// Every used buffer, in the order of the table.
    pub rows: Vec<MemoryRow>,
    /// Bytes of each page of the Step arena. Lists share the pages, so each has the size of the largest list.
    pub step_pages: Vec<u64>,
    /// Bytes of the Step buffers without aliasing, for the list that needs the most.
    pub step_unaliased: u64,
    /// Bytes of staging memory.
    pub staging: u64,
    /// Total bytes.
    pub total: u64,
}

impl MemoryReport {
    /// Predicts the memory of lists. If a buffer or the total does not fit, the error suggests a cure.
    pub fn predict(
        table: &'static Table,
        counts: &[u64],
        lists: &[PassList],
        limits: &Limits,
        options: PlanOptions,
    ) -> Result<Self> {
        let plans =
            lists.iter().map(|list| Plan::new(table, counts, list, limits, options)).collect::<Result<Vec<_>>>()?;
        Self::from_plans(table, counts, &plans.iter().collect::<Vec<_>>(), limits, options)
    }

    /// Returns the memory of existing plans.
    pub fn from_plans(
        table: &'static Table,
        counts: &[u64],
        plans: &[&Plan],
        limits: &Limits,
        options: PlanOptions,
    ) -> Result<Self> {
        let mut rows = Vec::new();
        let mut total = STAGING_BYTES;
        for (index, decl) in table.iter().enumerate() {
            let one = if decl.class == Class::Step {
                allocated_bytes(bytes_of(decl, counts)?, options, limits.alignment())
            } else {
                own_bytes(decl, counts, options, limits.alignment())?
            };
            let bytes = one * decl.class.copies(limits) as u64;
            let count = decl.count(counts)?;
            let shown = count > 0 || !decl.domain.is_optional;
            let used = decl.class != Class::Step || plans.iter().any(|plan| plan.placements[index].is_some());
            if decl.class != Class::Step {
                total = total.saturating_add(bytes);
            }
            if used && shown {
                let (name, class, element_bytes) = (decl.name, decl.class, decl.element_bytes);
                rows.push(MemoryRow { name, class, count, element_bytes, bytes });
            }
        }
        let step_pages = merge_pages(plans.iter().map(|plan| plan.step_pages.as_slice()));
        let total = step_pages.iter().fold(total, |sum, bytes| sum.saturating_add(*bytes));
        let step_unaliased = plans.iter().map(|plan| unaliased(plan)).max().unwrap_or(0);
        let report = Self { rows, step_pages, step_unaliased, staging: STAGING_BYTES, total };
        check_total(table, "the whole engine", report.total, limits)?;
        Ok(report)
    }
}

/// Fails if the total exceeds the memory that the engine may use; the error suggests a cure.
pub(crate) fn check_total(table: &Table, what: &str, needed: u64, limits: &Limits) -> Result<()> {
    if needed <= limits.max_memory {
        return Ok(());
    }
    Err(Error::OutOfMemory {
        what: what.to_owned(),
        needed,
        limit_name: "the memory of this device that may be used".to_owned(),
        limit: limits.max_memory,
        cure: (table.cure)(),
    })
}

fn unaliased(plan: &Plan) -> u64 {
    let step = plan.table.iter().zip(&plan.placements).filter(|(decl, _)| decl.class == Class::Step);
    step.filter_map(|(_, place)| place.map(|place| place.bound)).sum()
}

/// Returns page sizes that fit each of several arenas.
pub(crate) fn merge_pages<'a>(arenas: impl Iterator<Item = &'a [u64]>) -> Vec<u64> {
    let mut merged: Vec<u64> = Vec::new();
    for pages in arenas {
        merged.resize(merged.len().max(pages.len()), 0);
        for (most, bytes) in merged.iter_mut().zip(pages) {
            *most = (*most).max(*bytes);
        }
    }
    merged
}
