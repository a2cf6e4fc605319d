// Writes (splat, tile) pairs. The includer declares tile_keys, splat_from_instance, and with SWEEP includes
// digit_counts.glsl.

// Destination of a splat's instances.
struct Target {
    uint splat, layer;
    uint first; // instance
    uint count; // tiles
};

void put(uint at, uint key, uint splat) {
    tile_keys[at] = KEY(key);
    splat_from_instance[at] = splat;
#ifdef SWEEP
    count_digits(key);
#endif
}

// Writes the instances of a splat's n-th tile.
void put_tile(StepUniforms u, Target t, uint n, uint tile) {
    if (n < t.count) {
        put(t.first + n, tile, t.splat);
#ifdef LABELS
        if (t.layer != 0u) {
            put(t.first + t.count + n, t.layer * u.tile_count + tile, t.splat);
        }
#endif
    }
}
