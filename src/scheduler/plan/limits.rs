//! What a device can do, as plain numbers.

/// Limits of a device that a plan must respect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
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
    /// Memory that the engine may use in all, in bytes.
    pub max_memory: u64,
}

impl Default for Limits {
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

impl Limits {
    /// Alignment of every buffer in a page: fit for storage bindings, texel views and cache lines.
    pub fn alignment(&self) -> u64 {
        self.storage_alignment.max(self.texel_alignment).max(64)
    }
}
