//! Limits of a device that decide sizes.

use crate::error::{Error, Result};
use crate::lab;

/// Limits of a device that a plan must respect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PlanLimits {
    /// Largest storage buffer binding, in bytes.
    pub max_storage_range: u64,
    /// Largest texel buffer view, in texels.
    pub max_texel_elements: u64,
    /// Alignment of storage bindings, in bytes.
    pub storage_alignment: u64,
    /// Alignment of texel views, in bytes.
    pub texel_alignment: u64,
    /// Workgroups per axis of a dispatch.
    pub max_groups: [u32; 3],
    /// Largest memory allocation (and buffer), in bytes.
    pub max_allocation: u64,
    /// Storage buffers of one shader.
    pub max_storage_buffers: u32,
    /// Texel buffers of one shader.
    pub max_texel_buffers: u32,
    /// Memory that the engine may use in all, in bytes: part of what the driver says is free, or of the heap.
    pub max_memory: u64,
}

impl Default for PlanLimits {
    /// Modest limits that any device the engine runs on is likely to reach, without a bound on all memory.
    fn default() -> Self {
        Self {
            max_storage_range: 128 << 20,
            max_texel_elements: 128 << 20,
            storage_alignment: 256,
            texel_alignment: 256,
            max_groups: [65_535; 3],
            max_allocation: 1 << 30,
            max_storage_buffers: 32,
            max_texel_buffers: 32,
            max_memory: u64::MAX,
        }
    }
}

impl PlanLimits {
    /// Alignment of every buffer in a page: fit for storage bindings, texel views and cache lines.
    pub fn alignment(&self) -> u64 {
        self.storage_alignment.max(self.texel_alignment).max(64)
    }
}

/// What a device can hold and run at most.
#[derive(Clone, Debug, PartialEq)]
pub struct Limits {
    /// What plans respect.
    pub plan: PlanLimits,
    /// Invocations per axis of a workgroup.
    pub max_group_size: [u32; 3],
    /// Invocations of a workgroup.
    pub max_invocations: u32,
    /// Bytes of shared memory of a workgroup.
    pub max_shared: u32,
    /// Size of the device's largest own heap, in bytes.
    pub heap: u64,
    /// Nanoseconds of one timestamp tick; 0 if compute queues have no timestamps.
    pub timestamp_period: f32,
    /// Bits of a timestamp that count.
    pub timestamp_bits: u32,
}

impl Limits {
    /// Lowers limits to what `LABELGS_LIMIT_SSBO`, `_TEXELS`, `_ALLOCATION` and `_MEMORY` say (numbers with K, M or G),
    /// so that tests try out a small device on a large one.
    pub(super) fn lower_by_env(&mut self) -> Result<()> {
        for (name, limit) in [
            ("LABELGS_LIMIT_SSBO", &mut self.plan.max_storage_range),
            ("LABELGS_LIMIT_TEXELS", &mut self.plan.max_texel_elements),
            ("LABELGS_LIMIT_ALLOCATION", &mut self.plan.max_allocation),
            ("LABELGS_LIMIT_MEMORY", &mut self.plan.max_memory),
        ] {
            if let Some(text) = lab::var(name) {
                let problem = || Error::usage(name, format!("{text} is no size; a number with K, M or G is expected"));
                *limit = (*limit).min(parse_size(&text).ok_or_else(problem)?);
            }
        }
        Ok(())
    }
}

/// A number with an optional binary unit.
fn parse_size(text: &str) -> Option<u64> {
    let (digits, shift) = match text.strip_suffix(['K', 'k']) {
        Some(digits) => (digits, 10),
        None => match text.strip_suffix(['M', 'm']) {
            Some(digits) => (digits, 20),
            None => text.strip_suffix(['G', 'g']).map_or((text, 0), |digits| (digits, 30)),
        },
    };
    digits.parse::<u64>().ok()?.checked_mul(1 << shift)
}

#[cfg(test)]
mod tests {
    use super::parse_size;

    #[test]
    fn sizes_have_binary_units() {
        assert_eq!(parse_size("17"), Some(17));
        assert_eq!(parse_size("4K"), Some(4096));
        assert_eq!(parse_size("1m"), Some(1 << 20));
        assert_eq!(parse_size("3G"), Some(3 << 30));
        for wrong in ["", "M", "-1", "1.5M", "1T", "99999999999999G"] {
            assert_eq!(parse_size(wrong), None, "{wrong}");
        }
    }
}
