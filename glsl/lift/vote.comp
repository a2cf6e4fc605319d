#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
#include "blend_tile.glsl"
// vote — sum, for each Gaussian and each label, the blending weights of the Gaussian in the pixels of that label.
// Work:    one subgroup (= workgroup) per tile of the scene, jobs as in blend_forward. One walk counts four labels
//          of the tile; tiles with more labels are processed again (WALK).
// Reads:   step; tile_starts, tile_ends [T]; instance_from_sorted, splat_from_instance [I]; splats [V,3];
//          gaussian_from_splat [V]; view_labels [P] column of each pixel's label, VOTE_NONE for pixels without votes;
//          vote_weights [columns]
// Writes:  votes_low, votes_high [N, columns]: 64 bits, VOTE_ONE for a pixel of weight 1, times the column's weight
// Math:    A[j, k] = sum over pixels v with label k of alpha_j T_j (the sums of FlashSplat; every contributor counts);
//          with ALONE, of alpha_j
// Order:   a tile's sum has a fixed order and is rounded once; the order of integer sums does not matter.
// Mirror:  src/reference/lift.rs::vote

layout(constant_id = 16) const uint ALONE = 0; // 1: each Gaussian as if nothing were in front of it
READ1(0, StepUniforms, step);
FETCHU(1, tile_starts);
FETCHU(2, tile_ends);
FETCHU(3, instance_from_sorted);
FETCH4(4, splats);
FETCHU(5, gaussian_from_splat);
FETCHU(6, view_labels);
READ(7, float, vote_weights);
INOUT(8, uint, votes_low);
INOUT(9, uint, votes_high);
FETCHU(10, splat_from_instance);
#ifdef SEGMENTED
INOUT(30, vec4, segment_colours); // [jobs, pixels of a tile], w: transmittance with the sign of `T`
#endif

const uint LABELS_PER_WALK = 4u;

// The smallest value of all lanes that is above `floor_`, or VOTE_NONE.
uint next_label(uint own[ROWS], uint floor_) {
    uint least = VOTE_NONE;
    [[unroll]] for (uint k = 0u; k < ROWS; k++) {
        least = own[k] >= floor_ ? min(least, own[k]) : least;
    }
    return subgroup_min(least);
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

    float T[ROWS];
    uint own[ROWS];
    [[unroll]] for (uint k = 0u; k < ROWS; k++) {
        bool inside = t.x < u.width && t.y0 + k < u.height;
        T[k] = inside ? 1.0 : -1.0; // positive while the pixel takes splats
        own[k] = inside ? fetchu(view_labels, (t.y0 + k) * u.width + t.x) : VOTE_NONE;
    }
    uint from = 0u;
    for (uint skipped = 0u; skipped < WALK * LABELS_PER_WALK && from != VOTE_NONE; skipped++) {
        uint found = next_label(own, from);
        from = found == VOTE_NONE ? VOTE_NONE : found + 1u;
    }
    uint label[LABELS_PER_WALK], labels = 0u;
    [[unroll]] for (uint q = 0u; q < LABELS_PER_WALK; q++) {
        label[q] = from == VOTE_NONE ? VOTE_NONE : next_label(own, from);
        from = label[q] == VOTE_NONE ? VOTE_NONE : label[q] + 1u;
        labels += label[q] == VOTE_NONE ? 0u : 1u;
    }
    if (labels == 0u) {
        return;
    }

    uint list_start = fetchu(tile_starts, tile), list_end = fetchu(tile_ends, tile);
#ifdef SEGMENTED
    uint begin = min(list_start + SEGMENT * SEGMENT_LENGTH, list_end);
    uint end = min(begin + SEGMENT_LENGTH, list_end);
    uint kept = tile * (TILE_WIDTH * TILE_HEIGHT) + lane;
    if (SEGMENT > 0u) {
        [[unroll]] for (uint k = 0u; k < ROWS; k++) {
            T[k] = segment_colours[kept + k * SUBGROUP_SIZE].w;
        }
    }
#else
    uint begin = list_start, end = list_end;
#endif
    vec2 corner = vec2(float(t.x - (lane % TILE_WIDTH)), float((t.tile / u.tiles_x) * TILE_HEIGHT));
    for (uint base = begin; base < end; base += SUBGROUP_SIZE) {
        float live = T[0];
        [[unroll]] for (uint k = 1u; k < ROWS; k++) {
            live = max(live, T[k]);
        }
        if (subgroup_max(live) <= 0.0) {
            break;
        }
        uint count = min(SUBGROUP_SIZE, end - base);
        uint index = fetchu(splat_from_instance, fetchu(instance_from_sorted, min(base + lane, end - 1u)));
        vec4 r0 = fetch4(splats, 3u * index), r1 = fetch4(splats, 3u * index + 1u);
        float sum[LABELS_PER_WALK];
        [[unroll]] for (uint q = 0u; q < LABELS_PER_WALK; q++) {
            sum[q] = 0.0;
        }
        for (uint j = 0u; j < count; j++) {
            vec3 place = subgroup_shuffle(vec3(r0.xy, r1.y), j), conic = subgroup_shuffle(vec3(r0.zw, r1.x), j);
            float x = place.x - corner.x, y = place.y - corner.y;
            float a = conic.x, b = conic.y, c = conic.z;
            float dx = x - t.px;
            float ax = place.z + a * dx * dx, bx = b * dx;
            float dy0 = y - t.row0;
            float part[LABELS_PER_WALK];
            [[unroll]] for (uint q = 0u; q < LABELS_PER_WALK; q++) {
                part[q] = 0.0;
            }
            [[unroll]] for (uint k = 0u; k < ROWS; k++) {
                float dy = dy0 - float(k);
                precise float e = ax + dy * (bx + c * dy);
                float alpha = min(ALPHA_MAX, exp2(max(e, -20.0)));
                alpha = e < LOG2_ALPHA_MIN ? 0.0 : alpha;
                precise float next = T[k] * (1.0 - alpha);
                bool takes = ALONE != 0u ? T[k] > 0.0 : next >= TRANSMITTANCE_MIN;
                float w = takes ? alpha * T[k] : 0.0;
                T[k] = ALONE != 0u ? T[k] : takes ? next : -abs(T[k]);
                [[unroll]] for (uint q = 0u; q < LABELS_PER_WALK; q++) {
                    part[q] += own[k] == label[q] ? w : 0.0;
                }
            }
            [[unroll]] for (uint q = 0u; q < LABELS_PER_WALK; q++) {
                if (q < labels) {
                    float whole = subgroup_sum(part[q]);
                    sum[q] = lane == j ? whole : sum[q];
                }
            }
        }
        if (lane < count) {
            uint row = fetchu(gaussian_from_splat, index) * u.vote_columns;
            [[unroll]] for (uint q = 0u; q < LABELS_PER_WALK; q++) {
                if (q < labels && sum[q] > 0.0) {
                    uint at = row + label[q];
                    uint votes = uint(sum[q] * vote_weights[label[q]] * VOTE_ONE + 0.5);
                    uint before = atomicAdd(votes_low[at], votes);
                    if (before + votes < before) {
                        atomicAdd(votes_high[at], 1u);
                    }
                }
            }
        }
    }
#ifdef SEGMENTED
    [[unroll]] for (uint k = 0u; k < ROWS; k++) {
        segment_colours[kept + k * SUBGROUP_SIZE] = vec4(0.0, 0.0, 0.0, T[k]);
    }
#endif
}
