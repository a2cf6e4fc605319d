// The work of a subgroup or workgroup in the blend passes, and its order. The includer declares lane_corner(), the
// lane's first pixel in the tile.

struct TileJob {
    uint layer;      // 0: the scene
    uint tile;       // within the layer
    uint layer_tile; // index among the occupied layer tiles
    uint x, y0;      // the lane's column and first row, px
    float px;        // centre of the lane's column relative to the tile's left edge
    float row0;      // first row of the lane relative to the tile's top edge
};

// Some devices split a dispatch in two halves; they split it here.
bool in_first_half(uint i, uint n) {
    return i < (n + 1u) / 2u;
}

// Neighbouring tiles cost about the same. The even ones form the first half of the groups and the odd ones the second,
// so devices that split a dispatch into fixed halves get two halves of equal cost.
uint interleave(uint i, uint n) {
    return in_first_half(i, n) ? 2u * i : 2u * (i - (n + 1u) / 2u) + 1u;
}

TileJob locate(uint virtual_tile, uint layer_tile, StepUniforms u) {
    TileJob t;
    t.layer_tile = layer_tile;
    t.layer = virtual_tile / u.tile_count;
    t.tile = virtual_tile % u.tile_count;
    uvec2 own = lane_corner();
    t.x = (t.tile % u.tiles_x) * TILE_WIDTH + own.x;
    t.y0 = (t.tile / u.tiles_x) * TILE_HEIGHT + own.y;
    t.px = float(own.x) + 0.5;
    t.row0 = float(own.y) + 0.5;
    return t;
}

// Number of jobs: the scene's tiles, then (variant labels) the occupied tiles of object layers.
uint job_count(StepUniforms u) {
#ifdef LABELS
    return u.tile_count + counters.layer_tile_count;
#else
    return u.tile_count;
#endif
}

TileJob locate_job(uint job, StepUniforms u, out uint virtual_tile) {
    uint layer_tile = 0u;
    virtual_tile = job;
#ifdef LABELS
    if (job >= u.tile_count) {
        layer_tile = job - u.tile_count;
        virtual_tile = fetchu(layer_tiles, layer_tile);
    }
#endif
    return locate(virtual_tile, layer_tile, u);
}

// Top left corner of the tile, px.
vec2 tile_corner(TileJob t, StepUniforms u) {
    return vec2(float(t.tile % u.tiles_x * TILE_WIDTH), float(t.tile / u.tiles_x * TILE_HEIGHT));
}
