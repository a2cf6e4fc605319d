#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
#include "densify_rules.glsl"
// densify_labels — children inherit the label of their parent.
// Work:    64 old Gaussians per workgroup.
// Reads:   step; old_labels [N]; densify_actions [N]; child_offsets [N]
// Writes:  labels [new N]
// Mirror:  src/reference/densify.rs::densify

layout(local_size_x = 64) in;
READ1(0, StepUniforms, step);
FETCHU(1, old_labels);
FETCHU(2, densify_actions);
FETCHU(3, child_offsets);
WRITE(4, uint, labels);

void main() {
    uint i = linear_group_id() * 64u + gl_LocalInvocationID.x;
    if (i >= step.gaussian_count) {
        return;
    }
    uint to = fetchu(child_offsets, i), count = children(fetchu(densify_actions, i)), label = fetchu(old_labels, i);
    for (uint child = 0u; child < count; child++) {
        labels[to + child] = label;
    }
}
