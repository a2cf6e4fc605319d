#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
// group_forward — blend_forward on cards: alpha-blend one tile of one layer front to back.
// Work:    one workgroup per tile, jobs as in blend_forward; a lane has TILE_PIXELS / GROUP_LANES pixels.
// Reads:   as blend_forward; variant disagreement: target [P]; view_labels [P]; labels [N]; gaussian_from_splat [V];
//          variant depth: depths [P]
// Writes:  as blend_forward; but for variant main: chunk_jobs [slots], the job of each chunk with work for group_backward;
//          chunk_states [states, pixels of a tile] at the end of each chunk but the last: the light from behind and the
//          transmittance; variants disagreement, depth: chunk_channel [states, pixels of a tile], the channel from behind;
//          variant disagreement: disagreement [T]
// Math:    as blend_forward. The light behind a chunk is a sum of all that is behind it, over the transmittance there: no
//          term is negative, so nothing cancels, as in differences between the front and the whole.
// Order:   fixed, bitwise reproducible, whatever is skipped and whichever workgroup is first.
// Mirror:  src/reference/blend.rs::blend_forward, disagreement.rs::disagreement

READ1(0, StepUniforms, step);
INOUT1(1, Counters, counters);
FETCHU(2, tile_starts);
FETCHU(3, tile_ends);
FETCHU(4, instance_from_sorted);
FETCH4(5, splats);
FETCHU(19, splat_from_instance);
WRITE(6, vec4, image);
WRITE(7, uint, last);
layout(constant_id = 15) const uint GROUP_LANES = 128;
layout(constant_id = 17) const uint COUNTS = 0; // 1: count contributing pairs
#ifdef MAIN
WRITE(8, uint, main_gaussian);
WRITE(9, vec2, main_weight_depth);
FETCHU(10, gaussian_from_splat);
const bool REMEMBERS_MAIN = true;
#else
WRITE(20, uint, chunk_jobs);
INOUT(21, vec4, chunk_states);
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
#ifdef DISAGREEMENT
FETCHC(8, target);
FETCHU(9, view_labels);
FETCHU(10, labels);
FETCHU(11, gaussian_from_splat);
WRITE(12, float, disagreement);
#endif
#ifdef DEPTH
READ(8, float, depths);
#endif
#if defined(DISAGREEMENT) || defined(DEPTH)
#define CHANNEL
INOUT(22, float, chunk_channel);
#endif
#if defined(MAIN) || defined(LABELS)
#define ONE_IS_MAIN
#endif
#define BATCH_MOST GROUP_LANES
#define EXCHANGE_LANES 256u
#include "group_tile.glsl"
#ifdef LABELS
#include "label_state.glsl"
#include "label_rules.glsl"
#endif
#include "chunks.glsl"
shared uint staged_index[BATCH];
shared uint live_subgroups, deepest;

void main() {
    StepUniforms u = step;
    uint jobs = job_count(u);
    uint group = linear_group_id(), lane = gl_LocalInvocationID.x;
    if (group >= jobs) {
        return;
    }
    uint job = TURNED != 0u ? jobs - 1u - group : group;
    uint virtual_tile;
    TileJob t = locate_job(job, u, virtual_tile);
    uint start = fetchu(tile_starts, virtual_tile), end = fetchu(tile_ends, virtual_tile);

    float T[ROWS];
    vec3 light[ROWS], before[ROWS]; // of the chunk, and of those before it
    uint final_[ROWS];
#ifdef ONE_IS_MAIN
    float best[ROWS];
    uint main_[ROWS];
#endif
#ifdef MAIN
    float depth[ROWS];
#endif
    Channel channel;
    [[unroll]] for (uint k = 0u; k < ROWS; k++) {
        bool inside = t.x < u.width && t.y0 + k < u.height;
        begin_channel(inside ? (t.y0 + k) * u.width + t.x : 0u, inside, u, k, channel);
#ifdef LABELS
        if (t.layer != 0u && inside) {
            uint p = (t.y0 + k) * u.width + t.x;
            inside = fetchc(target, p).w > 0.5 && !left_out(t.layer, view_label(p), u);
        }
#endif
        T[k] = inside ? 1.0 : -1.0; // positive while the pixel takes splats
        light[k] = before[k] = vec3(0.0);
        final_[k] = 0u;
#ifdef ONE_IS_MAIN
        best[k] = 0.0;
        main_[k] = NO_SPLAT;
#endif
#ifdef MAIN
        depth[k] = 0.0;
#endif
    }
    if (lane == 0u) {
        live_subgroups = SUBGROUPS;
        deepest = 0u;
    }
    barrier();

    bool is_live = true;
    uint walked = 0u, contributing = 0u, states = start / CHUNK_LENGTH, kept = 0u;
    for (uint base = start; base < end; base += BATCH) {
        float live = T[0];
        [[unroll]] for (uint k = 1u; k < ROWS; k++) {
            live = max(live, T[k]);
        }
        bool still = subgroup_max(live) > 0.0;
        if (is_live && !still && subgroup_lane() == 0u) {
            atomicAdd(live_subgroups, 0xffffffffu);
        }
        is_live = still;
        barrier();
        if (live_subgroups == 0u) {
            break;
        }
        uint count = min(BATCH, end - base);
        walked += count;
        if (lane < count) {
            uint index = fetchu(splat_from_instance, fetchu(instance_from_sorted, base + lane));
            stage(lane, index, tile_corner(t, u));
            staged_index[lane] = index;
#ifdef CHANNEL
            staged_channel[lane] = channel_of_splat(index, staged_2[lane].y);
#endif
        }
        barrier();
        for (uint c = 0u; c < count; c += SUBGROUP_SIZE) {
            uint own = min(c + subgroup_lane(), count - 1u);
            uvec2 hits = hits_of(is_live && touches(own), min(count - c, SUBGROUP_SIZE));
            while (some(hits)) {
                uint j = c + take_first(hits), position = base - start + j + 1u;
                vec4 r0 = staged_0[j], r1 = staged_1[j], r2 = staged_2[j];
                float dx = r0.x - t.px;
                float ax = r1.y + r0.z * dx * dx, bx = r0.w * dx;
                float dy0 = r0.y - t.row0;
                [[unroll]] for (uint k = 0u; k < ROWS; k++) {
                    float dy = dy0 - float(k);
                    precise float e = ax + dy * (bx + r1.x * dy);
                    float alpha = min(ALPHA_MAX, exp2(max(e, -20.0)));
                    alpha = e < LOG2_ALPHA_MIN ? 0.0 : alpha;
                    precise float next = T[k] * (1.0 - alpha);
                    bool takes = next >= TRANSMITTANCE_MIN;
                    float w = takes ? alpha * T[k] : 0.0;
                    light[k] += vec3(r1.zw, r2.x) * w;
                    T[k] = takes ? next : -abs(T[k]);
                    final_[k] = w > 0.0 ? position : final_[k];
                    contributing += COUNTS != 0u && w > 0.0 ? 1u : 0u;
#ifdef MAIN
                    depth[k] += r2.y * w;
#endif
#ifdef ONE_IS_MAIN
                    bool main_now = REMEMBERS_MAIN && w > best[k];
                    best[k] = main_now ? w : best[k];
                    main_[k] = main_now ? staged_index[j] : main_[k];
#endif
#ifdef CHANNEL
                    channel.sum[k] += w * differs(channel.own[k], staged_channel[j], channel.weight[k]);
#endif
                }
            }
        }
        uint behind = base + BATCH;
        if (behind < end && (behind - start) % CHUNK_LENGTH == 0u) {
            [[unroll]] for (uint k = 0u; k < ROWS; k++) {
                before[k] += light[k];
                keep((states + kept) * TILE_PIXELS + tile_pixel(t, k), k, light[k], abs(T[k]), channel);
            }
            kept++;
        }
    }
    if (lane == 0u && walked > 0u) {
        atomicAdd(counters.walked_first, walked);
    }
    if (COUNTS != 0u) {
        atomicAdd(counters.contributing_pairs, contributing);
    }

    uint furthest = 0u;
    vec3 background = t.layer == 0u ? u.background : vec3(0.0);
    [[unroll]] for (uint k = 0u; k < ROWS; k++) {
        furthest = max(furthest, final_[k]);
        before[k] += light[k];
        look_behind(t, states, kept, k, light[k] + abs(T[k]) * background, abs(T[k]), channel);
    }
#ifndef MAIN
    furthest = subgroup_max(furthest);
    if (subgroup_lane() == 0u) {
        atomicMax(deepest, furthest);
    }
    barrier();
    list_chunks(job, start, end, deepest);
#endif
#ifdef LABELS
    if (t.layer != 0u) {
        finish_layer(t, T, before, final_, u);
        return;
    }
#endif
#ifdef DISAGREEMENT
    write_sum(t.tile, channel.sum);
#endif
    [[unroll]] for (uint k = 0u; k < ROWS; k++) {
        if (t.x < u.width && t.y0 + k < u.height) {
            uint p = (t.y0 + k) * u.width + t.x;
            float transmittance = abs(T[k]);
            image[p] = vec4(before[k] + transmittance * background, transmittance);
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
