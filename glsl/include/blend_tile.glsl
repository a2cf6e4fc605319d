// Common code of the blend passes: one subgroup owns one tile of one layer. A lane owns ROWS pixels of one column in
// registers. Each lane loads one splat, and shuffles broadcast it.

#include "subgroup.glsl"
layout(constant_id = 1) const uint TILE_WIDTH = 8;
layout(constant_id = 2) const uint TILE_HEIGHT = 8;
layout(local_size_x_id = 0) in;

// lavapipe ends all loops of an invocation after 65,535 rounds in total. Several dispatches (SEGMENTED) walk a list
// longer than a segment, and pass on the state of the pixels through memory.
#ifdef SEGMENTED
layout(constant_id = 14) const uint SEGMENT_LENGTH = 40960;
#endif

const uint ROWS = TILE_WIDTH * TILE_HEIGHT / SUBGROUP_SIZE;

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
    uint lane = gl_LocalInvocationID.x;
    uint column = lane % TILE_WIDTH, band = lane / TILE_WIDTH;
    t.x = (t.tile % u.tiles_x) * TILE_WIDTH + column;
    t.y0 = (t.tile / u.tiles_x) * TILE_HEIGHT + band * ROWS;
    t.px = float(column) + 0.5;
    t.row0 = float(band * ROWS) + 0.5;
    return t;
}

// Exponent form of one splat relative to the tile's corner, as loaded by one lane.
struct TileSplat {
    float x, y, a, b, c, lo;
    vec3 colour;
    float z;
};

TileSplat broadcast(TileSplat s, uint lane) {
    TileSplat r;
    vec3 conic = subgroup_shuffle(vec3(s.a, s.b, s.c), lane), place = subgroup_shuffle(vec3(s.x, s.y, s.lo), lane);
    r.x = place.x;
    r.y = place.y;
    r.lo = place.z;
    r.a = conic.x;
    r.b = conic.y;
    r.c = conic.z;
    r.colour = subgroup_shuffle(s.colour, lane);
    r.z = subgroup_shuffle(s.z, lane);
    return r;
}
