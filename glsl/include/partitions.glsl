// Partitions of the items of a pass that looks back (sweep.glsl).
#ifndef PARTITIONS_GLSL
#define PARTITIONS_GLSL

layout(constant_id = 18) const uint SWEEP_ITEMS = 16; // items of an invocation
const uint SWEEP_PARTITION = SWEEP_LANES * SWEEP_ITEMS;

uint partitions(uint items) {
    return (items + SWEEP_PARTITION - 1u) / SWEEP_PARTITION;
}

#endif
