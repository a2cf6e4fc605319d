#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
#include "gaussian.glsl"
#include "projection.glsl"
#include "sh.glsl"
#include "record.glsl"
#include "ellipse.glsl"
#include "cull.glsl"
#include "near.glsl"
#include "moments_store.glsl"
// project_visible — cull, then project_forward, on GPUs: list, project and colour the visible Gaussians in model order,
//                   and count the tiles of each.
// Work:    a partition of VISIBLE_LANES times VISIBLE_ITEMS Gaussians per workgroup. The visible Gaussians, and then
//          their tile rows, are redistributed among the invocations, so that none has to wait.
// Reads:   step; means, scales, quats, sh0 [N]; sh1 [N,2], sh2 [N,4], sh3 [N,5];
//          variant labels: labels [N], layer_from_label; variant lazy: moments [N], touched_at [N], missed
// Writes:  splats [V,3] (record.glsl); tiles_touched [V] over all layers; gaussian_from_splat [V]; keys_out [V]: bits
//          of z above those of the near plane, which have the same order; splat_from_gaussian [N];
//          counters.visible_count and dispatch_args; counters.broken_* and unprojected_* (integer atomics) as cull and
//          project_forward; look_back, in variant sweep also histograms of the digits of the keys;
//          variant lazy: densify_stats [N], with MARKS_NEAR as mark_near
// Math:    as cull and project_forward.
// Order:   exact integers, equal in every run.
// Mirror:  project.rs::cull, project.rs::project_forward, scan.rs::compact, tile.rs::row_interval, densify.rs::is_near

layout(constant_id = 11) const uint SH_DEGREE = 3;
layout(local_size_x = VISIBLE_LANES) in;
READ1(0, StepUniforms, step);
INOUT1(1, Counters, counters);
FETCH4(3, means);
FETCH4(4, scales);
FETCH4(5, quats);
FETCH4(6, sh0);
FETCH4(7, sh1);
FETCH4(8, sh2);
FETCH4(9, sh3);
WRITE(10, vec4, splats);
WRITE(11, uint, tiles_touched);
WRITE(12, uint, splat_from_gaussian);
#ifdef LABELS
FETCHU(13, labels);
FETCHU(14, layer_from_label);
#endif
#ifdef LAZY
READ_MOMENTS(15, 22, means);
READ_MOMENTS(16, 23, scales);
READ_MOMENTS(17, 24, quats);
READ_MOMENTS(18, 25, sh0);
READ_MOMENTS(19, 26, sh1);
READ_MOMENTS(20, 27, sh2);
READ_MOMENTS(21, 28, sh3);
FETCHU(29, touched_at);
READ(30, uvec4, missed);
INOUT(35, vec2, densify_stats);
layout(constant_id = 25) const uint MARKS_NEAR = 0;
#endif
WRITE(31, uint, keys_out);
WRITE(32, uint, gaussian_from_splat);
INOUT(33, uint, look_back);
WRITE(34, uint, dispatch_args);
#ifdef SWEEP
#include "digit_counts.glsl"
#endif
#define plane4(name, e) fetch4(name, e)
#include "caught_up.glsl"
#ifdef LAZY
EACH_PLANE(CAUGHT_UP)
#include "drift.glsl"
#endif
#include "splat.glsl"
#include "count_args.glsl"
#define WALKERS VISIBLE_LANES
#include "rows.glsl"
#include "look_back.glsl"

const uint WORDS = VISIBLE_LANES * VISIBLE_ITEMS_MOST / 32u;
shared uint is_visible[WORDS];     // a bit for each Gaussian of the partition
shared uint visible_before[WORDS]; // visible ones in the words before
shared uint tiles[WALKERS];

// As depth_key. Only the workgroup that owns the Gaussian takes note of it.
uint key_of(StepUniforms u, uint i, bool is_own) {
    look_up_trained(u, i);
#ifdef LAZY
    if (is_late && !may_count(u, fetch4(means, i), fetch4(scales, i).xyz, is_own && MARKS_NEAR != 0u)) {
        return KEY_INVISIBLE;
    }
#endif
    vec4 mean = value4(means, i);
    vec3 s = value4(scales, i).xyz;
    if (is_own && is_broken(mean, s)) {
        atomicAdd(counters.broken_count, 1u);
        atomicMin(counters.broken_first, i);
    }
#ifdef LAZY
    if (is_own && MARKS_NEAR != 0u && i < u.trained_count && is_near(u, mean.xyz, s)) {
        densify_stats[i] = vec2(0.0, STAT_NEAR);
    }
#endif
    return depth_key(u, mean, s);
}

// Sets is_visible and visible_before by a bit of each lane and item.
uint count_visible(uint flags) {
    uint lane = gl_LocalInvocationIndex;
    barrier(); // all have read what an earlier call returned
    for (uint w = lane; w < WORDS; w += VISIBLE_LANES) {
        is_visible[w] = 0u;
    }
    barrier();
    for (uint k = 0u; k < VISIBLE_ITEMS; k++) {
        uint at = k * VISIBLE_LANES + lane;
        atomicOr(is_visible[at / 32u], (flags >> k & 1u) << (at & 31u));
    }
    barrier();
    for (uint w = lane; w < WORDS; w += VISIBLE_LANES) {
        uint sum = 0u;
        for (uint before = 0u; before < WORDS; before++) {
            sum += before < w ? bitCount(is_visible[before]) : 0u;
        }
        visible_before[w] = sum;
    }
    barrier();
    return visible_before[WORDS - 1u] + bitCount(is_visible[WORDS - 1u]);
}

uint look_recount(uint part) {
    uint flags = 0u;
    for (uint k = 0u; k < VISIBLE_ITEMS; k++) {
        uint i = (part * VISIBLE_ITEMS + k) * VISIBLE_LANES + gl_LocalInvocationIndex;
        flags |= i < step.gaussian_count && key_of(step, i, false) != KEY_INVISIBLE ? 1u << k : 0u;
    }
    return count_visible(flags);
}

// Index in the partition of its n-th visible Gaussian.
uint nth_visible(uint n) {
    uint word = 0u;
    [[unroll]] for (uint jump = WORDS / 2u; jump > 0u; jump /= 2u) {
        word += visible_before[word + jump] <= n ? jump : 0u;
    }
    uint bits = is_visible[word], left = n - visible_before[word], bit = 0u;
    [[unroll]] for (uint width = 16u; width > 0u; width /= 2u) {
        uint below = bitCount(bits & ((1u << width) - 1u));
        bool is_above = left >= below;
        left -= is_above ? below : 0u;
        bits = is_above ? bits >> width : bits;
        bit += is_above ? width : 0u;
    }
    return word * 32u + bit;
}

// Counts the tiles of this invocation's splat, which may have no rows.
uint count_tiles(Ellipse e) {
    uint lane = gl_LocalInvocationIndex, unused;
    tiles[lane] = 0u;
    uint rows = share_rows(e, 0u, unused);
    for (uint row = lane; row < rows; row += WALKERS) {
        uint splat = entry_at(0u, row);
        atomicAdd(tiles[splat], tiles_of_row(step, ellipse_of(splat), row - starts[splat]).y);
    }
    barrier();
    return tiles[lane];
}

void main() {
    uint lane = gl_LocalInvocationIndex, n = step.gaussian_count, flags = 0u;
    bool has_failed;
    uint part = look_partition(has_failed), base = part * VISIBLE_ITEMS * VISIBLE_LANES;
    if (base >= n || has_failed) {
        return;
    }
    for (uint k = 0u; k < VISIBLE_ITEMS; k++) {
        uint i = base + k * VISIBLE_LANES + lane;
        if (i < n && key_of(step, i, true) != KEY_INVISIBLE) {
            flags |= 1u << k;
        } else if (i < n) {
            splat_from_gaussian[i] = NO_SPLAT;
        }
    }
    uint own = count_visible(flags), first = look_before(part, own);
    if (part == visible_partitions(n) - 1u && lane == 0u) {
        put_visible(first + own);
    }
    // A partition that was counted instead of a late one has overwritten the bits.
    count_visible(flags);
#ifdef SWEEP
    clear_bins(lane, VISIBLE_LANES);
    barrier();
#endif
    for (uint from = 0u; from < own; from += VISIBLE_LANES) {
        uint r = from + lane, s = first + r, i = 0u;
        Ellipse e;
        e.rows = 0u;
        if (r < own) {
            i = base + nth_visible(r);
            float z;
            e = project_splat(step, s, i, z);
            uint nearest = floatBitsToUint(step.near);
            uint key = min(max(floatBitsToUint(z), nearest) - nearest, (1u << DEPTH_BITS) - 1u);
            keys_out[s] = key;
            gaussian_from_splat[s] = i;
#ifdef SWEEP
            count_digits(key);
#endif
        }
        uint touched = count_tiles(e);
        if (r < own) {
#ifdef LABELS
            touched *= fetchu(layer_from_label, fetchu(labels, i)) != 0u ? 2u : 1u;
#endif
            tiles_touched[s] = touched;
        }
    }
#ifdef SWEEP
    barrier();
    add_bins(lane, VISIBLE_LANES);
#endif
}
