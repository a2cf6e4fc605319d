// Lists of the scene that the forward walk of cards takes before the others, because the walk ends with them. Counters and step are
// declared before.

layout(constant_id = 20) const uint LONG_LIST = 1024; // longer lists may be walked in parts
const uint LONG_SHARE = 512u; // they are if they have more than this part of all pairs: others end while a card walks the rest

// A workgroup for each chunk.
bool is_long(uint length) {
    return length > max(LONG_LIST, counters.instance_count / LONG_SHARE);
}

// One workgroup, before those of shorter lists.
bool is_first(uint length) {
    return length > max(LONG_LIST / 2u, 2u * counters.instance_count / step.tile_count) && !is_long(length);
}
