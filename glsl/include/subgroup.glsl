// Butterflies over one subgroup; the shuffle is the one fast subgroup operation on every kind of device. Written out,
// because a loop over the distances is not unrolled by every driver, and loops are what lavapipe counts.

layout(constant_id = 0) const uint SUBGROUP_SIZE = 8;

float subgroup_sum(float v) {
    if (SUBGROUP_SIZE > 32u) {
        v = v + subgroupShuffleXor(v, 32u);
    }
    if (SUBGROUP_SIZE > 16u) {
        v = v + subgroupShuffleXor(v, 16u);
    }
    if (SUBGROUP_SIZE > 8u) {
        v = v + subgroupShuffleXor(v, 8u);
    }
    if (SUBGROUP_SIZE > 4u) {
        v = v + subgroupShuffleXor(v, 4u);
    }
    if (SUBGROUP_SIZE > 2u) {
        v = v + subgroupShuffleXor(v, 2u);
    }
    if (SUBGROUP_SIZE > 1u) {
        v = v + subgroupShuffleXor(v, 1u);
    }
    return v;
}

float subgroup_max(float v) {
    if (SUBGROUP_SIZE > 32u) {
        v = max(v, subgroupShuffleXor(v, 32u));
    }
    if (SUBGROUP_SIZE > 16u) {
        v = max(v, subgroupShuffleXor(v, 16u));
    }
    if (SUBGROUP_SIZE > 8u) {
        v = max(v, subgroupShuffleXor(v, 8u));
    }
    if (SUBGROUP_SIZE > 4u) {
        v = max(v, subgroupShuffleXor(v, 4u));
    }
    if (SUBGROUP_SIZE > 2u) {
        v = max(v, subgroupShuffleXor(v, 2u));
    }
    if (SUBGROUP_SIZE > 1u) {
        v = max(v, subgroupShuffleXor(v, 1u));
    }
    return v;
}

uint subgroup_max(uint v) {
    if (SUBGROUP_SIZE > 32u) {
        v = max(v, subgroupShuffleXor(v, 32u));
    }
    if (SUBGROUP_SIZE > 16u) {
        v = max(v, subgroupShuffleXor(v, 16u));
    }
    if (SUBGROUP_SIZE > 8u) {
        v = max(v, subgroupShuffleXor(v, 8u));
    }
    if (SUBGROUP_SIZE > 4u) {
        v = max(v, subgroupShuffleXor(v, 4u));
    }
    if (SUBGROUP_SIZE > 2u) {
        v = max(v, subgroupShuffleXor(v, 2u));
    }
    if (SUBGROUP_SIZE > 1u) {
        v = max(v, subgroupShuffleXor(v, 1u));
    }
    return v;
}
