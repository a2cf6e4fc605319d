#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
#include "gaussian.glsl"
#include "moments_store.glsl"
// catch_up — apply all missed Adam updates.
// Work:    64 Gaussians per workgroup, one per invocation; colours by vec4, distributed among the invocations.
// Reads:   step, counters; missed
// Writes:  parameters, first and second moments [N], active colours only; touched_at [N] of Gaussians that had missed
//          updates
// Math:    see caught_up.glsl. A separate list does so also after a failure.
// Mirror:  src/reference/lazy.rs::caught_up

layout(constant_id = 11) const uint SH_DEGREE = 3;
layout(local_size_x = 64) in;
READ1(0, StepUniforms, step);
READ1(1, Counters, counters);
INOUT(2, uint, touched_at);
READ(3, uvec4, missed);
INOUT_PLANES(4, 11, 18);

#define LAZY
#define plane4(name, e) name[e]
#define touched(i) touched_at[i]
#include "caught_up.glsl"
#include "late_adam.glsl"

#define CATCH_UP(name, e, slot, first) name##_catch_up(e)

void main() {
    uint i = linear_group_id() * 64u + gl_LocalInvocationID.x;
    if (gl_LocalInvocationID.x == 0u) {
        touched_count = 0u;
    }
    barrier();
    uint age = i < step.trained_count && (counters.failure == 0u || missed[0].z != 0u) ? missed_updates(i) : 0u;
    if (age > 0u) {
        look_up(age);
        means_catch_up(i);
        scales_catch_up(i);
        quats_catch_up(i);
        touched_at[i] = missed[0].x;
        touch(i);
    }
    barrier();
    EACH_COLOUR(sh0, 0u, 1u, 0u, CATCH_UP)
    EACH_COLOUR(sh1, 1u, 2u, 0u, CATCH_UP)
    EACH_COLOUR(sh2, 2u, 4u, 0u, CATCH_UP)
    EACH_COLOUR(sh3, 3u, 5u, 0u, CATCH_UP)
}
