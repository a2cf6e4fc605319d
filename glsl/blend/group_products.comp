#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
// group_products — find the transmittance of each chunk of a long list, for its processing in parts by group_forward.
// Work:    one workgroup per chunk, as in group_forward; none for the last chunk of a list, which has nothing behind
//          it.
// Reads:   step; counters; tile_starts, tile_ends [T]; instance_from_sorted, splat_from_instance [I]; splats [V,3];
//          long_chunks [counters.long_chunk_count]
// Writes:  chunk_states [states, pixels of a tile], w: the product of (1 - alpha) over a chunk, or any number below
//          TRANSMITTANCE_MIN instead of a smaller product; last [P], chunk_jobs [slots]: 0 in the tiles and first
//          chunks of long lists
// Math:    alpha and the product as in group_forward, bit for bit: a part continues where this pass ends.
// Order:   fixed, bitwise reproducible.
// Mirror:  src/reference/blend.rs::blend_forward

READ1(0, StepUniforms, step);
READ1(1, Counters, counters);
FETCHU(2, tile_starts);
FETCHU(3, tile_ends);
FETCHU(4, instance_from_sorted);
FETCH4(5, splats);
FETCHU(6, splat_from_instance);
READ(7, uvec2, long_chunks);
WRITE(8, uint, last);
WRITE(9, uint, chunk_jobs);
WRITE(10, vec4, chunk_states);
layout(constant_id = 15) const uint GROUP_LANES = 128;
#define BATCH_MOST GROUP_LANES
#define EXCHANGE_LANES 256u
#include "group_tile.glsl"
#include "live.glsl"

void main() {
    StepUniforms u = step;
    uint groups = counters.long_chunk_count, group = linear_group_id(), lane = gl_LocalInvocationID.x;
    if (group >= groups) {
        return;
    }
    uvec2 part = long_chunks[TURNED != 0u ? groups - 1u - group : group];
    uint job = part.x, chunk = part.y;
    TileJob t = locate(job, 0u, u);
    uint start = fetchu(tile_starts, job), end = fetchu(tile_ends, job), first = start / CHUNK_LENGTH;
    if (chunk == 0u) {
        [[unroll]] for (uint k = 0u; k < ROWS; k++) {
            if (t.x < u.width && t.y0 + k < u.height) {
                last[(t.y0 + k) * u.width + t.x] = 0u;
            }
        }
        if (lane == 0u) {
            chunk_jobs[first + job] = 0u;
        }
    }
    uint from = start + chunk * CHUNK_LENGTH, to = from + CHUNK_LENGTH;
    if (to >= end) {
        return;
    }
    float p[ROWS];
    [[unroll]] for (uint k = 0u; k < ROWS; k++) {
        p[k] = 1.0;
    }
    if (lane == 0u) {
        live_subgroups = SUBGROUPS;
    }
    barrier();

    bool is_live = true;
    for (uint base = from; base < to; base += BATCH) {
        if (!some_live(subgroup_max(most_of(p)) >= TRANSMITTANCE_MIN, is_live)) {
            break;
        }
        if (lane < BATCH) {
            stage(lane, fetchu(splat_from_instance, fetchu(instance_from_sorted, base + lane)), tile_corner(t, u));
        }
        barrier();
        for (uint c = 0u; c < BATCH; c += SUBGROUP_SIZE) {
            uint own = min(c + subgroup_lane(), BATCH - 1u);
            uvec2 hits = hits_of(is_live && touches(own), min(BATCH - c, SUBGROUP_SIZE));
            while (some(hits)) {
                uint j = c + take_first(hits);
                vec4 r0 = staged_0[j], r1 = staged_1[j];
                float dx = r0.x - t.px;
                float ax = r1.y + r0.z * dx * dx, bx = r0.w * dx;
                float dy0 = r0.y - t.row0;
                [[unroll]] for (uint k = 0u; k < ROWS; k++) {
                    float dy = dy0 - float(k);
                    precise float e = ax + dy * (bx + r1.x * dy);
                    float alpha = min(ALPHA_MAX, exp2(max(e, -20.0)));
                    alpha = e < LOG2_ALPHA_MIN ? 0.0 : alpha;
                    precise float q = p[k] * (1.0 - alpha);
                    p[k] = q;
                }
            }
        }
    }
    [[unroll]] for (uint k = 0u; k < ROWS; k++) {
        chunk_states[(first + chunk) * TILE_PIXELS + tile_pixel(t, k)].w = p[k];
    }
}
