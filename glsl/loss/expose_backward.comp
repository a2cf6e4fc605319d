#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
// expose_backward — gradient of the picture before its exposure; sum the gradient of the gains.
// Work:    64 invocations per workgroup, EXPOSED pixels.
// Reads:   step; step_rows [ROW], the row of the photo; shared_parameters [S]; image [P]; target [P]
// Writes:  v_image [P] rgb, in place; exposure_partials [ceil(P / EXPOSED)]: r, g, b, 0
// Math:    dL/dc = exp(g) dL/dc', dL/dg = sum over pixels of dL/dc' c'; without the channels that are above 1 where the
//          photo is saturated
// Order:   fixed, bitwise reproducible.
// Mirror:  src/verify/reference/exposure.rs::backward

layout(constant_id = 17) const uint ROW = 0;
layout(local_size_x = 64) in;
READ1(0, StepUniforms, step);
READ(1, uint, step_rows);
READ(2, vec4, shared_parameters);
READ(3, vec4, image);
INOUT(4, vec4, v_image);
WRITE(5, vec4, exposure_partials);
FETCHC(6, target);

shared vec3 sums[64];

void main() {
    uint group = linear_group_id(), lane = gl_LocalInvocationID.x, pixels = step.width * step.height;
    vec3 gain = exp(shared_parameters[step_rows[ROW]].rgb), sum = vec3(0.0);
    for (uint k = 0u; k < EXPOSED; k += 64u) {
        uint p = group * EXPOSED + k + lane;
        if (p < pixels) {
            vec3 c = image[p].rgb, v = v_image[p].rgb;
            // A saturated photo does not tell how much brighter the scene is.
            v = mix(v, vec3(0.0), bvec3(vec3(greaterThan(c, vec3(1.0))) * vec3(equal(fetchc(target, p).rgb, vec3(1.0)))));
            sum += v * c;
            v_image[p].rgb = v * gain;
        }
    }
    sums[lane] = sum;
    for (uint half_ = 32u; half_ > 0u; half_ /= 2u) {
        barrier();
        if (lane < half_) {
            sums[lane] += sums[lane + half_];
        }
    }
    if (lane == 0u && group * EXPOSED < pixels) {
        exposure_partials[group] = vec4(sums[0], 0.0);
    }
}
