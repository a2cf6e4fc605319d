//! Limits of a device that affect sizes.

use crate::error::{Error, Result};
use crate::lab;
use crate::shaders::{self, ShaderDesc};

/// Device limits that a plan must respect.
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
    /// Maximum number of storage buffers per shader.
    pub max_storage_buffers: u32,
    /// Number of storage bindings that all buffers of a shader share (`plan::windows`), on a device with too few
    /// bindings; 0 if each buffer has its own.
    pub windows: u32,
    /// Maximum number of texel buffers per shader.
    pub max_texel_buffers: u32,
    /// Memory that the engine may use in total, in bytes: a share of the driver's free memory, or of the heap.
    pub max_memory: u64,
    /// Most steps in flight, and number of copies of the buffers that the host shares with them.
    pub frames: usize,
    /// Step data go through staging to device-local memory.
    pub stages: bool,
    /// The host works ahead of the device: it compiles kernels before they are needed, and reads checkpoints from a
    /// copy on the device. On a CPU device, both would slow down the steps.
    pub runs_ahead: bool,
}

/// Alignment of buffers that share bindings: the largest block of the shaders has 352 bytes. It is a power of 2, like
/// all Vulkan alignments.
const PACKED_ALIGNMENT: u64 = 512;

/// Most buffers per shader that can share bindings: their offsets fill a slot of [`PACKED_SLOT`] bytes.
const PACKED_MAX: u32 = PACKED_SLOT / 4;

/// Bytes between the buffer offsets of two passes; a multiple of any uniform buffer alignment.
pub(crate) const PACKED_SLOT: u32 = 256;

/// Most storage buffers among the shaders that every device needs. Optional shaders have replacements (`KernelShape`).
fn own_bindings() -> u32 {
    const REPLACEABLE: [&str; 6] =
        ["update", "catch_up", "project_visible", "emit_ordered", "group_forward", "group_backward"];
    let is_needed = |shader: &&&ShaderDesc| {
        !REPLACEABLE.iter().any(|stem| shader.stem.starts_with(stem)) && !shader.macros.contains(&"LAZY")
    };
    shaders::ALL.iter().filter(is_needed).map(|shader| shader.storage_buffers()).max().unwrap_or(0)
}

impl Default for PlanLimits {
    /// Conservative limits that every suitable device is likely to meet, without a memory limit.
    fn default() -> Self {
        Self {
            max_storage_range: 128 << 20,
            max_texel_elements: 128 << 20,
            storage_alignment: 256,
            texel_alignment: 256,
            max_groups: [65_535; 3],
            max_allocation: 1 << 30,
            max_storage_buffers: 32,
            windows: 0,
            max_texel_buffers: 32,
            max_memory: u64::MAX,
            frames: 2,
            stages: false,
            runs_ahead: false,
        }
    }
}

impl PlanLimits {
    /// Adapts the limits to a GPU: more steps in flight, with step data in device-local memory.
    pub(crate) fn for_gpu(self) -> Self {
        Self { frames: 4, stages: true, runs_ahead: true, ..self }
    }

    /// Most bytes of photos and masks that stay in device memory beside an engine of the given size: half of the
    /// remaining memory, so that the model can grow.
    pub(crate) fn kept_max(&self, engine: u64) -> u64 {
        if self.stages { self.max_memory.saturating_sub(engine) / 2 } else { 0 }
    }

    /// Lets buffers share bindings if the device has too few. Step data then go through staging, because host-written
    /// buffers would need a binding of their own.
    #[must_use]
    pub fn packed(self) -> Self {
        if self.is_packed() || self.max_storage_buffers >= own_bindings() {
            return self;
        }
        Self { windows: self.max_storage_buffers, max_storage_buffers: PACKED_MAX, stages: true, ..self }
    }

    /// True if the buffers of a shader share bindings.
    pub fn is_packed(&self) -> bool {
        self.windows > 0
    }

    /// Alignment of every buffer in a page, for storage bindings, texel views and cache lines. Buffers that share a
    /// binding must start at a multiple of their element size, so the alignment is a multiple of the largest element.
    pub fn alignment(&self) -> u64 {
        let least = if self.is_packed() { PACKED_ALIGNMENT } else { 64 };
        self.storage_alignment.max(self.texel_alignment).max(least)
    }
}

/// Limits of a device.
#[derive(Clone, Debug, PartialEq)]
pub struct Limits {
    /// Limits that plans respect.
    pub plan: PlanLimits,
    /// Invocations per axis of a workgroup.
    pub max_group_size: [u32; 3],
    /// Maximum invocations per workgroup.
    pub max_invocations: u32,
    /// Bytes of shared memory per workgroup.
    pub max_shared: u32,
    /// Size of the largest device-local heap, in bytes.
    pub heap: u64,
    /// Nanoseconds per timestamp tick; 0 if compute queues have no timestamps.
    pub timestamp_period: f32,
    /// Number of valid bits in a timestamp.
    pub timestamp_bits: u32,
}

impl Limits {
    /// Lowers limits to the values of `LABELGS_LIMIT_SSBO`, `_TEXELS`, `_ALLOCATION` and `_MEMORY` (numbers with K, M
    /// or G), and `_BUFFERS` (storage buffers per shader), so that tests can simulate a small device. Also reads the
    /// number of steps in flight from `LABELGS_FRAMES`, whether step data are staged from `LABELGS_PHOTOS` (`upload` or
    /// `resident`), and whether the host works ahead from `LABELGS_AHEAD` (`no` or `yes`).
    pub(super) fn change_from_env(&mut self) -> Result<()> {
        for (name, limit) in [
            ("LABELGS_LIMIT_SSBO", &mut self.plan.max_storage_range),
            ("LABELGS_LIMIT_TEXELS", &mut self.plan.max_texel_elements),
            ("LABELGS_LIMIT_ALLOCATION", &mut self.plan.max_allocation),
            ("LABELGS_LIMIT_MEMORY", &mut self.plan.max_memory),
        ] {
            if let Some(text) = lab::var(name) {
                let problem = || Error::usage(name, format!("{text} is not a size; expected a number with K, M or G"));
                *limit = (*limit).min(parse_size(&text).ok_or_else(problem)?);
            }
        }
        if let Some(text) = lab::var("LABELGS_LIMIT_BUFFERS") {
            let buffers = text.parse().ok().filter(|&buffers| buffers > 0);
            let buffers =
                buffers.ok_or_else(|| Error::usage("LABELGS_LIMIT_BUFFERS", "expected a number of storage buffers"))?;
            self.plan.max_storage_buffers = self.plan.max_storage_buffers.min(buffers);
        }
        if let Some(text) = lab::var("LABELGS_FRAMES") {
            let frames = text.parse().ok().filter(|frames| (1..=16).contains(frames));
            self.plan.frames =
                frames.ok_or_else(|| Error::usage("LABELGS_FRAMES", "expected a number from 1 to 16"))?;
        }
        if let Some(text) = lab::var("LABELGS_PHOTOS") {
            self.plan.stages = text == "resident";
        }
        if let Some(text) = lab::var("LABELGS_AHEAD") {
            self.plan.runs_ahead = text == "yes";
        }
        Ok(())
    }
}

/// Parses a number with an optional binary unit.
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
