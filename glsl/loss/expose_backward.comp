#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
// expose_backward — gradient of the picture before its exposure; sum the gradient of the exposure.
// Work:    64 invocations per workgroup, EXPOSED pixels.
// Reads:   step; step_rows [ROW], the first row of the photo; shared_parameters [S]; image [P], exposed; target [P]
// Writes:  v_image [P] rgb, in place; exposure_partials [PARTIALS], EXPOSURE_ROWS each: r, g, b, 0
// Math:    of exposure.glsl; without the channels that are above 1 where the photo is saturated
// Order:   fixed, bitwise reproducible.
// Mirror:  src/reference/exposure.rs::backward

layout(constant_id = 17) const uint ROW = 0;
layout(local_size_x = 64) in;
READ1(0, StepUniforms, step);
READ(1, uint, step_rows);
READ(2, vec4, shared_parameters);
READ(3, vec4, image);
INOUT(4, vec4, v_image);
WRITE(5, vec4, exposure_partials);
FETCHC(6, target);

#include "exposure.glsl"

shared vec3 sums[EXPOSURE_ROWS][64];

void main() {
    uint group = linear_group_id(), lane = gl_LocalInvocationID.x, pixels = step.width * step.height;
    Exposure of = exposure(ROW);
    mat3 to_photo = colours(of), to_scene = inverse(to_photo);
    vec3 sum[EXPOSURE_ROWS] = vec3[](vec3(0.0), vec3(0.0), vec3(0.0));
    for (uint k = 0u; k < EXPOSED; k += 64u) {
        uint p = group * EXPOSED + k + lane;
        if (p < pixels) {
            vec3 lit = image[p].rgb, v = v_image[p].rgb;
            // A saturated photo does not show how much brighter the scene is.
            v = mix(v, vec3(0.0), bvec3(vec3(greaterThan(lit, vec3(1.0))) * vec3(equal(fetchc(target, p).rgb, vec3(1.0)))));
            vec3 c = to_scene * lit, w = v * of.gain;
            sum[0] += v * lit;
            sum[1] += w * of.next_slope * (c.gbr - c);
            sum[2] += w * of.last_slope * (c.brg - c);
            v_image[p].rgb = v * to_photo;
        }
    }
    for (uint i = 0u; i < EXPOSURE_ROWS; ++i) {
        sums[i][lane] = sum[i];
    }
    for (uint half_ = 32u; half_ > 0u; half_ /= 2u) {
        barrier();
        if (lane < half_) {
            for (uint i = 0u; i < EXPOSURE_ROWS; ++i) {
                sums[i][lane] += sums[i][lane + half_];
            }
        }
    }
    barrier();
    if (lane < EXPOSURE_ROWS && group < PARTIALS) {
        exposure_partials[EXPOSURE_ROWS * group + lane] = vec4(sums[lane][0], 0.0);
    }
}
