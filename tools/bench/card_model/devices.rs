//! Figures of graphics cards and their sources. A change of the engine never changes this file.

use serde::Serialize;

/// A card, for prices of kernels. Cycles are of the multiprocessor clock.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Card {
    /// Name.
    pub name: &'static str,
    /// Streaming multiprocessors.
    pub multiprocessors: f64,
    /// Clock under load, Hz: the vendor's boost clock.
    pub clock: f64,
    /// Memory bandwidth, bytes a second.
    pub bandwidth: f64,
    /// Instructions of 32 lanes that a multiprocessor issues a cycle: one of each of its four schedulers, and no more
    /// than its lanes for float32 take.
    pub issue: f64,
    /// Lanes of `exp2`, reciprocals and roots that a multiprocessor takes a cycle.
    pub special: f64,
    /// Cycles until a value arrives from a multiprocessor's own cache.
    pub near_cycles: f64,
    /// Cycles until a value arrives from shared memory.
    pub shared_cycles: f64,
    /// Cycles until a value arrives from the cache that all multiprocessors share.
    pub far_cycles: f64,
    /// Cycles until a value arrives from memory.
    pub memory_cycles: f64,
    /// Bytes a second from the host to the card.
    pub link: f64,
}

// Multiprocessors, clocks, lanes and bandwidths: NVIDIA, "Ada GPU Architecture" (RTX 4090: 128 multiprocessors,
// 2.52 GHz boost, 128 lanes of float32 each, 1008 GB/s) and "A100 Tensor Core GPU Architecture" (A100 40 GB: 108
// multiprocessors, 1.41 GHz boost, 64 lanes each, 1555 GB/s). Special functions: NVIDIA, "CUDA C++ Programming Guide",
// table of arithmetic throughput: 16 results a cycle of a multiprocessor for both. Cycles of the caches and of memory:
// Luo et al., "Benchmarking and Dissecting the Nvidia Hopper GPU Architecture via Microbenchmarking" (arXiv
// 2402.13499), table of latencies, which has both cards. Link: PCI Express 4.0 x16, 31.5 GB/s by its standard.

/// NVIDIA RTX 4090.
pub const RTX_4090: Card = Card {
    name: "RTX 4090",
    multiprocessors: 128.0,
    clock: 2.52e9,
    bandwidth: 1008e9,
    issue: 4.0,
    special: 16.0,
    near_cycles: 43.0,
    shared_cycles: 30.0,
    far_cycles: 273.0,
    memory_cycles: 541.0,
    link: 31.5e9,
};

/// NVIDIA A100, 40 GB.
pub const A100: Card = Card {
    name: "A100 40 GB",
    multiprocessors: 108.0,
    clock: 1.41e9,
    bandwidth: 1555e9,
    issue: 2.0,
    special: 16.0,
    near_cycles: 38.0,
    shared_cycles: 29.0,
    far_cycles: 262.0,
    memory_cycles: 466.0,
    link: 31.5e9,
};

/// Schedulers of a multiprocessor; a warp stays with one of them.
pub const SCHEDULERS: f64 = 4.0;

/// Share of each peak rate that a kernel reaches, the same for every kernel, rate and card. A plain copy reaches 0.9 of
/// the bandwidth; a kernel whose warps wait for each other, for caches and for the last workgroup reaches less. No
/// kernel of the engine is assumed to be better than another.
pub const EFFICIENCY: f64 = 0.75;

/// Seconds from the end of a kernel to the start of the next in a recorded list: NVIDIA, "Getting Started with CUDA
/// Graphs": 3.4 us a kernel in a graph of kernels that run one after another, of which the kernel itself takes 2.9 us.
pub const DISPATCH: f64 = 0.5e-6;

/// Seconds that a host with Python and PyTorch needs for one operator: the middle of the 5 to 25 us from the statement to
/// the launched kernel that J. Huang, "From PyTorch op to kernel launch", counts layer by layer.
pub const OPERATOR: f64 = 15e-6;

impl Card {
    /// Seconds of a barrier besides the next start: the last stores leave for memory, the first loads come back.
    pub fn barrier(&self) -> f64 {
        2.0 * self.memory_cycles / self.clock
    }

    /// Instructions of 32 lanes a second, at best.
    pub fn instructions(&self) -> f64 {
        self.multiprocessors * self.issue * self.clock
    }

    /// Special functions of 32 lanes a second, at best.
    pub fn specials(&self) -> f64 {
        self.multiprocessors * self.special / 32.0 * self.clock
    }
}
