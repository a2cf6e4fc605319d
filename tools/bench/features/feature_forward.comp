#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
#include "blend_tile.glsl"
// feature_forward — blend 4 VECS channels of a feature per Gaussian over one tile, and the gradient of a simple loss.
// Work:    one subgroup (= workgroup) a tile of the scene, as blend_forward.
// Reads:   step; tile_starts [T]; instance_from_sorted, splat_from_instance [I]; splats [V,3]; last [P]; gaussian_from_splat [V];
//          features [N,stride]
// Writes:  v_features_image [P,VECS]: F - target
// Math:    F = sum w f over the splats that blend_forward found to count; loss (F - target)^2 / 2, target by `wanted`.
// Mirror:  tools/bench/features/check.rs

layout(constant_id = 10) const uint VECS = 1; // vec4 of channels
layout(constant_id = 20) const uint CHUNK = 0; // first vec4 of the channels
layout(constant_id = 21) const uint STRIDE = 1; // vec4 a Gaussian
READ1(0, StepUniforms, step);
FETCHU(1, tile_starts);
FETCHU(2, instance_from_sorted);
FETCHU(3, splat_from_instance);
FETCH4(4, splats);
FETCHU(5, last);
FETCHU(6, gaussian_from_splat);
FETCH4(7, features);
WRITE(8, vec4, v_features_image);

// What the feature should be: smooth over the image, different for each channel.
vec4 wanted(uint x, uint y, uint channel) {
    vec4 c = vec4(channel, channel + 1u, channel + 2u, channel + 3u);
    return fract(0.37 * c + 0.013 * float(x) + 0.007 * float(y));
}

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
    vec4 F[ROWS * VECS];
    uint deepest = 0u;
    [[unroll]] for (uint k = 0u; k < ROWS; k++) {
        bool inside = t.x < u.width && t.y0 + k < u.height;
        T[k] = 1.0;
        final_[k] = inside ? fetchu(last, (t.y0 + k) * u.width + t.x) : 0u;
        deepest = max(deepest, final_[k]);
        [[unroll]] for (uint v = 0u; v < VECS; v++) {
            F[k * VECS + v] = vec4(0.0);
        }
    }
    deepest = subgroup_max(deepest);
    for (uint base = 0u; base < deepest; base += SUBGROUP_SIZE) {
        uint count = min(SUBGROUP_SIZE, deepest - base);
        uint index = fetchu(splat_from_instance, fetchu(instance_from_sorted, list_start + min(base + lane, deepest - 1u)));
        uint gaussian = fetchu(gaussian_from_splat, index);
        vec4 r0 = fetch4(splats, 3u * index), r1 = fetch4(splats, 3u * index + 1u);
        vec4 mine[VECS];
        [[unroll]] for (uint v = 0u; v < VECS; v++) {
            mine[v] = fetch4(features, gaussian * STRIDE + CHUNK + v);
        }
        for (uint j = 0u; j < count; j++) {
            float x = subgroupShuffle(r0.x, j) - corner.x, y = subgroupShuffle(r0.y, j) - corner.y;
            float a = subgroupShuffle(r0.z, j), b = subgroupShuffle(r0.w, j), c = subgroupShuffle(r1.x, j);
            float lo = subgroupShuffle(r1.y, j);
            vec4 f[VECS];
            [[unroll]] for (uint v = 0u; v < VECS; v++) {
                f[v] = vec4(subgroupShuffle(mine[v].x, j), subgroupShuffle(mine[v].y, j),
                    subgroupShuffle(mine[v].z, j), subgroupShuffle(mine[v].w, j));
            }
            uint position = base + j + 1u;
            float dx = x - t.px;
            float ax = lo + a * dx * dx, bx = b * dx;
            float dy0 = y - t.row0;
            [[unroll]] for (uint k = 0u; k < ROWS; k++) {
                float dy = dy0 - float(k);
                precise float e = ax + dy * (bx + c * dy);
                float alpha = min(ALPHA_MAX, exp2(max(e, -20.0)));
                alpha = e < LOG2_ALPHA_MIN || position > final_[k] ? 0.0 : alpha;
                float w = alpha * T[k];
                T[k] *= 1.0 - alpha;
                [[unroll]] for (uint v = 0u; v < VECS; v++) {
                    F[k * VECS + v] += w * f[v];
                }
            }
        }
    }
    [[unroll]] for (uint k = 0u; k < ROWS; k++) {
        uint y = t.y0 + k;
        if (t.x < u.width && y < u.height) {
            [[unroll]] for (uint v = 0u; v < VECS; v++) {
                vec4 target = wanted(t.x, y, 4u * (CHUNK + v));
                v_features_image[(y * u.width + t.x) * VECS + v] = F[k * VECS + v] - target;
            }
        }
    }
}
