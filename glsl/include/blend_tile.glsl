// Common code of the blend passes: one subgroup owns one tile of one layer. A lane owns ROWS pixels of one column in
// registers. Each lane loads one splat, and shuffles broadcast it.

#include "subgroup.glsl"
layout(constant_id = 1) const uint TILE_WIDTH = 8;
layout(constant_id = 2) const uint TILE_HEIGHT = 8;
layout(local_size_x_id = 0) in;

// lavapipe ends all loops of an invocation after 65,535 rounds in total. Lists longer than a segment take several
// dispatches (SEGMENTED), which pass the pixels' state through memory.
#ifdef SEGMENTED
layout(constant_id = 14) const uint SEGMENT_LENGTH = 40960;
#endif

const uint ROWS = TILE_WIDTH * TILE_HEIGHT / SUBGROUP_SIZE;

uvec2 lane_corner() {
    return uvec2(gl_LocalInvocationID.x % TILE_WIDTH, gl_LocalInvocationID.x / TILE_WIDTH * ROWS);
}

#include "tile_job.glsl"

// Index of a pixel of the lane within its tile, in memory.
uint tile_pixel(TileJob t, uint k) {
    return k * SUBGROUP_SIZE + gl_LocalInvocationID.x;
}

// The sum over a tile's pixels.
#define tile_sum(v) subgroup_sum(v)

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
