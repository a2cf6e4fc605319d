#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
// loss_tile — the photo loss and its gradient in one dispatch: everything that a tile's pixels touch goes through
//             shared memory.
// Work:    LOSS_TILE x LOSS_TILE pixels per workgroup, one per invocation; a filter makes RUN values per invocation.
//          The last workgroup sums the losses of all.
// Reads:   step; image [P]; target [P] RGBA8 (pixels with alpha 0 are ignored; both pictures count as 0 there);
//          variant labels: layer_loss [counters.layer_tile_count]; variant disagreement: disagreement [T];
//          variant exposure: step_rows [ROW], the first row of the photo; shared_parameters [S]
// Writes:  v_image [P] (rgb, 0); loss_partials [workgroups] (sum |x - y|, sum ssim); counters.loss_l1, loss_ssim,
//          loss_label; variant exposure: exposure_partials [workgroups, EXPOSURE_ROWS] (r, g, b, 0)
// Math:    (1 - lambda) |x - y| + lambda (1 - ssim), times loss_scale = 1 / (3 valid pixels); ssim of ssim.glsl. The
//          windows reach 5 pixels twice. Variant exposure: of the exposed picture (exposure.glsl),
//          expose_backward.comp.
// Order:   fixed, bitwise reproducible: whichever workgroup is the last adds the partials in the order of the
//          workgroups.
// Mirror:  src/reference/loss.rs::photo_loss, exposure.rs::backward

layout(constant_id = 17) const uint ROW = 0;
layout(constant_id = 20) const uint LOSS_TILE = 16; // px; its square invocations are a workgroup
layout(local_size_x_id = 20, local_size_y_id = 20) in;
READ1(0, StepUniforms, step);
INOUT1(1, Counters, counters);
READ(2, vec4, image);
READ(3, uint, target);
WRITE(4, vec4, v_image);
INOUT(5, uint, loss_partials); // two floats of each workgroup
#ifdef LABELS
READ(6, float, layer_loss);
#endif
#ifdef DISAGREEMENT
READ(6, float, disagreement);
#endif
#ifdef EXPOSURE
READ(7, uint, step_rows);
READ(8, vec4, shared_parameters);
WRITE(9, vec4, exposure_partials);
#include "exposure.glsl"
#endif
#include "ssim.glsl"
#include "arrival.glsl"

const uint REACH = 5u; // px of a window on each side
const uint TAPS = 2u * REACH + 1u;
const uint RUN = 4u; // neighbouring values of a filter by one invocation
const uint LOSS_LANES = LOSS_TILE * LOSS_TILE;
const uint MIDDLE = LOSS_TILE + 2u * REACH; // px by side whose SSIM the tile touches
const uint OUTER = MIDDLE + 2u * REACH;     // px by side that these depend on
// Lanes of a filter along x have separate rows: these pitches avoid bank conflicts.
const uint TILE_PITCH = LOSS_TILE + 1u, MIDDLE_PITCH = MIDDLE + 1u, OUTER_PITCH = OUTER + 1u;
const uint OUTER_CELLS = OUTER * OUTER_PITCH, MIDDLE_CELLS = MIDDLE * MIDDLE_PITCH;

shared float cells[2u * OUTER_CELLS];    // a channel of both pictures; then three derivatives of SSIM
shared vec4 rows[OUTER * MIDDLE_PITCH];  // moments, filtered along x; then derivatives, filtered along x

bool is_inside(ivec2 at) {
    return all(greaterThanEqual(at, ivec2(0))) && all(lessThan(at, ivec2(step.width, step.height)));
}

// 0 where the pixel does not count, also outside of the picture.
uint photo(ivec2 at) {
    uint found = is_inside(at) ? target[at.y * step.width + at.x] : 0u;
    return found >= 0x80000000u ? found : 0u;
}

// RUN neighbouring values of a window over `value`, an expression of r.
#define FILTER(T, sum, r, value) \
    T sum[RUN]; \
    [[unroll]] for (uint k = 0u; k < RUN; k++) { \
        sum[k] = T(0.0); \
    } \
    [[unroll]] for (uint r = 0u; r < RUN + TAPS - 1u; r++) { \
        T found = value; \
        [[unroll]] for (uint k = 0u; k < RUN; k++) { \
            if (r >= k && r - k < TAPS) { \
                sum[k] += WINDOW[r - k] * found; \
            } \
        } \
    }

vec4 moments(uint at) {
    float a = cells[at], b = cells[OUTER_CELLS + at];
    return vec4(a, b, a * a + b * b, a * b);
}

vec3 derivatives(uint at) {
    return vec3(cells[at], cells[MIDDLE_CELLS + at], cells[2u * MIDDLE_CELLS + at]);
}

// Filters a channel of both pictures along x.
void filter_pictures(uint lane) {
    for (uint i = lane; i < OUTER * ((MIDDLE + RUN - 1u) / RUN); i += LOSS_LANES) {
        uint row = i % OUTER, x = i / OUTER * RUN;
        FILTER(vec4, sum, r, moments(row * OUTER_PITCH + min(x + r, OUTER - 1u)))
        [[unroll]] for (uint k = 0u; k < RUN; k++) {
            if (x + k < MIDDLE) {
                rows[row * MIDDLE_PITCH + x + k] = sum[k];
            }
        }
    }
}

// Filters the moments along y, and writes the derivatives of SSIM with respect to them. Returns the sum of SSIM over
// the pixels of the tile that this invocation processes.
float differentiate(uint lane, ivec2 corner) {
    float total = 0.0;
    for (uint i = lane; i < MIDDLE * ((MIDDLE + RUN - 1u) / RUN); i += LOSS_LANES) {
        uint x = i % MIDDLE, y0 = i / MIDDLE * RUN;
        FILTER(vec4, sum, r, rows[min(y0 + r, OUTER - 1u) * MIDDLE_PITCH + x])
        [[unroll]] for (uint k = 0u; k < RUN; k++) {
            uint y = y0 + k;
            if (y < MIDDLE) {
                bool counts = photo(corner + ivec2(REACH + x, REACH + y)) != 0u;
                vec4 of = counts ? ssim(sum[k]) : vec4(0.0);
                [[unroll]] for (uint c = 0u; c < 3u; c++) {
                    cells[c * MIDDLE_CELLS + y * MIDDLE_PITCH + x] = of[c];
                }
                bool is_own = min(x, y) >= REACH && max(x, y) < REACH + LOSS_TILE;
                total += is_own ? of.w : 0.0;
            }
        }
    }
    return total;
}

// Filters the derivatives along x.
void filter_derivatives(uint lane) {
    for (uint i = lane; i < MIDDLE * (LOSS_TILE / RUN); i += LOSS_LANES) {
        uint row = i % MIDDLE, x = i / MIDDLE * RUN;
        FILTER(vec3, sum, r, derivatives(row * MIDDLE_PITCH + x + r))
        [[unroll]] for (uint k = 0u; k < RUN; k++) {
            rows[row * TILE_PITCH + x + k] = vec4(sum[k], 0.0);
        }
    }
}

// Sums over the workgroup; the first invocation has the result, others have 0.
vec3 sum_of(vec3 v) {
    uint lane = gl_LocalInvocationIndex;
    barrier();
    rows[lane].xyz = v;
    for (uint half_ = LOSS_LANES / 2u; half_ > 0u; half_ /= 2u) {
        barrier();
        if (lane < half_) {
            rows[lane].xyz += rows[lane + half_].xyz;
        }
    }
    return lane == 0u ? rows[0].xyz : vec3(0.0);
}

// Sums the losses of all workgroups, in the last one to finish.
void finish(vec2 losses) {
    uint lane = gl_LocalInvocationIndex, groups = gl_NumWorkGroups.x * gl_NumWorkGroups.y;
    uint group = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    if (lane == 0u) {
        atomicExchange(loss_partials[2u * group], floatBitsToUint(losses.x));
        atomicExchange(loss_partials[2u * group + 1u], floatBitsToUint(losses.y));
    }
    arrive(counters.loss_groups);
    if (arrived_before + 1u < groups) {
        return;
    }
    vec3 sum = vec3(0.0);
    for (uint i = lane; i < groups; i += LOSS_LANES) {
        sum.x += uintBitsToFloat(atomicOr(loss_partials[2u * i], 0u));
        sum.y += uintBitsToFloat(atomicOr(loss_partials[2u * i + 1u], 0u));
    }
#ifdef LABELS
    // If there are more layer tiles than capacity, the step has failed and its loss is unused.
    uint count = min(counters.layer_tile_count, step.layer_tile_capacity);
    for (uint i = lane; i < count; i += LOSS_LANES) {
        sum.z += layer_loss[i];
    }
#endif
#ifdef DISAGREEMENT
    for (uint i = lane; i < step.tile_count; i += LOSS_LANES) {
        sum.z += disagreement[i];
    }
#endif
    sum = sum_of(sum);
    if (lane == 0u) {
        counters.loss_l1 = sum.x;
        counters.loss_ssim = sum.y;
        counters.loss_label = sum.z;
    }
}

void main() {
    uint lane = gl_LocalInvocationIndex;
    ivec2 corner = ivec2(gl_WorkGroupID.xy * LOSS_TILE) - int(2u * REACH); // of the outer pixels
    ivec2 own = corner + int(2u * REACH) + ivec2(gl_LocalInvocationID.xy);
#ifdef EXPOSURE
    Exposure of = exposure(ROW);
    mat3 to_photo = colours(of);
#else
    const float to_photo = 1.0;
#endif
    uint own_photo = photo(own), p = own_photo != 0u ? own.y * step.width + own.x : 0u;
    vec3 lit = to_photo * image[p].rgb, given = unpackUnorm4x8(own_photo).rgb, gradient = vec3(0.0);
    float weight = step.lambda_dssim * step.loss_scale, weight_l1 = (1.0 - step.lambda_dssim) * step.loss_scale;
    vec2 losses = vec2(0.0);
    for (uint channel = 0u; channel < 3u; channel++) {
        // Read again for each channel: in registers the colours would halve the number of workgroups that run at once.
        for (uint i = lane; i < OUTER * OUTER; i += LOSS_LANES) {
            uvec2 at = uvec2(i % OUTER, i / OUTER);
            ivec2 pixel = corner + ivec2(at);
            uint theirs = photo(pixel), cell = at.y * OUTER_PITCH + at.x;
            vec3 ours = theirs != 0u ? to_photo * image[pixel.y * step.width + pixel.x].rgb : vec3(0.0);
            cells[cell] = ours[channel];
            cells[OUTER_CELLS + cell] = unpackUnorm4x8(theirs)[channel];
        }
        barrier();
        filter_pictures(lane);
        barrier();
        losses.y += differentiate(lane, corner);
        barrier();
        filter_derivatives(lane);
        barrier();
        vec3 sum = vec3(0.0);
        [[unroll]] for (uint r = 0u; r < TAPS; r++) {
            sum += WINDOW[r] * rows[(gl_LocalInvocationID.y + r) * TILE_PITCH + gl_LocalInvocationID.x].xyz;
        }
        float a = lit[channel], b = given[channel], difference = own_photo != 0u ? a - b : 0.0;
        losses.x += abs(difference);
        float v = weight_l1 * sign(difference) - weight * (sum.x + 2.0 * a * sum.y + b * sum.z);
        gradient = mix(gradient, vec3(own_photo != 0u ? v : 0.0), equal(uvec3(channel), uvec3(0u, 1u, 2u)));
        barrier();
    }
#ifdef EXPOSURE
    // A saturated photo does not show how much brighter the scene is.
    gradient = mix(gradient, vec3(0.0), bvec3(vec3(greaterThan(lit, vec3(1.0))) * vec3(equal(given, vec3(1.0)))));
    vec3 c = image[p].rgb, w = gradient * of.gain;
    vec3 of_rows[EXPOSURE_ROWS] =
        vec3[](gradient * lit, w * of.next_slope * (c.gbr - c), w * of.last_slope * (c.brg - c));
    uint group = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    for (uint i = 0u; i < EXPOSURE_ROWS; i++) {
        vec3 sum = sum_of(of_rows[i]);
        if (lane == 0u) {
            exposure_partials[EXPOSURE_ROWS * group + i] = vec4(sum, 0.0);
        }
    }
    gradient = gradient * to_photo;
#endif
    if (is_inside(own)) {
        v_image[own.y * step.width + own.x] = vec4(gradient, 0.0);
    }
    finish(sum_of(vec3(losses, 0.0)).xy);
}
