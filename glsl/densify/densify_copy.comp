#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
#include "densify_rules.glsl"
// densify_copy — copy one attribute, or one moment, to the densified model.
// Work:    one vec4 of one old Gaussian per invocation; STRIDE vec4 per Gaussian.
// Reads:   step; old_values [N,STRIDE]; densify_actions [N]; child_offsets [N]
// Writes:  values [new N,STRIDE]. MOMENTS: 0, except for kept Gaussians and cloned parents; frozen Gaussians have none.
//          HALF: words of packed moments (moments_store.glsl), which must not be treated as floats.
// Mirror:  src/reference/densify.rs::densify

layout(constant_id = 14) const uint STRIDE = 1;
layout(constant_id = 16) const uint MOMENTS = 0;
layout(local_size_x = 64) in;
READ1(0, StepUniforms, step);
#ifdef HALF
#define VALUE uvec4
READ(1, uvec4, old_values);
#define old_value(e) old_values[e]
#else
#define VALUE vec4
FETCH4(1, old_values);
#define old_value(e) fetch4(old_values, e)
#endif
FETCHU(2, densify_actions);
FETCHU(3, child_offsets);
WRITE(4, VALUE, values);

void main() {
    uint e = linear_group_id() * 64u + gl_LocalInvocationID.x;
    uint i = e / STRIDE;
    if (i >= (MOMENTS == 0u ? step.gaussian_count : step.trained_count)) {
        return;
    }
    uint action = fetchu(densify_actions, i), to = fetchu(child_offsets, i) * STRIDE + (e - i * STRIDE);
    VALUE v = old_value(e);
    bool kept = action == ACTION_KEEP || action == ACTION_CLONE;
    for (uint child = 0u; child < children(action); child++) {
        values[to + child * STRIDE] = MOMENTS == 0u || (kept && child == 0u) ? v : VALUE(0);
    }
}
