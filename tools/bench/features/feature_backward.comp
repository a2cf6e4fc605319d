#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
#include "blend_tile.glsl"
// feature_backward — gradient of 4 VECS channels by the features, one record per (splat, tile) pair.
// Work:    one subgroup (= workgroup) a tile of the scene. Front to back: weights do not depend on what is behind.
// Reads:   step; tile_starts [T]; instance_from_sorted, splat_from_instance [I]; splats [V,3]; last [P]; v_features_image [P,VECS]
// Writes:  v_feature_instances [I,VECS] by instance; a record counts where blend_backward left the step's stamp
// Math:    v_f = sum over pixels of w (F - target). The way to alpha and so to the geometry is left out.
// Order:   fixed, bitwise reproducible.
// Mirror:  tools/bench/features/check.rs

layout(constant_id = 10) const uint VECS = 1;
READ1(0, StepUniforms, step);
FETCHU(1, tile_starts);
FETCHU(2, instance_from_sorted);
FETCHU(3, splat_from_instance);
FETCH4(4, splats);
FETCHU(5, last);
FETCH4(6, v_features_image);
WRITE(7, vec4, v_feature_instances);

void main() {
    StepUniforms u = step;
    uint group = linear_group_id();
    if (group >= u.tile_count) {
        return;
    }
    uint tile = interleave(group, u.tile_count);
    TileJob t = locate(tile, 0u, u);
    uint lane = gl_LocalInvocationID.x;
    uint list_start = fetchu(tile_starts, tile);
    vec2 corner = vec2(float(t.x - (lane % TILE_WIDTH)), float((t.tile / u.tiles_x) * TILE_HEIGHT));
    float T[ROWS];
    uint final_[ROWS];
    vec4 g[ROWS * VECS];
    uint deepest = 0u;
    [[unroll]] for (uint k = 0u; k < ROWS; k++) {
        bool inside = t.x < u.width && t.y0 + k < u.height;
        uint p = inside ? (t.y0 + k) * u.width + t.x : 0u;
        T[k] = 1.0;
        final_[k] = inside ? fetchu(last, p) : 0u;
        deepest = max(deepest, final_[k]);
        [[unroll]] for (uint v = 0u; v < VECS; v++) {
            g[k * VECS + v] = fetch4(v_features_image, p * VECS + v);
        }
    }
    deepest = subgroup_max(deepest);
    for (uint base = 0u; base < deepest; base += SUBGROUP_SIZE) {
        uint count = min(SUBGROUP_SIZE, deepest - base);
        uint instance = fetchu(instance_from_sorted, list_start + min(base + lane, deepest - 1u));
        uint index = fetchu(splat_from_instance, instance);
        vec4 r0 = fetch4(splats, 3u * index), r1 = fetch4(splats, 3u * index + 1u);
        vec4 own[VECS];
        [[unroll]] for (uint v = 0u; v < VECS; v++) {
            own[v] = vec4(0.0);
        }
        for (uint j = 0u; j < count; j++) {
            float x = subgroupShuffle(r0.x, j) - corner.x, y = subgroupShuffle(r0.y, j) - corner.y;
            float a = subgroupShuffle(r0.z, j), b = subgroupShuffle(r0.w, j), c = subgroupShuffle(r1.x, j);
            float lo = subgroupShuffle(r1.y, j);
            uint position = base + j + 1u;
            float dx = x - t.px;
            float ax = lo + a * dx * dx, bx = b * dx;
            float dy0 = y - t.row0;
            vec4 sum[VECS];
            [[unroll]] for (uint v = 0u; v < VECS; v++) {
                sum[v] = vec4(0.0);
            }
            [[unroll]] for (uint k = 0u; k < ROWS; k++) {
                float dy = dy0 - float(k);
                precise float e = ax + dy * (bx + c * dy);
                float alpha = min(ALPHA_MAX, exp2(max(e, -20.0)));
                alpha = e < LOG2_ALPHA_MIN || position > final_[k] ? 0.0 : alpha;
                float w = alpha * T[k];
                T[k] *= 1.0 - alpha;
                [[unroll]] for (uint v = 0u; v < VECS; v++) {
                    sum[v] += w * g[k * VECS + v];
                }
            }
            bool me = lane == j;
            [[unroll]] for (uint v = 0u; v < VECS; v++) {
                vec4 all = vec4(subgroup_sum(sum[v].x), subgroup_sum(sum[v].y), subgroup_sum(sum[v].z), subgroup_sum(sum[v].w));
                own[v] = me ? all : own[v];
            }
        }
        if (lane < count) {
            [[unroll]] for (uint v = 0u; v < VECS; v++) {
                v_feature_instances[instance * VECS + v] = own[v];
            }
        }
    }
}
