#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
#include "gaussian.glsl"
// smooth — keep Gaussians from becoming finer than the photos can resolve, which would show as needles and gaps in
//          close views.
// Work:    64 Gaussians per workgroup.
// Reads:   step, counters; means, scales_in [N]
// Writes:  scales [N], the same buffer: w is the limit, the smallest over all views so far that see the centre; 0 if
//          there is none
// Math:    3-D filter of Mip-Splatting as a lower limit: s >= FINEST z / f, f of the photo at full size; Adam's update
//          is projected onto it.
// Mirror:  src/reference/smooth.rs::smooth

layout(local_size_x = 64) in;
READ1(0, StepUniforms, step);
READ1(1, Counters, counters);
FETCH4(2, means);
FETCH4(3, scales_in);
WRITE(4, vec4, scales);

void main() {
    StepUniforms u = step;
    uint i = linear_group_id() * 64u + gl_LocalInvocationID.x;
    if (i >= u.trained_count || counters.failure != 0u) {
        return;
    }
    vec4 s = fetch4(scales_in, i);
    vec3 p = to_view(u, fetch4(means, i).xyz);
    vec2 size = vec2(u.width, u.height), margin = SMOOTH_MARGIN * size * p.z;
    vec2 at = vec2(u.fx, u.fy) * p.xy + vec2(u.cx, u.cy) * p.z; // px times depth
    bool seen = p.z > u.near && all(greaterThan(at, -margin)) && all(lessThan(at, size * p.z + margin));
    float limit = u.finest * p.z;
    s.w = !seen ? s.w : s.w > 0.0 ? min(s.w, limit) : limit;
    s.xyz = s.w > 0.0 ? max(s.xyz, vec3(log(s.w))) : s.xyz;
    scales[i] = s;
}
