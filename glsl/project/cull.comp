#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
#include "gaussian.glsl"
#include "moments_store.glsl"
// cull — drop Gaussians that count at no pixel: behind the near plane, too transparent, or certainly outside the image.
// Work:    64 Gaussians per workgroup.
// Reads:   step; means [N] (xyz world, w opacity logit); scales [N] (ln); variant lazy: moments of both, touched_at [N], missed
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
#ifdef LAZY
READ_MOMENTS(6, 8, means);
READ_MOMENTS(7, 9, scales);
FETCHU(10, touched_at);
READ(11, uvec4, missed);
#endif
#define plane4(name, e) fetch4(name, e)
#include "caught_up.glsl"
#ifdef LAZY
CAUGHT_UP(means, late_means)
CAUGHT_UP(scales, late_rest.x)
#endif

void main() {
    StepUniforms u = step;
    uint i = linear_group_id() * 64u + gl_LocalInvocationID.x;
    if (i >= u.gaussian_count) {
        return;
    }
#ifdef LAZY
    look_up(i < u.trained_count ? missed_updates(i) : 0u);
#endif
    vec4 mean = value4(means, i);
    vec3 view = to_view(u, mean.xyz);
    float log2_o = log2_opacity(mean.w);
    vec3 s = value4(scales, i).xyz;
    float sigma = exp(max(s.x, max(s.y, s.z)));
    float inv_z = 1.0 / view.z;
    vec2 limit = max(abs(vec2(u.clamp_x_min, u.clamp_y_min)), abs(vec2(u.clamp_x_max, u.clamp_y_max)));
    vec2 focal = vec2(u.fx, u.fy);
    vec2 stretch = focal * inv_z * sigma;
    vec2 variance = stretch * stretch * (1.0 + limit * limit) + COV2D_BLUR;
    float reach = 2.0 * LN2 * (log2_o - LOG2_ALPHA_MIN);
    vec2 radius = sqrt(variance * max(reach, 0.0)) * 1.001 + 0.5;
    vec2 centre = focal * view.xy * inv_z + vec2(u.cx, u.cy);
    bool inside = all(greaterThanEqual(centre + radius, vec2(0.0)))
        && all(lessThanEqual(centre - radius, vec2(float(u.width), float(u.height))));
    bool visible = view.z > u.near && reach > 0.0 && inside && finite(view.z);
    if (!finite(mean.x + mean.y + mean.z + mean.w + s.x + s.y + s.z)) {
        atomicAdd(counters.broken_count, 1u);
        atomicMin(counters.broken_first, i);
    }
    depth_keys[i] = visible ? floatBitsToUint(view.z) : KEY_INVISIBLE;
    splat_from_gaussian[i] = NO_SPLAT;
}
