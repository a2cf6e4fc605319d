#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "count.glsl"
// radix_count — histogram of one digit of the keys, one histogram per lane.
// Work:    LANES lanes over all workgroups of one subgroup; lane i owns keys [i c, (i+1) c). Each lane has its own
//          column of the table, so no atomics are needed and equal keys keep their order.
// Reads:   step, counters; keys_in [n]
// Writes:  histogram [2^DIGIT_BITS, LANES]: sums over earlier lanes of the workgroup; totals [2^DIGIT_BITS,
//          workgroups]
// Order:   exact integers, equal in every run.
// Mirror:  src/reference/sort.rs::radix_sort

layout(constant_id = 0) const uint SUBGROUP_SIZE = 8;
layout(constant_id = 9) const uint DIGIT_BITS = 8;
layout(local_size_x_id = 0) in;
const uint DIGITS = 1u << DIGIT_BITS;
shared uint table[DIGITS * SUBGROUP_SIZE];
READ1(0, StepUniforms, step);
READ1(1, Counters, counters);
FETCHU(3, keys_in);
WRITE(4, uint, histogram);
WRITE(5, uint, totals);

void main() {
    uint n = item_count(step, counters, counters.failure);
    uint lane = gl_GlobalInvocationID.x, column = gl_LocalInvocationID.x;
    uint share = (n + LANES - 1u) / LANES;
    uint begin = min(lane * share, n), end = min(begin + share, n);
    for (uint d = 0u; d < DIGITS; d++) {
        table[d * SUBGROUP_SIZE + column] = 0u;
    }
    for (uint i = begin; i < end; i++) {
        uint digit = bitfieldExtract(fetchu(keys_in, i), int(SHIFT), int(DIGIT_BITS));
        table[digit * SUBGROUP_SIZE + column] += 1u;
    }
    barrier();
    for (uint d = column; d < DIGITS; d += SUBGROUP_SIZE) {
        uint sum = 0u;
        for (uint at = d * SUBGROUP_SIZE; at < (d + 1u) * SUBGROUP_SIZE; at++) {
            uint count = table[at];
            table[at] = sum;
            sum += count;
        }
        totals[d * (LANES / SUBGROUP_SIZE) + gl_WorkGroupID.x] = sum;
    }
    barrier();
    for (uint d = 0u; d < DIGITS; d++) {
        histogram[d * LANES + lane] = table[d * SUBGROUP_SIZE + column];
    }
}
