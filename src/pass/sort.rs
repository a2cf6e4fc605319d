//! Stable radix sort of (key, value) pairs by the low bits of the key.

use super::KernelShape;
use super::build::{Builder, Count, ONE_GROUP};
use crate::pass::build::pass;
use crate::scheduler::plan::{Buf, Grid, Stage, Work};

/// Two pairs of buffers; the passes of a sort alternate between them.
#[derive(Clone, Copy, Debug)]
pub struct SortBuffers {
    /// Keys; the input is in the first buffer.
    pub keys: [Buf; 2],
    /// Values.
    pub values: [Buf; 2],
    /// True for 16-bit instead of 32-bit keys; only in look-back sorts.
    pub narrow: bool,
}

impl SortBuffers {
    /// Returns the buffers with keys and values after a sort by `bits` bits.
    pub fn sorted(self, shape: &KernelShape, bits: u32) -> (Buf, Buf) {
        let last = (passes(shape, bits) % 2) as usize;
        (self.keys[last], self.values[last])
    }

    /// Orders the pairs so that a sort by `bits` bits ends in the first pair of `self`; write its input to the first
    /// pair of the result.
    pub fn ending_in_first(self, shape: &KernelShape, bits: u32) -> Self {
        let Self { keys: [a, b], values: [c, d], .. } = self;
        if passes(shape, bits).is_multiple_of(2) { self } else { Self { keys: [b, a], values: [d, c], ..self } }
    }
}

/// Number of passes of a sort by `bits` bits.
fn passes(shape: &KernelShape, bits: u32) -> u32 {
    bits.div_ceil(shape.digit_bits).max(1)
}

/// Returns the digit bits of a look-back sort by `bits` bits: as few as its passes need, because fewer digits are
/// counted sooner, and more pairs of a workgroup move together.
pub fn digit_bits(shape: &KernelShape, bits: u32) -> u32 {
    bits.div_ceil(passes(shape, bits)).max(1)
}

/// Sorts by the low `bits` bits. With `identity`, the values are the positions of the keys before the sort. `by` is
/// appended to the pass titles. Returns the buffers with the sorted keys and values. In look-back sorts, the pass that
/// writes the keys must count their digits (glsl/include/digit_counts.glsl).
pub fn sort(b: &mut Builder, buffers: SortBuffers, bits: u32, count: Count, by: &str, identity: bool) -> (Buf, Buf) {
    let (first, around) = (b.list.work.len(), std::mem::replace(&mut b.list.stage, Stage::SORT));
    let lanes = b.capacity.sort_lanes as u32;
    let workgroups = lanes / b.shape.subgroup;
    let groups = Grid::Groups(workgroups, 1, 1);
    let passes = passes(b.shape, bits);
    let digit_bits = if b.shape.sweeps() { digit_bits(b.shape, bits) } else { b.shape.digit_bits };
    for pass in 0..passes {
        let (from, to) = ((pass % 2) as usize, 1 - (pass % 2) as usize);
        let shift = pass * digit_bits;
        // The first pass of an identity sort reads no values; the keys replace the unwritten values buffer.
        let identity_now = identity && pass == 0;
        let values_in = if identity_now { buffers.keys[from] } else { buffers.values[from] };
        if b.shape.sweeps() {
            pass!(b, radix_sweep(narrow: buffers.narrow) { keys_in: buffers.keys[from], values_in: values_in, keys_out: buffers.keys[to], values_out: buffers.values[to] } [count_source: count as u32, shift: shift, sort_pass: b.sort_passes, digit_bits: digit_bits,
                identity: u32::from(identity_now)], count.partitions());
            b.sort_passes += 1;
            continue;
        }
        // The last digit covers only the remaining bits: its tables and their scan by one subgroup are smaller.
        let digit_bits = digit_bits.min(bits.max(1) - shift);
        pass!(b, radix_count { keys_in: buffers.keys[from], histogram: Buf::SORT_HISTOGRAM, totals: Buf::SORT_TOTALS } [count_source: count as u32, lanes: lanes, shift: shift, digit_bits: digit_bits], groups);
        pass!(b, radix_scan { totals: Buf::SORT_TOTALS } [cells: workgroups << digit_bits], ONE_GROUP);
        pass!(b, radix_scatter { keys_in: buffers.keys[from], values_in: values_in, histogram: Buf::SORT_HISTOGRAM, totals: Buf::SORT_TOTALS, keys_out: buffers.keys[to], values_out: buffers.values[to] } [count_source: count as u32, lanes: lanes, shift: shift, digit_bits: digit_bits,
            identity: u32::from(identity_now)], groups);
    }
    b.list.stage = around;
    for work in &mut b.list.work[first..] {
        if let Work::Pass(pass) = work {
            pass.title = format!("{} {by}", pass.title);
        }
    }
    buffers.sorted(b.shape, bits)
}
