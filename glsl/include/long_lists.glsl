// Lists of the scene that the forward pass on GPUs processes first, because they take longest. Counters and step are
// declared before.

layout(constant_id = 20) const uint LONG_LIST = 1024; // longer lists may be walked in parts
// Only if they have more than this part of all pairs: shorter lists finish while the GPU processes the rest.
const uint LONG_SHARE = 512u;

// A workgroup for each chunk.
bool is_long(uint length) {
    return length > max(LONG_LIST, counters.instance_count / LONG_SHARE);
}

// One workgroup, before those of shorter lists.
bool is_first(uint length) {
    return length > max(LONG_LIST / 2u, 2u * counters.instance_count / step.tile_count) && !is_long(length);
}
