#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
#include "record.glsl"
// blend_backward — process one tile of one layer back to front; write one gradient record per (splat, tile) pair.
// Work:    one subgroup (= workgroup) per tile, jobs as in blend_forward.
// Reads:   step; tile_starts [layers * T]; instance_from_sorted, splat_from_instance [I]; splats [V,3]; image [P] (w =
//          transmittance), last [P]; v_image [P]; variant labels: counters, layer_tiles, layer_state, layer_weights
//          variant disagreement: target [P]; view_labels [P]; labels [N]; gaussian_from_splat [V] variant depth: depths
//          [P]
// Writes:  v_instances_a, _b, _c [I] by instance: v_mean2d (px), v_conic xy; v_conic z, v_log_opacity, v_colour rg;
//          v_colour b, stamp of the step
//          (records without the current stamp were not written; they count as 0)
//          variant disagreement: disagreement [T], the weighted sum of a tile's disagreement
// Math:    p = dL/d ln alpha = w (u - s), where u = colour . g, and s is the colour behind, times g; geometry and
//          opacity gradients are linear in six moments of p about the tile's centre. T by division. Clamped alpha: p =
//          0. Disagreement of pixel v with label L: E = sum of w d + T_end [L != 0], with d = [the splat's label is not
//          L]. It is an additional channel with the colour d, a background of [L != 0], and gradients of opacities
//          only. A known depth D has the same sum, with d = min(|z / D - 1|, 1) and a background of 1.
// Order:   fixed, bitwise reproducible.
// Mirror:  src/reference/blend.rs::blend_backward, disagreement.rs::disagreement, disagreement.rs::depth_error

READ1(0, StepUniforms, step);
FETCHU(1, tile_starts);
FETCHU(2, splat_from_instance);
FETCHU(3, instance_from_sorted);
FETCH4(4, splats);
FETCH4(5, image);
FETCHU(6, last);
FETCH4(7, v_image);
WRITE(8, vec4, v_instances_a);
WRITE(9, vec4, v_instances_b);
WRITE(10, vec2, v_instances_c);
#ifdef LABELS
READ1(11, Counters, counters);
FETCHU(12, layer_tiles);
READ(13, uvec2, layer_state);
READ(14, float, layer_weights);
#endif
#ifdef DISAGREEMENT
FETCHC(11, target);
FETCHU(12, view_labels);
FETCHU(13, labels);
FETCHU(14, gaussian_from_splat);
WRITE(15, float, disagreement);
#endif
#ifdef DEPTH
READ(11, float, depths);
#endif
#if defined(DISAGREEMENT) || defined(DEPTH)
#define CHANNEL
#endif
#include "blend_tile.glsl"
#include "transposed_sums.glsl"
#include "moments.glsl"
#ifdef LABELS
#include "label_state.glsl"
#endif
#ifdef CHANNEL
#include "channel.glsl"
#endif
#ifdef SEGMENTED
INOUT(30, vec2, segment_back); // [jobs, pixels of a tile] (transmittance, light from behind)
#ifdef CHANNEL
INOUT(31, uvec4, segment_rest); // x: disagreement behind
#endif
#endif

void main() {
    StepUniforms u = step;
    uint jobs = job_count(u);
    uint group = linear_group_id();
    if (group >= jobs) {
        return;
    }
    uint job = interleave(group, jobs);
    uint virtual_tile;
    TileJob t = locate_job(job, u, virtual_tile);
    uint lane = gl_LocalInvocationID.x;
    uint list_start = fetchu(tile_starts, virtual_tile);
    vec2 corner = tile_corner(t, u);

#ifdef SEGMENTED
    uint kept = job * (TILE_WIDTH * TILE_HEIGHT) + lane;
#endif
    float T[ROWS], behind[ROWS], g0[ROWS], g1[ROWS], g2[ROWS];
    uint final_[ROWS];
#ifdef CHANNEL
    uint own[ROWS];                  // what the pixel has
    float weight[ROWS], wrong[ROWS]; // weight of the pixel; disagreement behind, times that weight
#endif
    uint deepest = 0u;
    [[unroll]] for (uint k = 0u; k < ROWS; k++) {
        bool inside = t.x < u.width && t.y0 + k < u.height;
        uint p = inside ? (t.y0 + k) * u.width + t.x : 0u;
        vec3 g = vec3(0.0);
        T[k] = 1.0;
        final_[k] = 0u;
        behind[k] = 0.0;
#ifdef LABELS
        if (t.layer != 0u) {
            uvec2 state = layer_state[layer_pixel(t, k)];
            T[k] = uintBitsToFloat(state.x);
            final_[k] = state.y & LAST_MASK;
            vec4 v = unpack_signs(state.y) * (u.label_weight * u.loss_scale * layer_weights[t.layer]);
            g = v.xyz;
            behind[k] = -u.label_alpha * v.w; // alpha = 1 - T acts like a background of opposite sign
        } else
#endif
        {
            T[k] = fetch4(image, p).w;
            final_[k] = inside ? fetchu(last, p) : 0u;
            g = fetch4(v_image, p).xyz;
            behind[k] = dot(u.background, g);
        }
#ifdef CHANNEL
        own[k] = channel_of_pixel(p, inside, u, weight[k], wrong[k]);
#endif
#ifdef SEGMENTED
        if (SEGMENT + 1u < SEGMENTS) {
            vec2 state = segment_back[kept + k * SUBGROUP_SIZE];
            T[k] = state.x;
            behind[k] = state.y;
#ifdef CHANNEL
            wrong[k] = uintBitsToFloat(segment_rest[kept + k * SUBGROUP_SIZE].x);
#endif
        }
#endif
        g0[k] = g.x;
        g1[k] = g.y;
        g2[k] = g.z;
        deepest = max(deepest, final_[k]);
    }
    deepest = subgroup_max(deepest);

    vec2 centre = vec2(float(TILE_WIDTH), float(TILE_HEIGHT)) * 0.5;
    float qx = t.px - centre.x;
    float qy0 = t.row0 + 0.5 * float(ROWS - 1u) - centre.y; // middle of the lane's rows
    const float middle = 0.5 * float(ROWS - 1u);
    uint batches = (deepest + SUBGROUP_SIZE - 1u) / SUBGROUP_SIZE, first = 0u;
#ifdef SEGMENTED
    first = min(SEGMENT * (SEGMENT_LENGTH / SUBGROUP_SIZE), batches);
    batches = min(first + SEGMENT_LENGTH / SUBGROUP_SIZE, batches);
#endif
    for (uint batch = batches; batch > first; batch--) {
        uint base = (batch - 1u) * SUBGROUP_SIZE; // index in the list
        uint count = min(SUBGROUP_SIZE, deepest - base);
        uint at = list_start + min(base + lane, deepest - 1u);
        uint instance = fetchu(instance_from_sorted, at), index = fetchu(splat_from_instance, instance);
        vec4 r0 = fetch4(splats, 3u * index), r1 = fetch4(splats, 3u * index + 1u), r2 = fetch4(splats, 3u * index + 2u);
        TileSplat mine = TileSplat(r0.x - corner.x, r0.y - corner.y, r0.z, r0.w, r1.x, r1.y, vec3(r1.zw, r2.x), 0.0);
#ifdef CHANNEL
        uint carried = channel_of_splat(index, r2.y);
#endif
        float sums[SUMS] = float[SUMS](0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        for (uint back = count; back > 0u; back--) {
            uint j = back - 1u;
            TileSplat s = broadcast(mine, j);
            uint position = base + j + 1u;
            float dx = s.x - t.px;
            float ax = s.lo + s.a * dx * dx, bx = s.b * dx;
            float dy0 = s.y - t.row0;
            float m0 = 0.0, m1 = 0.0, m2 = 0.0, vr = 0.0, vg = 0.0, vb = 0.0;
#ifdef CHANNEL
            uint carried_j = subgroup_shuffle(carried, j);
            float ml = 0.0;
#endif
            [[unroll]] for (uint k = 0u; k < ROWS; k++) {
                float dy = dy0 - float(k);
                precise float e = ax + dy * (bx + s.c * dy);
                float raw = exp2(max(e, -20.0));
                float alpha = min(ALPHA_MAX, raw);
                alpha = e < LOG2_ALPHA_MIN || position > final_[k] ? 0.0 : alpha;
                float light = s.colour.x * g0[k] + s.colour.y * g1[k] + s.colour.z * g2[k];
                T[k] = T[k] / (1.0 - alpha);
                float w = alpha * T[k];
                float difference = light - behind[k];
                float p = raw >= ALPHA_MAX ? 0.0 : w * difference;
                behind[k] += alpha * difference;
                float y = float(k) - middle;
                m0 += p;
                m1 += p * y;
                m2 += p * (y * y);
                vr += w * g0[k];
                vg += w * g1[k];
                vb += w * g2[k];
#ifdef CHANNEL
                float more = differs(own[k], carried_j, weight[k]) - wrong[k];
                ml += raw >= ALPHA_MAX ? 0.0 : w * more;
                wrong[k] += alpha * more;
#endif
            }
            float my = m1 + qy0 * m0, myy = m2 + qy0 * (2.0 * m1 + qy0 * m0);
            // Values 0 to 9: six moments, the colour, the channel.
#ifndef CHANNEL
            float ml = vb;
#endif
            add_transposed(vec3(m0, my, my * qx), vec3(m0 * qx, m0 * qx * qx, myy), vec2(vr, vb), vec2(vg, ml), j, sums);
        }
        return_sums(sums);
        if (lane < count) {
            write_record(instance, vec2(mine.x, mine.y), vec3(mine.a, mine.b, mine.c), sums, u.stamp);
        }
    }
#ifdef SEGMENTED
    if (SEGMENT > 0u) {
        [[unroll]] for (uint k = 0u; k < ROWS; k++) {
            segment_back[kept + k * SUBGROUP_SIZE] = vec2(T[k], behind[k]);
#ifdef CHANNEL
            segment_rest[kept + k * SUBGROUP_SIZE] = uvec4(floatBitsToUint(wrong[k]), 0u, 0u, 0u);
#endif
        }
        return;
    }
#endif
#ifdef DISAGREEMENT
    write_sum(t.tile, wrong);
#endif
}
