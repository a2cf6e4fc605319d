#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
// loss_reduce — sum the loss partials of the photo and (variant labels) of the object layers.
// Work:    one workgroup of one subgroup; lane i sums every W-th value, then a butterfly.
// Reads:   loss_partials [PARTIALS]; variant labels: step; layer_loss [counters.layer_tile_count];
//          variant disagreement: step; disagreement [T]
// Writes:  counters.loss_l1, loss_ssim, loss_label
// Order:   fixed, bitwise reproducible.
// Mirror:  src/reference/loss.rs::photo_loss

#include "subgroup.glsl"
layout(local_size_x_id = 0) in;
READ(0, vec2, loss_partials);
INOUT1(1, Counters, counters);
#if defined(LABELS) || defined(DISAGREEMENT)
READ1(2, StepUniforms, step);
#endif
#ifdef LABELS
READ(3, float, layer_loss);
#endif
#ifdef DISAGREEMENT
READ(3, float, disagreement);
#endif

void main() {
    uint lane = gl_LocalInvocationID.x;
    vec2 sum = vec2(0.0);
    for (uint i = lane; i < PARTIALS; i += SUBGROUP_SIZE) {
        sum += loss_partials[i];
    }
    float l1 = subgroup_sum(sum.x), ssim = subgroup_sum(sum.y), label = 0.0;
#ifdef LABELS
    // If there are more layer tiles than capacity, the step has failed and its loss is unused.
    uint count = min(counters.layer_tile_count, step.layer_tile_capacity);
    for (uint i = lane; i < count; i += SUBGROUP_SIZE) {
        label += layer_loss[i];
    }
    label = subgroup_sum(label);
#endif
#ifdef DISAGREEMENT
    for (uint i = lane; i < step.tile_count; i += SUBGROUP_SIZE) {
        label += disagreement[i];
    }
    label = subgroup_sum(label);
#endif
    if (lane == 0u) {
        counters.loss_l1 = l1;
        counters.loss_ssim = ssim;
        counters.loss_label = label;
    }
}
