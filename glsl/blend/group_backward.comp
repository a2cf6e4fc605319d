#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
#include "record.glsl"
// group_backward — blend_backward on GPUs: process one chunk of a tile's list back to front; write a gradient record
//                  per (splat, tile) pair.
// Work:    one workgroup per chunk, a slot of chunk_jobs; a lane has TILE_PIXELS / GROUP_LANES pixels.
// Reads:   as blend_backward; counters; chunk_jobs [slots]; chunk_states [states, pixels of a tile];
//          variants disagreement, depth: chunk_channel [slots, pixels of a tile]
// Writes:  v_instances_a, _b, _c [I] as blend_backward; pairs that touch no pixel have no record
// Math:    as blend_backward; a chunk starts with the transmittance and the light behind it.
// Order:   fixed, bitwise reproducible: sums of a subgroup by a butterfly, then over subgroups in order.
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
READ1(16, Counters, counters);
READ(17, uint, chunk_jobs);
READ(18, vec4, chunk_states);
layout(constant_id = 15) const uint GROUP_LANES = 64;
#ifdef LABELS
FETCHU(12, layer_tiles);
READ(13, uvec2, layer_state);
READ(14, float, layer_weights);
#endif
#ifdef DISAGREEMENT
FETCHC(11, target);
FETCHU(12, view_labels);
FETCHU(13, labels);
FETCHU(14, gaussian_from_splat);
#endif
#ifdef DEPTH
READ(11, float, depths);
#endif
#if defined(DISAGREEMENT) || defined(DEPTH)
#define CHANNEL
#define NO_SUM // the forward walk has it
READ(19, float, chunk_channel);
#endif
#define BATCH_MOST SUBGROUP_SIZE
#define EXCHANGE_LANES 256u
#include "group_tile.glsl"
#ifdef LABELS
#include "label_state.glsl"
#endif
#ifdef CHANNEL
#include "channel.glsl"
shared uint staged_channel[BATCH];
#endif
#include "group_sums.glsl"
#include "moments.glsl"
shared uint staged_instance[BATCH];
shared uvec2 hits_in[SUBGROUPS];
shared uint deepest;

// Sums the staged splat of a lane over the subgroups that it touches, and writes its record.
void finish(uint lane, uint stamp) {
    float o[SUMS] = float[SUMS](0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    bool is_hit = false;
    for (uint s = 0u; s < SUBGROUPS; s++) {
        uint bits = lane < 32u ? hits_in[s].x : hits_in[s].y;
        if ((bits >> (lane & 31u) & 1u) != 0u) {
            is_hit = true;
            [[unroll]] for (uint v = 0u; v < SUMS; v++) {
                o[v] += sums_of[(s * SUBGROUP_SIZE + lane) * SUM_PITCH + v];
            }
        }
    }
    if (!is_hit) {
        return;
    }
    vec4 r0 = staged_0[lane];
    write_record(staged_instance[lane], r0.xy, vec3(r0.zw, staged_1[lane].x), o, stamp);
}

void main() {
    StepUniforms u = step;
    uint jobs = job_count(u), lane = gl_LocalInvocationID.x;
    uint slots = counters.instance_count / CHUNK_LENGTH + jobs, slot = linear_group_id();
    if (slot >= slots) {
        return;
    }
    slot = TURNED != 0u ? slots - 1u - slot : slot;
    uint work = chunk_jobs[slot], job = work & ~LAST_CHUNK;
    if (work == NO_CHUNK) {
        return;
    }
    bool is_last = (work & LAST_CHUNK) != 0u;
    uint virtual_tile;
    TileJob t = locate_job(job, u, virtual_tile);
    uint start = fetchu(tile_starts, virtual_tile), state = start / CHUNK_LENGTH, chunk = slot - state - job;
    state = (state + chunk) * TILE_PIXELS;

    float T[ROWS], behind[ROWS], g0[ROWS], g1[ROWS], g2[ROWS];
    uint final_[ROWS];
#ifdef CHANNEL
    uint has[ROWS];                  // what the pixel has
    float weight[ROWS], wrong[ROWS]; // weight of the pixel; disagreement behind, times that weight
#endif
    uint furthest = 0u;
    [[unroll]] for (uint k = 0u; k < ROWS; k++) {
        bool inside = t.x < u.width && t.y0 + k < u.height;
        uint p = inside ? (t.y0 + k) * u.width + t.x : 0u;
        vec3 g = vec3(0.0);
        float back = 0.0; // what is behind all splats, besides light
#ifdef LABELS
        if (t.layer != 0u) {
            uvec2 packed = layer_state[layer_pixel(t, k)];
            T[k] = uintBitsToFloat(packed.x);
            final_[k] = packed.y & LAST_MASK;
            vec4 v = unpack_signs(packed.y) * (u.label_weight * u.loss_scale * layer_weights[t.layer]);
            g = v.xyz;
            back = -u.label_alpha * v.w; // alpha = 1 - T acts like a background of opposite sign
            behind[k] = back;
        } else
#endif
        {
            T[k] = fetch4(image, p).w;
            final_[k] = inside ? fetchu(last, p) : 0u;
            g = fetch4(v_image, p).xyz;
            behind[k] = dot(u.background, g);
        }
#ifdef CHANNEL
        has[k] = channel_of_pixel(p, inside, u, weight[k], wrong[k]);
#endif
        if (!is_last) {
            vec4 at_end = chunk_states[state + tile_pixel(t, k)];
            behind[k] = dot(at_end.xyz, g) + back * (T[k] / at_end.w);
            T[k] = at_end.w;
#ifdef CHANNEL
            wrong[k] = chunk_channel[slot * TILE_PIXELS + tile_pixel(t, k)];
#endif
        }
        g0[k] = g.x;
        g1[k] = g.y;
        g2[k] = g.z;
        furthest = max(furthest, final_[k]);
    }
    furthest = subgroup_max(furthest);
    if (lane == 0u) {
        deepest = 0u;
    }
    barrier();
    if (subgroup_lane() == 0u) {
        atomicMax(deepest, furthest);
    }
    barrier();

    vec2 centre = vec2(float(TILE_WIDTH), float(TILE_HEIGHT)) * 0.5;
    float qx = t.px - centre.x;
    float qy0 = t.row0 + 0.5 * float(ROWS - 1u) - centre.y; // middle of the lane's rows
    const float middle = 0.5 * float(ROWS - 1u);
    uint begin = chunk * CHUNK_LENGTH, end = min(begin + CHUNK_LENGTH, deepest); // in the list
    for (uint batches = (end - begin + BATCH - 1u) / BATCH; batches-- > 0u;) {
        uint base = begin + batches * BATCH, count = min(BATCH, end - base);
        if (lane < count) {
            uint instance = fetchu(instance_from_sorted, start + base + lane), index = fetchu(splat_from_instance, instance);
            staged_instance[lane] = instance;
            stage(lane, index, tile_corner(t, u));
#ifdef CHANNEL
            staged_channel[lane] = channel_of_splat(index, staged_2[lane].y);
#endif
        }
        barrier();
        uint own = min(subgroup_lane(), count - 1u);
        uvec2 hits = hits_of(base + own < furthest && touches(own), count);
        if (subgroup_lane() == 0u) {
            hits_in[subgroup_id()] = hits;
        }
        while (some(hits)) {
            uint j = take_last(hits), position = base + j + 1u;
            vec4 r0 = staged_0[j], r1 = staged_1[j];
            float blue = staged_2[j].x;
            float dx = r0.x - t.px;
            float ax = r1.y + r0.z * dx * dx, bx = r0.w * dx;
            float dy0 = r0.y - t.row0;
            float m0 = 0.0, m1 = 0.0, m2 = 0.0, vr = 0.0, vg = 0.0, vb = 0.0;
#ifdef CHANNEL
            float ml = 0.0;
#endif
            [[unroll]] for (uint k = 0u; k < ROWS; k++) {
                float dy = dy0 - float(k);
                precise float e = ax + dy * (bx + r1.x * dy);
                float raw = exp2(max(e, -20.0));
                float alpha = min(ALPHA_MAX, raw);
                // Named, because a conditional operand that computes becomes a branch on some compilers.
                bool is_faint = e < LOG2_ALPHA_MIN, is_behind = position > final_[k], is_opaque = raw >= ALPHA_MAX;
                alpha = is_faint || is_behind ? 0.0 : alpha;
                float light = r1.z * g0[k] + r1.w * g1[k] + blue * g2[k];
                T[k] = T[k] / (1.0 - alpha);
                float w = alpha * T[k];
                float difference = light - behind[k], moved = w * difference;
                float p = is_opaque ? 0.0 : moved;
                behind[k] += alpha * difference;
                float y = float(k) - middle;
                m0 += p;
                m1 += p * y;
                m2 += p * (y * y);
                vr += w * g0[k];
                vg += w * g1[k];
                vb += w * g2[k];
#ifdef CHANNEL
                float more = differs(has[k], staged_channel[j], weight[k]) - wrong[k], of_channel = w * more;
                ml += is_opaque ? 0.0 : of_channel;
                wrong[k] += alpha * more;
#endif
            }
            float my = m1 + qy0 * m0, myy = m2 + qy0 * (2.0 * m1 + qy0 * m0);
            // Values 0 to 9: six moments, the colour, the channel.
#ifndef CHANNEL
            float ml = vb;
#endif
            vec3 sums = transposed(vec3(m0, my, my * qx), vec3(m0 * qx, m0 * qx * qx, myy), vec2(vr, vb), vec2(vg, ml),
                subgroup_lane());
            put_sums(subgroup_id() * SUBGROUP_SIZE + j, sums);
        }
        barrier();
        if (lane < count) {
            finish(lane, u.stamp);
        }
        barrier();
    }
}
