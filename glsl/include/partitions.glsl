// Partitions of the passes that look back: the keys of a sort (sweep.glsl), the Gaussians of project_visible.
#ifndef PARTITIONS_GLSL
#define PARTITIONS_GLSL

layout(constant_id = 18) const uint SWEEP_ITEMS = 16; // items of an invocation
const uint SWEEP_PARTITION = SWEEP_LANES * SWEEP_ITEMS;

uint partitions(uint items) {
    return (items + SWEEP_PARTITION - 1u) / SWEEP_PARTITION;
}

uint visible_partitions(uint gaussians) {
    uint own = VISIBLE_LANES * VISIBLE_ITEMS;
    return (gaussians + own - 1u) / own;
}

#endif
