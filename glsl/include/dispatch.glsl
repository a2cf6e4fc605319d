// One-dimensional work folded over two axes, because one axis has at most 65,535 groups. Needs constants.glsl.

uint linear_group_id() {
    return gl_WorkGroupID.y * FOLD + gl_WorkGroupID.x;
}

// Word of `sweep` for a bin of the histograms of a sort that starts with the pass `slot`; bins are numbered digit by digit.
uint sweep_bin(uint slot, uint bin, uint digit_bits) {
    return SWEEP_HISTOGRAMS + (slot + (bin >> digit_bits)) * SWEEP_DIGITS + (bin & ((1u << digit_bits) - 1u));
}

uvec3 folded_groups(uint groups) {
    return groups <= FOLD ? uvec3(groups, groups > 0u ? 1u : 0u, 1u) : uvec3(FOLD, (groups + FOLD - 1u) / FOLD, 1u);
}
