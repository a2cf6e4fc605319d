//! Sizes of buffers, and the memory that pass lists need, predicted before anything is allocated.

use super::Limits;
use super::buffers::{BufferDecl, Class};
use super::capacity::{Capacity, Domain};
use super::pass::PassList;
use super::{GUARD_BYTES, Plan, PlanOptions};
use crate::error::{Error, Result};

/// Bytes of the staging memory through which the host reaches device memory: one half up, one half down.
pub(crate) const STAGING_BYTES: u64 = 8 << 20;

/// Elements and bytes of one copy of a buffer.
#[derive(Clone, Copy, Debug)]
pub(super) struct Size {
    /// Bytes; room for at least one element.
    pub(super) bytes: u64,
}

/// Sizes of all rows of a table.
pub(super) fn sizes(table: &'static [BufferDecl], capacity: &Capacity) -> Result<Vec<Size>> {
    table.iter().map(|decl| Ok(Size { bytes: bytes_of(decl, capacity)? })).collect()
}

/// Bytes of one copy of a buffer; room for at least one element, as Vulkan knows no empty buffers.
pub(crate) fn bytes_of(decl: &BufferDecl, capacity: &Capacity) -> Result<u64> {
    if decl.element_bytes == 0 || !decl.element_bytes.is_multiple_of(4) {
        let (name, bytes) = (decl.name, decl.element_bytes);
        return Err(Error::Bug(format!("elements of buffer {name} have {bytes} bytes, a multiple of 4 expected")));
    }
    let count = capacity.count(decl.domain).max(1);
    count.checked_mul(u64::from(decl.element_bytes)).filter(|&bytes| bytes < 1 << 62).ok_or_else(|| {
        Error::OutOfMemory {
            what: decl.name.to_owned(),
            needed: u64::MAX,
            limit_name: "the address space".to_owned(),
            limit: 1 << 62,
            cure: decl.domain.cure((1 << 62) / u64::from(decl.element_bytes)),
        }
    })
}

/// Bytes allocated for one copy of a buffer that has memory of its own.
pub(crate) fn allocated_bytes(bytes: u64, options: PlanOptions, alignment: u64) -> u64 {
    (bytes + if options.guards { GUARD_BYTES } else { 0 }).next_multiple_of(alignment)
}

/// Bytes allocated for one copy of a buffer with memory of its own; nothing where it has no elements, so that what a run
/// does not need costs nothing. No list may bind such a buffer.
pub(crate) fn own_bytes(decl: &BufferDecl, capacity: &Capacity, options: PlanOptions, alignment: u64) -> Result<u64> {
    let bytes = bytes_of(decl, capacity)?;
    Ok(if capacity.count(decl.domain) == 0 { 0 } else { allocated_bytes(bytes, options, alignment) })
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
    /// Bytes of one element.
    pub element_bytes: u32,
    /// Bytes of all copies; for Step buffers what they would take alone.
    pub bytes: u64,
}

/// The memory that the engine needs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MemoryReport {
    /// Every buffer that is used, in the order of the table.
    pub rows: Vec<MemoryRow>,
    /// Bytes of the pages of the Step arena: the largest of the lists, as they share it.
    pub step_pages: Vec<u64>,
    /// Bytes that Step buffers would take without aliasing, of the list that needs most.
    pub step_unaliased: u64,
    /// Bytes of staging memory.
    pub staging: u64,
    /// All bytes.
    pub total: u64,
}

impl MemoryReport {
    /// Predicts the memory of some lists; fails with a cure when a buffer or the sum does not fit.
    pub fn predict(
        table: &'static [BufferDecl],
        capacity: &Capacity,
        lists: &[PassList],
        limits: &Limits,
        options: PlanOptions,
    ) -> Result<Self> {
        let plans =
            lists.iter().map(|list| Plan::new(table, capacity, list, limits, options)).collect::<Result<Vec<_>>>()?;
        Self::of_plans(table, capacity, &plans.iter().collect::<Vec<_>>(), limits, options)
    }

    /// The memory of plans that are already made.
    pub fn of_plans(
        table: &'static [BufferDecl],
        capacity: &Capacity,
        plans: &[&Plan],
        limits: &Limits,
        options: PlanOptions,
    ) -> Result<Self> {
        let mut rows = Vec::new();
        let mut total = STAGING_BYTES;
        for (index, decl) in table.iter().enumerate() {
            let one = if decl.class == Class::Step {
                allocated_bytes(bytes_of(decl, capacity)?, options, limits.alignment())
            } else {
                own_bytes(decl, capacity, options, limits.alignment())?
            };
            let bytes = one * decl.class.copies();
            // Of what only users of the library add there is nothing to say where nobody did.
            let added = decl.domain != Domain::SharedRows || capacity.shared_rows > 0;
            let used = decl.class != Class::Step || plans.iter().any(|plan| plan.placements[index].is_some());
            if decl.class != Class::Step {
                total = total.saturating_add(bytes);
            }
            if used && added {
                let (name, class, element_bytes) = (decl.name, decl.class, decl.element_bytes);
                rows.push(MemoryRow { name, class, count: capacity.count(decl.domain), element_bytes, bytes });
            }
        }
        let step_pages = merge_pages(plans.iter().map(|plan| plan.step_pages.as_slice()));
        let total = step_pages.iter().fold(total, |sum, bytes| sum.saturating_add(*bytes));
        let step_unaliased = plans.iter().map(|plan| unaliased(plan)).max().unwrap_or(0);
        let report = Self { rows, step_pages, step_unaliased, staging: STAGING_BYTES, total };
        report.check(limits)?;
        Ok(report)
    }

    /// Fails if the sum does not fit.
    fn check(&self, limits: &Limits) -> Result<()> {
        if self.total <= limits.max_memory {
            return Ok(());
        }
        Err(Error::OutOfMemory {
            what: "the whole engine".to_owned(),
            needed: self.total,
            limit_name: "the memory of this device that may be used".to_owned(),
            limit: limits.max_memory,
            cure: "lower `max_gaussians`, use smaller images or use another device".to_owned(),
        })
    }
}

fn unaliased(plan: &Plan) -> u64 {
    let step = plan.table.iter().zip(&plan.placements).filter(|(decl, _)| decl.class == Class::Step);
    step.filter_map(|(_, place)| place.map(|place| place.bound)).sum()
}

/// Sizes of pages that hold every one of several arenas.
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
