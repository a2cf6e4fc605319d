// Common code of the blend passes on GPUs: a workgroup of several subgroups owns one tile of one layer. A subgroup owns
// a block of its pixels, and a lane ROWS pixels of one column. Splats are staged in shared memory, relative to the
// tile's corner, and a subgroup skips splats that its block does not touch, which does not affect the result.
//
// A list is cut into chunks of CHUNK_LENGTH splats. The forward pass stores each pixel's transmittance and light at the
// end of a chunk, so that the backward pass has a workgroup per chunk, and no tile delays the others. Chunks are
// numbered without a scan: the chunks of job j, whose list starts at pair s, have the slots starting at s /
// CHUNK_LENGTH + j. Lists ascend with their jobs, so there are always enough slots. States between chunks start at s /
// CHUNK_LENGTH.
//
// The forward pass processes a list chunk by chunk. The transmittance is the product of all earlier chunks'
// transmittances, times the transmittance within the chunk, so long lists can be processed by one workgroup per chunk
// (variant products of group_forward.comp) with the same bits.

#include "subgroup.glsl"
layout(constant_id = 1) const uint TILE_WIDTH = 16;
layout(constant_id = 2) const uint TILE_HEIGHT = 16;
layout(constant_id = 14) const uint CHUNK_LENGTH = 256; // a power of 2
layout(constant_id = 18) const uint CULLS = 1;  // 0, for tests: nothing is skipped
layout(constant_id = 19) const uint TURNED = 0; // 1, for tests: workgroups take their work in the opposite order
layout(local_size_x_id = 15) in; // GROUP_LANES, which each pass declares

const uint TILE_PIXELS = TILE_WIDTH * TILE_HEIGHT;
const uint ROWS = TILE_PIXELS / GROUP_LANES;
const uint SUBGROUPS = GROUP_LANES / SUBGROUP_SIZE;

// A block is about as wide as high.
const uint BLOCK_PIXELS = SUBGROUP_SIZE * ROWS;
const uint BLOCK_WIDTH = BLOCK_PIXELS <= 32u ? 4u : BLOCK_PIXELS <= 128u ? 8u : 16u;
const uint BLOCK_HEIGHT = BLOCK_PIXELS / BLOCK_WIDTH;

const uint BATCH = BATCH_MOST < CHUNK_LENGTH ? BATCH_MOST : CHUNK_LENGTH; // splats in shared memory

const uint NO_CHUNK = 0xffffffffu;   // slot without work
const uint LAST_CHUNK = 0x80000000u; // bit of a slot's job: nothing behind it was walked

// First pixel of the subgroup's block in the tile.
uvec2 block_corner() {
    const uint columns = TILE_WIDTH / BLOCK_WIDTH;
    return uvec2(subgroup_id() % columns * BLOCK_WIDTH, subgroup_id() / columns * BLOCK_HEIGHT);
}

uvec2 lane_corner() {
    return block_corner() + uvec2(subgroup_lane() % BLOCK_WIDTH, subgroup_lane() / BLOCK_WIDTH * ROWS);
}

#include "tile_job.glsl"

uint tile_pixel(TileJob t, uint k) {
    uvec2 own = lane_corner();
    return (own.y + k) * TILE_WIDTH + own.x;
}

shared float subgroup_sums[SUBGROUPS];

// The sum over a tile's pixels, in the order of subgroups; once in a pass, by the whole workgroup.
float tile_sum(float v) {
    v = subgroup_sum(v);
    if (subgroup_lane() == 0u) {
        subgroup_sums[subgroup_id()] = v;
    }
    barrier();
    float sum = 0.0;
    for (uint s = 0u; s < SUBGROUPS; s++) {
        sum += subgroup_sums[s];
    }
    return sum;
}

// Splats as in record.glsl; the mean is relative to the tile's corner.
shared vec4 staged_0[BATCH], staged_1[BATCH], staged_2[BATCH];

void stage(uint at, uint index, vec2 corner) {
    vec4 r0 = fetch4(splats, 3u * index);
    staged_0[at] = vec4(r0.xy - corner, r0.zw);
    staged_1[at] = fetch4(splats, 3u * index + 1u);
    staged_2[at] = fetch4(splats, 3u * index + 2u);
}

// True unless the staged splat counts at no pixel of the subgroup's block. Also between pixels: the largest exponent
// over the block, which is 0 at the mean and decreases from there, is on the sides that face the mean. Margins as in
// ellipse.glsl.
bool touches(uint at) {
    if (CULLS == 0u) {
        return true;
    }
    vec4 r0 = staged_0[at], r1 = staged_1[at];
    vec2 extent = staged_2[at].zw * 1.0001 + 0.01;
    vec2 near = vec2(block_corner()) + 0.5, far = near + vec2(float(BLOCK_WIDTH - 1u), float(BLOCK_HEIGHT - 1u));
    vec2 low = r0.xy - far, high = r0.xy - near; // mean - pixel
    vec2 d = clamp(vec2(0.0), low, high);
    float a = r0.z, b = r0.w, c = r1.x;
    float dy = clamp(-0.5 * b * d.x / c, low.y, high.y), dx = clamp(-0.5 * b * d.y / a, low.x, high.x);
    float on_x = a * d.x * d.x + d.x * dy * b + c * dy * dy, on_y = a * dx * dx + dx * d.y * b + c * d.y * d.y;
    vec2 most = min(max(abs(low), abs(high)), extent);
    float terms = abs(a) * most.x * most.x + abs(b) * most.x * most.y + abs(c) * most.y * most.y;
    bool is_beyond = any(greaterThan(abs(d), extent)) || r1.y + max(on_x, on_y) + 0.01 + 2e-6 * terms < LOG2_ALPHA_MIN;
    return !is_beyond; // true for NaN too
}

// A bit for each of the subgroup's lanes up to `count` whose splat is hit. Emulated subgroups process all, because they
// must stay together.
uvec2 hits_of(bool hit, uint count) {
#ifdef EMULATED
    return uvec2(count >= 32u ? 0xffffffffu : (1u << count) - 1u,
        count >= 64u ? 0xffffffffu : count <= 32u ? 0u : (1u << (count - 32u)) - 1u);
#else
    return subgroup_ballot(hit && subgroup_lane() < count);
#endif
}

bool some(uvec2 hits) {
    return (hits.x | (SUBGROUP_SIZE > 32u ? hits.y : 0u)) != 0u;
}

// Removes the first hit, which must exist.
uint take_first(inout uvec2 hits) {
    bool low = SUBGROUP_SIZE <= 32u || hits.x != 0u;
    uint j = low ? uint(findLSB(hits.x)) : 32u + uint(findLSB(hits.y));
    hits = low ? uvec2(hits.x & (hits.x - 1u), hits.y) : uvec2(0u, hits.y & (hits.y - 1u));
    return j;
}

// Removes the last hit.
uint take_last(inout uvec2 hits) {
    bool high = SUBGROUP_SIZE > 32u && hits.y != 0u;
    uint j = uint(findMSB(high ? hits.y : hits.x));
    hits ^= high ? uvec2(0u, 1u << j) : uvec2(1u << j, 0u);
    return high ? 32u + j : j;
}
