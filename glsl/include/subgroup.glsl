// Butterflies over one subgroup; the shuffle is the one fast subgroup operation on every kind of device.

layout(constant_id = 0) const uint SUBGROUP_SIZE = 8;

float subgroup_sum(float v) {
    for (uint step_ = SUBGROUP_SIZE >> 1; step_ > 0u; step_ >>= 1) {
        v += subgroupShuffleXor(v, step_);
    }
    return v;
}

float subgroup_max(float v) {
    for (uint step_ = SUBGROUP_SIZE >> 1; step_ > 0u; step_ >>= 1) {
        v = max(v, subgroupShuffleXor(v, step_));
    }
    return v;
}

uint subgroup_max(uint v) {
    for (uint step_ = SUBGROUP_SIZE >> 1; step_ > 0u; step_ >>= 1) {
        v = max(v, subgroupShuffleXor(v, step_));
    }
    return v;
}
