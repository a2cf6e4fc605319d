#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
#include "gaussian.glsl"
#include "cull.glsl"
// cull — drop Gaussians that do not count at any pixel: behind the near plane, too transparent, or certainly outside
//        the image.
// Work:    64 Gaussians per workgroup.
// Reads:   step; means [N] (xyz world, w opacity logit); scales [N] (ln)
// Writes:  depth_keys [N]: bits of z, or KEY_INVISIBLE; splat_from_gaussian [N] = NO_SPLAT; counters.broken_* (integer
//          atomics): nonfinite positions, scales and opacities
// Math:    |cov2d| <= |J|^2 max(s)^2 + blur; radius where alpha falls to ALPHA_MIN. Conservative: never drops a splat
//          with a tile in project_forward.
// Mirror:  src/reference/project.rs::cull

layout(local_size_x = 64) in;
READ1(0, StepUniforms, step);
FETCH4(1, means);
FETCH4(2, scales);
WRITE(3, uint, depth_keys);
WRITE(4, uint, splat_from_gaussian);
INOUT1(5, Counters, counters);

void main() {
    StepUniforms u = step;
    uint i = linear_group_id() * 64u + gl_LocalInvocationID.x;
    if (i >= u.gaussian_count) {
        return;
    }
    vec4 mean = fetch4(means, i);
    vec3 s = fetch4(scales, i).xyz;
    if (is_broken(mean, s)) {
        atomicAdd(counters.broken_count, 1u);
        atomicMin(counters.broken_first, i);
    }
    depth_keys[i] = depth_key(u, mean, s);
    splat_from_gaussian[i] = NO_SPLAT;
}
