#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
#include "blend_tile.glsl"
// label_map — the label with the largest sum of blending weights in each pixel; 0 (no label) competes too.
// Work:    one subgroup (= workgroup) per tile of the scene, jobs as in blend_forward. One walk sums four labels of a
//          tile, in order of appearance, and the rest together. Where the rest could still win in a pixel, the next
//          walk (WALK) sums the next four labels that such pixels see.
// Reads:   step; tile_starts, tile_ends [T]; instance_from_sorted, splat_from_instance [I]; splats [V,3];
//          gaussian_from_splat [V]; labels [N]
// Writes:  label_map [P] label, with LABEL_OPEN where the rest could win; label_weights [P] its sum;
//          label_tables [T, LABEL_ROUNDS] labels of each walk; counters.undecided_tiles after the last walk
// Math:    L(v) = argmax over k of the sum of alpha_j T_j over j with B_j = k, the smaller k of equals; 0 without
//          weight
// Order:   a label's sum adds in the order of the list, in whichever walk. Rounding is monotone, so the sum of the rest
//          is at least the sum of any label in it, so a decided pixel has the same label as a walk over all labels.
// Mirror:  src/reference/lift.rs::label_map

layout(constant_id = 15) const uint LATER = 0; // 1: not the first walk
READ1(0, StepUniforms, step);
INOUT1(1, Counters, counters);
FETCHU(2, tile_starts);
FETCHU(3, tile_ends);
FETCHU(4, instance_from_sorted);
FETCHU(5, splat_from_instance);
FETCH4(6, splats);
FETCHU(7, gaussian_from_splat);
FETCHU(8, labels);
INOUT(9, uint, label_map);
INOUT(10, float, label_weights);
INOUT(11, uvec4, label_tables);
#ifdef SEGMENTED
INOUT(30, vec4, segment_colours); // [jobs, pixels of a tile] sums of the four labels
INOUT(31, uvec4, segment_rest);   // (transmittance with the sign of `T`, sum of the rest)
#endif

const uint FREE = 0xffffffffu;   // an empty place of a table
const uint SUMMED = 0xfffffffeu; // label of an earlier walk

void main() {
    StepUniforms u = step;
    uint group = linear_group_id();
    if (group >= u.tile_count) {
        return;
    }
    uint tile = interleave(group, u.tile_count);
    TileJob t = locate(tile, 0u, u);
    uint lane = gl_LocalInvocationID.x;

    float T[ROWS], rest[ROWS];
    vec4 sum[ROWS];
    bool open[ROWS]; // the walk may change the pixel's label
    uint opens = 0u;
    [[unroll]] for (uint k = 0u; k < ROWS; k++) {
        open[k] = t.x < u.width && t.y0 + k < u.height;
        if (LATER != 0u && open[k]) {
            open[k] = (label_map[(t.y0 + k) * u.width + t.x] & LABEL_OPEN) != 0u;
        }
        opens |= open[k] ? 1u : 0u;
        T[k] = open[k] ? 1.0 : -1.0; // positive while the pixel takes splats
        sum[k] = vec4(0.0);
        rest[k] = 0.0;
    }
    if (LATER != 0u && subgroup_max(opens) == 0u) {
        return;
    }
    uvec4 table = uvec4(FREE), earlier[LABEL_ROUNDS];
    [[unroll]] for (uint r = 0u; r < LABEL_ROUNDS; r++) {
        earlier[r] = uvec4(FREE);
        if (LATER != 0u && r < WALK) {
            earlier[r] = label_tables[tile * LABEL_ROUNDS + r];
        }
    }

    uint list_start = fetchu(tile_starts, tile), list_end = fetchu(tile_ends, tile);
#ifdef SEGMENTED
    uint begin = min(list_start + SEGMENT * SEGMENT_LENGTH, list_end);
    uint end = min(begin + SEGMENT_LENGTH, list_end);
    uint kept = tile * (TILE_WIDTH * TILE_HEIGHT) + lane;
    if (SEGMENT > 0u) {
        [[unroll]] for (uint k = 0u; k < ROWS; k++) {
            sum[k] = segment_colours[kept + k * SUBGROUP_SIZE];
            uvec4 more = segment_rest[kept + k * SUBGROUP_SIZE];
            T[k] = uintBitsToFloat(more.x);
            rest[k] = uintBitsToFloat(more.y);
            table = k == 0u ? uvec4(more.zw, table.zw) : k == 1u ? uvec4(table.xy, more.zw) : table;
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
        uint own = fetchu(labels, fetchu(gaussian_from_splat, index)) & LABEL_MASK;
        if (LATER != 0u) {
            [[unroll]] for (uint r = 0u; r < LABEL_ROUNDS; r++) {
                own = any(equal(uvec4(own), earlier[r])) ? SUMMED : own;
            }
        }
        for (uint j = 0u; j < count; j++) {
            vec3 place = subgroup_shuffle(vec3(r0.xy, r1.y), j), conic = subgroup_shuffle(vec3(r0.zw, r1.x), j);
            uint label = subgroup_shuffle(own, j);
            float x = place.x - corner.x, y = place.y - corner.y;
            float a = conic.x, b = conic.y, c = conic.z;
            float dx = x - t.px;
            float ax = place.z + a * dx * dx, bx = b * dx;
            float dy0 = y - t.row0;
            float weight[ROWS], most = 0.0;
            [[unroll]] for (uint k = 0u; k < ROWS; k++) {
                float dy = dy0 - float(k);
                precise float e = ax + dy * (bx + c * dy);
                float alpha = min(ALPHA_MAX, exp2(max(e, -20.0)));
                alpha = e < LOG2_ALPHA_MIN ? 0.0 : alpha;
                precise float next = T[k] * (1.0 - alpha);
                bool takes = next >= TRANSMITTANCE_MIN;
                precise float w = takes ? alpha * T[k] : 0.0;
                T[k] = takes ? next : -abs(T[k]);
                weight[k] = w;
                most = max(most, w);
            }
            bvec4 same = equal(uvec4(label), table);
            // The label is the same in all lanes, and so are these branches.
            if (!any(same) && label != SUMMED && table.w == FREE) {
                if (subgroup_max(most) > 0.0) {
                    same.x = table.x == FREE;
                    same.y = !same.x && table.y == FREE;
                    same.z = !same.x && !same.y && table.z == FREE;
                    same.w = !same.x && !same.y && !same.z;
                    table = mix(table, uvec4(label), same);
                }
            }
            vec4 into = vec4(same);
            float others = any(same) || label == SUMMED ? 0.0 : 1.0;
            [[unroll]] for (uint k = 0u; k < ROWS; k++) {
                sum[k] += into * weight[k];
                rest[k] += others * weight[k];
            }
        }
    }
    if (lane == 0u) {
        label_tables[tile * LABEL_ROUNDS + WALK] = table;
    }
#ifdef SEGMENTED
    if (SEGMENT + 1u < SEGMENTS) {
        [[unroll]] for (uint k = 0u; k < ROWS; k++) {
            segment_colours[kept + k * SUBGROUP_SIZE] = sum[k];
            // Every lane keeps the table too, in its first two rows.
            segment_rest[kept + k * SUBGROUP_SIZE] =
                uvec4(floatBitsToUint(T[k]), floatBitsToUint(rest[k]), k == 0u ? table.xy : table.zw);
        }
        return;
    }
#endif

    uint undecided = 0u;
    [[unroll]] for (uint k = 0u; k < ROWS; k++) {
        if (open[k]) {
            uint p = (t.y0 + k) * u.width + t.x;
            uint label = LATER != 0u ? label_map[p] & LABEL_MASK : 0u;
            float best = LATER != 0u ? label_weights[p] : 0.0;
            [[unroll]] for (uint q = 0u; q < 4u; q++) {
                bool wins = sum[k][q] > best || (sum[k][q] == best && best > 0.0 && table[q] < label);
                label = wins ? table[q] : label;
                best = wins ? sum[k][q] : best;
            }
            // With equal sums, the smaller label may be in the rest.
            bool more = rest[k] > 0.0 && rest[k] >= best;
            label_map[p] = label | (more ? LABEL_OPEN : 0u);
            label_weights[p] = best;
            undecided |= more ? 1u : 0u;
        }
    }
    if (WALK + 1u == WALKS && subgroup_max(undecided) != 0u && lane == 0u) {
        atomicAdd(counters.undecided_tiles, 1u);
    }
}
