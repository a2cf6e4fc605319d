#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
// find_nonfinite — find the first row of a plane with a NaN or infinity.
// Work:    64 invocations per workgroup, FINITE_GROUPS workgroups; each takes every such word.
// Reads:   step; plane [rows, ROW_WORDS] as words
// Writes:  nonfinite_rows [PLANE], the lowest row (integer minimum, any order); unchanged if all are finite
// Mirror:  src/reference/finite.rs::first_nonfinite

layout(local_size_x = 64) in;
READ1(0, StepUniforms, step);
READ(1, uint, plane);
INOUT(2, uint, nonfinite_rows);

void main() {
    uint rows = ROWS_FIXED > 0u ? ROWS_FIXED : COUNT_SOURCE == 0u ? step.gaussian_count : step.trained_count;
    uint first = NO_ROW;
    for (uint i = gl_GlobalInvocationID.x; i < rows * ROW_WORDS; i += FINITE_GROUPS * 64u) {
        // Bits, because compilers may assume that no float is NaN.
        bool is_finite = (plane[i] & 0x7f800000u) != 0x7f800000u;
        first = is_finite ? first : min(first, i / ROW_WORDS);
    }
    if (first != NO_ROW) {
        atomicMin(nonfinite_rows[PLANE], first);
    }
}
