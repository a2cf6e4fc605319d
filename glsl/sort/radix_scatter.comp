#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "count.glsl"
// radix_scatter — move keys and values to their sorted positions for one digit; stable.
// Work:    as radix_count.
// Reads:   step, counters; keys_in [n], values_in [n] (IDENTITY: the value is the index); histogram,
//          totals (scanned)
// Writes:  keys_out [n], values_out [n]
// Order:   exact integers, equal in every run.
// Mirror:  src/reference/sort.rs::radix_sort

layout(constant_id = 0) const uint SUBGROUP_SIZE = 8;
layout(constant_id = 9) const uint DIGIT_BITS = 8;
layout(constant_id = 10) const uint IDENTITY = 0;
layout(local_size_x_id = 0) in;
const uint DIGITS = 1u << DIGIT_BITS;
shared uint table[DIGITS * SUBGROUP_SIZE];
READ1(0, StepUniforms, step);
READ1(1, Counters, counters);
FETCHU(3, keys_in);
FETCHU(4, values_in);
FETCHU(5, histogram);
FETCHU(6, totals);
WRITE(7, uint, keys_out);
WRITE(8, uint, values_out);

void main() {
    uint n = item_count(step, counters, counters.failure);
    uint lane = gl_GlobalInvocationID.x, column = gl_LocalInvocationID.x;
    uint share = (n + LANES - 1u) / LANES;
    uint begin = min(lane * share, n), end = min(begin + share, n);
    for (uint d = 0u; d < DIGITS; d++) {
        table[d * SUBGROUP_SIZE + column] =
            fetchu(totals, d * (LANES / SUBGROUP_SIZE) + gl_WorkGroupID.x) + fetchu(histogram, d * LANES + lane);
    }
    for (uint i = begin; i < end; i++) {
        uint key = fetchu(keys_in, i);
        uint value = IDENTITY != 0u ? i : fetchu(values_in, i);
        uint cell = bitfieldExtract(key, int(SHIFT), int(DIGIT_BITS)) * SUBGROUP_SIZE + column;
        uint to = table[cell];
        table[cell] = to + 1u;
        keys_out[to] = key;
        values_out[to] = value;
    }
}
