#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
layout(constant_id = 17) const uint COUNTS = 0; // 1: count contributing pairs
// blend_forward — alpha-blend one tile of one layer front to back.
// Work:    one subgroup (= workgroup) per tile: the scene's tiles, then (variant labels) the occupied layer tiles.
// Reads:   step, counters; tile_starts, tile_ends [layers * T]; instance_from_sorted [I]; splat_from_instance [I];
//          splats [V,3] variant labels: layer_tiles; target [P] RGBA8; view_labels [P]; layer_occluders;
//          label_from_layer; layer_weights; gaussian_from_splat [V]
// Writes:  image [P] linear RGB over the background, w = final transmittance; last [P] = 1 + index of the last splat
//          that contributed, in the tile's list (0: none); variant main: main_gaussian [P] (NO_SPLAT: none) and
//          main_weight_depth [P] (weight, weighted sum of z); variant labels: layer_state [layer tiles, pixels of a
//          tile] (transmittance, last and signs of the loss gradient), layer_loss [layer tiles] (label loss minus the
//          loss of an empty picture; the host adds the loss of empty tiles, which no pass processes), label_keys [N]
//          (integer maximum, any order)
// Math:    LabelGS eq. 5; alpha <= ALPHA_MAX; a pair counts where alpha >= ALPHA_MIN, tested on the exponent; a pixel
//          stops before a splat that would take its transmittance below TRANSMITTANCE_MIN (3DGS).
//          Layers: eq. 8 and 9, black background, and an L1 term of alpha against the mask; the L1 gradient of a layer
//          is local to the pixel, so its sign is stored here. Lift: eq. 6 and 7.
// Order:   fixed, bitwise reproducible.
// Mirror:  src/reference/blend.rs::blend_forward

READ1(0, StepUniforms, step);
INOUT1(1, Counters, counters);
FETCHU(2, tile_starts);
FETCHU(3, tile_ends);
FETCHU(4, instance_from_sorted);
FETCH4(5, splats);
FETCHU(19, splat_from_instance);
WRITE(6, vec4, image);
WRITE(7, uint, last);
#ifdef MAIN
WRITE(8, uint, main_gaussian);
WRITE(9, vec2, main_weight_depth);
FETCHU(10, gaussian_from_splat);
#endif
#ifdef LABELS
FETCHU(8, layer_tiles);
FETCHC(9, target);
FETCHU(10, view_labels);
READ(11, uint, layer_occluders);
READ(12, uint, label_from_layer);
FETCHU(13, gaussian_from_splat);
WRITE(14, uvec2, layer_state);
WRITE(15, float, layer_loss);
INOUT(16, uint, label_keys);
FETCHU(17, layer_from_label);
READ(18, float, layer_weights);
#endif

#ifdef SEGMENTED
INOUT(30, vec4, segment_colours); // [jobs, pixels of a tile] (colour, transmittance with the sign of `T`)
INOUT(31, uvec4, segment_rest);   // (last, main splat, its weight, depth)
#endif
#include "blend_tile.glsl"
#ifdef LABELS
#include "label_state.glsl"
#include "label_rules.glsl"
#else
const bool REMEMBERS_MAIN = true; // in variants with a main splat
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
    uint list_start = fetchu(tile_starts, virtual_tile), list_end = fetchu(tile_ends, virtual_tile);
#ifdef SEGMENTED
    uint begin = min(list_start + SEGMENT * SEGMENT_LENGTH, list_end);
    uint end = min(begin + SEGMENT_LENGTH, list_end);
    uint kept = job * (TILE_WIDTH * TILE_HEIGHT) + lane;
#else
    uint begin = list_start, end = list_end;
#endif
    vec2 corner = tile_corner(t, u);

    float T[ROWS], cr[ROWS], cg[ROWS], cb[ROWS];
    uint final_[ROWS];
#if defined(MAIN) || defined(LABELS)
    float best[ROWS];
    uint main_[ROWS];
#endif
#ifdef MAIN
    float depth[ROWS];
#endif
    [[unroll]] for (uint k = 0u; k < ROWS; k++) {
        bool inside = t.x < u.width && t.y0 + k < u.height;
#ifdef LABELS
        if (t.layer != 0u && inside) {
            uint p = (t.y0 + k) * u.width + t.x;
            inside = fetchc(target, p).w > 0.5 && !left_out(t.layer, view_label(p), u);
        }
#endif
        T[k] = inside ? 1.0 : -1.0; // positive while the pixel takes splats
        cr[k] = cg[k] = cb[k] = 0.0;
        final_[k] = 0u;
#if defined(MAIN) || defined(LABELS)
        best[k] = 0.0;
        main_[k] = NO_SPLAT;
#endif
#ifdef MAIN
        depth[k] = 0.0;
#endif
#ifdef SEGMENTED
        if (SEGMENT > 0u) {
            vec4 colour = segment_colours[kept + k * SUBGROUP_SIZE];
            uvec4 rest = segment_rest[kept + k * SUBGROUP_SIZE];
            cr[k] = colour.x;
            cg[k] = colour.y;
            cb[k] = colour.z;
            T[k] = colour.w;
            final_[k] = rest.x;
#if defined(MAIN) || defined(LABELS)
            main_[k] = rest.y;
            best[k] = uintBitsToFloat(rest.z);
#endif
#ifdef MAIN
            depth[k] = uintBitsToFloat(rest.w);
#endif
        }
#endif
    }

    uint walked = 0u, contributing = 0u;
    for (uint base = begin; base < end; base += SUBGROUP_SIZE) {
        float live = T[0];
        [[unroll]] for (uint k = 1u; k < ROWS; k++) {
            live = max(live, T[k]);
        }
        if (subgroup_max(live) <= 0.0) {
            break;
        }
        uint count = min(SUBGROUP_SIZE, end - base);
        walked += count;
        uint index = fetchu(splat_from_instance, fetchu(instance_from_sorted, min(base + lane, end - 1u)));
        vec4 r0 = fetch4(splats, 3u * index), r1 = fetch4(splats, 3u * index + 1u), r2 = fetch4(splats, 3u * index + 2u);
        TileSplat mine = TileSplat(r0.x - corner.x, r0.y - corner.y, r0.z, r0.w, r1.x, r1.y, vec3(r1.zw, r2.x), r2.y);
        for (uint j = 0u; j < count; j++) {
            TileSplat s = broadcast(mine, j);
#if defined(MAIN) || defined(LABELS)
            uint id = subgroup_shuffle(index, j);
#endif
            uint position = base - list_start + j + 1u;
            float dx = s.x - t.px;
            float ax = s.lo + s.a * dx * dx, bx = s.b * dx;
            float dy0 = s.y - t.row0;
            [[unroll]] for (uint k = 0u; k < ROWS; k++) {
                float dy = dy0 - float(k);
                precise float e = ax + dy * (bx + s.c * dy);
                float alpha = min(ALPHA_MAX, exp2(max(e, -20.0)));
                alpha = e < LOG2_ALPHA_MIN ? 0.0 : alpha;
                precise float next = T[k] * (1.0 - alpha);
                bool takes = next >= TRANSMITTANCE_MIN;
                float w = takes ? alpha * T[k] : 0.0;
                cr[k] += s.colour.x * w;
                cg[k] += s.colour.y * w;
                cb[k] += s.colour.z * w;
                T[k] = takes ? next : -abs(T[k]);
                final_[k] = w > 0.0 ? position : final_[k];
                contributing += COUNTS != 0u && w > 0.0 ? 1u : 0u;
#ifdef MAIN
                depth[k] += s.z * w;
#endif
#if defined(MAIN) || defined(LABELS)
                bool main_now = REMEMBERS_MAIN && w > best[k];
                best[k] = main_now ? w : best[k];
                main_[k] = main_now ? id : main_[k];
#endif
            }
        }
    }
    if (lane == 0u && walked > 0u) {
        if (in_first_half(group, jobs)) {
            atomicAdd(counters.walked_first, walked);
        } else {
            atomicAdd(counters.walked_second, walked);
        }
    }
    if (COUNTS != 0u) {
        atomicAdd(counters.contributing_pairs, contributing);
    }
#ifdef SEGMENTED
    if (SEGMENT + 1u < SEGMENTS) {
        [[unroll]] for (uint k = 0u; k < ROWS; k++) {
            segment_colours[kept + k * SUBGROUP_SIZE] = vec4(cr[k], cg[k], cb[k], T[k]);
            uvec4 rest = uvec4(final_[k], NO_SPLAT, 0u, 0u);
#if defined(MAIN) || defined(LABELS)
            rest.yz = uvec2(main_[k], floatBitsToUint(best[k]));
#endif
#ifdef MAIN
            rest.w = floatBitsToUint(depth[k]);
#endif
            segment_rest[kept + k * SUBGROUP_SIZE] = rest;
        }
        return;
    }
#endif

#ifdef LABELS
    if (t.layer != 0u) {
        vec3 colour[ROWS];
        [[unroll]] for (uint k = 0u; k < ROWS; k++) {
            colour[k] = vec3(cr[k], cg[k], cb[k]);
        }
        finish_layer(t, T, colour, final_, u);
        return;
    }
#endif
    [[unroll]] for (uint k = 0u; k < ROWS; k++) {
        if (t.x < u.width && t.y0 + k < u.height) {
            uint p = (t.y0 + k) * u.width + t.x;
            float transmittance = abs(T[k]);
            image[p] = vec4(vec3(cr[k], cg[k], cb[k]) + transmittance * u.background, transmittance);
            last[p] = final_[k];
#ifdef MAIN
            main_gaussian[p] = main_[k] == NO_SPLAT ? NO_SPLAT : fetchu(gaussian_from_splat, main_[k]);
            main_weight_depth[p] = vec2(best[k], depth[k]);
#endif
#ifdef LABELS
            if (REMEMBERS_MAIN && best[k] >= u.label_threshold) {
                lift(p, main_[k], best[k], u);
            }
#endif
        }
    }
}
