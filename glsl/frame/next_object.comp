#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
// next_object — make the next sampled object the only layer of the following passes; after the last object, restore
// the counters of the whole step.
// Work:    one invocation.
// Reads:   step; label_from_layer, layer_weights [layers]; layer_occluders [layers, words]
// Writes:  object: the layer, from 1; object_counters: the counters of all passes so far; counters; object_step, and
//          entry 1 of object_label, object_weight, object_occluders: inputs of the object's passes
// Mirror:  none (bookkeeping; tests/pass/separate.rs)

layout(local_size_x = 1) in;
READ1(0, StepUniforms, step);
READ(1, uint, label_from_layer);
READ(2, float, layer_weights);
READ(3, uint, layer_occluders);
INOUT1(4, uint, object);
INOUT1(5, Counters, object_counters);
INOUT1(6, Counters, counters);
WRITE1(7, StepUniforms, object_step);
WRITE(8, uint, object_label);
WRITE(9, float, object_weight);
WRITE(10, uint, object_occluders);

void main() {
    StepUniforms u = step;
    uint done = object;
    // Sums and maxima by atomics continue over all passes.
    Counters sum = counters;
    if (done > 0u) {
        Counters before = object_counters;
        sum.visible_count = before.visible_count;
        sum.instance_count = max(sum.instance_count, before.instance_count);
        sum.layer_tile_count = max(sum.layer_tile_count, before.layer_tile_count);
        sum.loss_l1 = before.loss_l1;
        sum.loss_ssim = before.loss_ssim;
        sum.loss_label += before.loss_label;
    }
    object_counters = sum;
    if (done == u.layer_count) {
        counters = sum;
        return;
    }
    uint layer = done + 1u, words = u.occluder_words;
    object = layer;
    object_label[0] = 0u;
    object_label[1] = label_from_layer[layer];
    object_weight[0] = 1.0;
    object_weight[1] = layer_weights[layer];
    for (uint w = 0u; w < words; w++) {
        object_occluders[w] = 0u;
        object_occluders[words + w] = layer_occluders[layer * words + w];
    }
    u.layer_count = 1u;
    // Gradient records of earlier passes do not belong to this object; the host uses the lower bits of the stamp.
    u.stamp ^= layer << 24;
    object_step = u;
}
