#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
// group_forward — blend_forward on GPUs: alpha-blend one tile of one layer front to back.
// Work:    one workgroup per tile, jobs as in blend_forward; a lane has TILE_PIXELS / GROUP_LANES pixels. The scene's
//          lists of more than LONG_LIST splats get one workgroup per chunk, which come first; the last to finish
//          completes the tile. Object layers, pictures (main) and steps that record main splats (LIFT) have no such
//          lists. Variant products (group_products) runs before: it finds the transmittance of each chunk of a long
//          list but the last, with which the chunks can be processed at once.
// Reads:   as blend_forward; variant disagreement: target [P]; view_labels [P]; labels [N]; gaussian_from_splat [V];
//          variant depth: depths [P]; except in variant main: long_chunks [counters.long_chunk_count], first_lists
//          [counters.first_list_count]; chunk_states, w, what a chunk of a long list lets through (products)
// Writes:  variant products: chunk_states, w: the transmittance of a chunk, 0 if it is below TRANSMITTANCE_MIN; in the
//          tiles of long lists, last and the w of image: 0; chunk_jobs: 0 in their first slots;
//          others: as blend_forward; except in variant main: chunk_jobs [slots], the job of each chunk with work for
//          group_backward; chunk_states [states, pixels of a tile] at the end of each chunk but the last: the light
//          from behind and the transmittance; variants disagreement, depth: chunk_channel [slots, pixels of a tile],
//          the channel from behind; variant disagreement: disagreement [T]
// Math:    as blend_forward. The light behind a chunk is the sum of everything behind it, over the transmittance there:
//          no term is negative, so nothing cancels, unlike differences between the front and the whole. T = (T at the
//          chunk's start) (product within the chunk); a pixel stops where that would go below TRANSMITTANCE_MIN. Both
//          are products in a fixed order that fall from splat to splat, so a pixel stops in the one chunk that starts
//          above and ends below.
// Order:   fixed, bitwise reproducible, regardless of what is skipped, which workgroup is first, and how many process a
//          list.
// Mirror:  src/reference/blend.rs::blend_forward, disagreement.rs::disagreement

#include "forward_bindings.glsl"
#define BATCH_MOST GROUP_LANES
#define EXCHANGE_LANES 256u
#include "group_tile.glsl"
#ifdef LABELS
#include "label_state.glsl"
#include "label_rules.glsl"
#endif
shared uint staged_index[BATCH];
#include "live.glsl"
#include "forward_work.glsl"
#include "chunks.glsl"

void main() {
    StepUniforms u = step;
    uint lane = gl_LocalInvocationID.x;
    Work work;
    if (!find_work(u, work)) {
        return;
    }
    TileJob t = work.t;
#ifdef PRODUCTS
    if (work.chunk == 0u) {
        clear_list(work, u);
    }
    if (work.to == work.end) {
        return; // nothing is behind the last chunk
    }
#endif
    float p[ROWS], T[ROWS];         // product within the chunk, negative where the pixel takes no more; T at its start
    vec3 light[ROWS], before[ROWS]; // of the chunk, over that T; and of those before it
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
            uint pixel = (t.y0 + k) * u.width + t.x;
            inside = fetchc(target, pixel).w > 0.5 && !left_out(t.layer, view_label(pixel), u);
        }
#endif
        p[k] = inside ? 1.0 : -1.0;
        T[k] = 1.0;
#ifndef PRODUCTS
        start_part(work, k, p[k], T[k]);
#endif
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
    }
    barrier();

    bool is_live = true;
    uint walked = 0u, contributing = 0u, kept = 0u, tested = 0u, hit = 0u;
    for (uint base = work.from; base < work.to; base += BATCH) {
        if (!some_live(subgroup_max(most_of(p)) > 0.0, is_live)) {
            break;
        }
        uint count = min(BATCH, work.to - base);
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
            if (COUNTS != 0u) {
                tested += is_live ? min(count - c, SUBGROUP_SIZE) : 0u;
                hit += bitCount(hits.x) + bitCount(hits.y);
            }
            while (some(hits)) {
                uint j = c + take_first(hits), position = base - work.start + j + 1u;
                vec4 r0 = staged_0[j], r1 = staged_1[j], r2 = staged_2[j];
                float dx = r0.x - t.px;
                float ax = r1.y + r0.z * dx * dx, bx = r0.w * dx;
                float dy0 = r0.y - t.row0;
                [[unroll]] for (uint k = 0u; k < ROWS; k++) {
                    float dy = dy0 - float(k);
                    precise float e = ax + dy * (bx + r1.x * dy);
                    float alpha = min(ALPHA_MAX, exp2(max(e, -20.0)));
                    alpha = e < LOG2_ALPHA_MIN ? 0.0 : alpha;
                    precise float q = p[k] * (1.0 - alpha);
                    precise float next = T[k] * q;
                    bool takes = next >= TRANSMITTANCE_MIN;
                    // Named, because a conditional operand that computes becomes a branch on some compilers.
                    float taken = alpha * p[k], stopped = -abs(p[k]);
                    float w = takes ? taken : 0.0;
                    light[k] += vec3(r1.zw, r2.x) * w;
                    p[k] = takes ? q : stopped;
                    final_[k] = w > 0.0 ? position : final_[k];
                    contributing += COUNTS != 0u && w > 0.0 ? 1u : 0u;
#ifdef ONE_IS_MAIN
                    float whole = T[k] * w;
                    bool main_now = REMEMBERS_MAIN && whole > best[k];
                    best[k] = main_now ? whole : best[k];
                    main_[k] = main_now ? staged_index[j] : main_[k];
#endif
#ifdef MAIN
                    depth[k] += r2.y * whole;
#endif
#ifdef CHANNEL
                    channel.sum[k] += w * differs(channel.own[k], staged_channel[j], channel.weight[k]);
#endif
                }
            }
        }
#ifndef PRODUCTS
        uint behind = base + BATCH;
        if (behind < work.to && (behind - work.start) % CHUNK_LENGTH == 0u) {
            [[unroll]] for (uint k = 0u; k < ROWS; k++) {
                close_chunk(k, p[k], T[k], light[k], channel);
                before[k] += light[k];
                keep(work, kept, k, light[k], T[k], channel);
            }
            kept++;
        }
#endif
    }
#ifdef PRODUCTS
    [[unroll]] for (uint k = 0u; k < ROWS; k++) {
        chunk_states[state_of(work, work.chunk, k)].w = max(p[k], 0.0);
    }
#else
    if (lane == 0u && walked > 0u) {
        atomicAdd(counters.walked_first, walked);
    }
    if (COUNTS != 0u) {
        atomicAdd(counters.contributing_pairs, contributing);
        if (subgroup_lane() == 0u) {
            atomicAdd(counters.tested_splats, tested);
            atomicAdd(counters.hit_splats, hit);
        }
    }

    if (!finish_walk(work, kept, p, T, light, before, final_, u, channel)) {
        return;
    }
    uint furthest = 0u;
    vec3 background = t.layer == 0u ? u.background : vec3(0.0);
    [[unroll]] for (uint k = 0u; k < ROWS; k++) {
        furthest = max(furthest, final_[k]);
        before[k] += light[k];
        precise vec3 back = T[k] * background, behind = light[k] + back;
        look_behind(work, kept, k, behind, T[k], channel);
    }
    list_chunks(work, furthest);
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
            uint pixel = (t.y0 + k) * u.width + t.x;
            image[pixel] = vec4(before[k] + T[k] * background, T[k]);
            last[pixel] = final_[k];
#ifdef MAIN
            main_gaussian[pixel] = main_[k] == NO_SPLAT ? NO_SPLAT : fetchu(gaussian_from_splat, main_[k]);
            main_weight_depth[pixel] = vec2(best[k], depth[k]);
#endif
#ifdef LABELS
            if (REMEMBERS_MAIN && best[k] >= u.label_threshold) {
                lift(pixel, main_[k], best[k], u);
            }
#endif
        }
    }
#endif
}
