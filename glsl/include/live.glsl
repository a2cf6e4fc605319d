// Tracks whether pixels of the forward pass on GPUs still accept splats.

shared uint live_subgroups; // SUBGROUPS at the start

float most_of(float p[ROWS]) {
    float most = p[0];
    [[unroll]] for (uint k = 1u; k < ROWS; k++) {
        most = max(most, p[k]);
    }
    return most;
}

// False once no subgroup of the workgroup has a pixel that accepts splats; `is_live` says if this one has.
bool some_live(bool still, inout bool is_live) {
    if (is_live && !still && subgroup_lane() == 0u) {
        atomicAdd(live_subgroups, 0xffffffffu);
    }
    is_live = still;
    barrier();
    return live_subgroups != 0u;
}
