#version 460
#include "layout.glsl"
#include "constants.glsl"
// expose_reduce — gradient of the exposure of the step's photo.
// Work:    one workgroup.
// Reads:   step_rows [ROW], the first row of the photo; exposure_partials [PARTIALS];
//          shared_parameters [ROWS], STRIDE a photo
// Writes:  v_shared [row] and the following rows
// Math:    the sum of the partials, and EXPOSURE_PRIOR times the mean of each number over all photos: the model can be
//          brighter and all photos darker, so the data do not determine this mean. The prior keeps it near 0.
// Order:   fixed, bitwise reproducible.
// Mirror:  src/reference/exposure.rs::backward

layout(constant_id = 14) const uint STRIDE = 1;
layout(constant_id = 15) const uint ROWS = 1;
layout(constant_id = 17) const uint ROW = 0;
layout(local_size_x = 64) in;
READ(0, uint, step_rows);
READ(1, vec4, shared_parameters);
READ(2, vec4, exposure_partials);
WRITE(3, vec4, v_shared);

#include "exposure.glsl"

shared vec3 sums[EXPOSURE_ROWS][64];
shared vec3 means[EXPOSURE_ROWS][64];

void main() {
    uint lane = gl_LocalInvocationID.x;
    vec3 sum[EXPOSURE_ROWS] = vec3[](vec3(0.0), vec3(0.0), vec3(0.0)), mean[EXPOSURE_ROWS] = sum;
    for (uint k = lane; k < PARTIALS; k += 64u) {
        for (uint i = 0u; i < EXPOSURE_ROWS; ++i) {
            sum[i] += exposure_partials[EXPOSURE_ROWS * k + i].rgb;
        }
    }
    for (uint row = ROW + lane * STRIDE; row < ROWS; row += 64u * STRIDE) {
        for (uint i = 0u; i < EXPOSURE_ROWS; ++i) {
            mean[i] += shared_parameters[row + i].rgb;
        }
    }
    for (uint i = 0u; i < EXPOSURE_ROWS; ++i) {
        sums[i][lane] = sum[i];
        means[i][lane] = mean[i];
    }
    for (uint half_ = 32u; half_ > 0u; half_ /= 2u) {
        barrier();
        if (lane < half_) {
            for (uint i = 0u; i < EXPOSURE_ROWS; ++i) {
                sums[i][lane] += sums[i][lane + half_];
                means[i][lane] += means[i][lane + half_];
            }
        }
    }
    barrier();
    if (lane < EXPOSURE_ROWS) {
        v_shared[step_rows[ROW] + lane] = vec4(sums[lane][0] + EXPOSURE_PRIOR / float(ROWS / STRIDE) * means[lane][0], 0.0);
    }
}
