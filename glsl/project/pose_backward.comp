#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
#include "sh.glsl"
// pose_backward — sum the gradients of the splats with respect to the camera's pose.
// Work:    64 splats per workgroup.
// Reads:   step; counters; gaussian_from_splat [V]; means, quats, sh0..sh3 [N]; v_means, v_quats, v_sh0 [V]
// Writes:  pose_partials [ceil(V / 64), 2]: the force, and the torque around the camera, both in world axes
// Math:    see pose_sums.glsl
// Order:   fixed, bitwise reproducible.
// Mirror:  src/reference/pose.rs::backward

layout(constant_id = 11) const uint SH_DEGREE = 3;
layout(local_size_x = 64) in;
READ1(0, StepUniforms, step);
READ1(1, Counters, counters);
FETCHU(2, gaussian_from_splat);
FETCH4(3, means);
FETCH4(4, quats);
FETCH4(5, sh0);
FETCH4(6, sh1);
FETCH4(7, sh2);
FETCH4(8, sh3);
READ(9, vec4, v_means);
READ(10, vec4, v_quats);
READ(11, vec4, v_sh0);
WRITE(12, vec4, pose_partials);

#include "sh_colour.glsl"
#include "sh_backward.glsl"
#include "pose_sums.glsl"

void main() {
    uint group = linear_group_id(), lane = gl_LocalInvocationID.x, s = group * 64u + lane;
    vec3 force = vec3(0.0), torque = vec3(0.0);
    if (s < counters.visible_count) {
        uint i = fetchu(gaussian_from_splat, s);
        vec4 q = fetch4(quats, i), v_q = v_quats[s];
        vec3 offset = fetch4(means, i).xyz - step.camera_centre;
        float inv_distance;
        vec3 direction = direction_of(offset, inv_distance);
        vec3 v_direction = sh_direction_gradient(i, direction, v_sh0[s].xyz / SH_C0);
        force = v_means[s].xyz;
        vec3 of_place = force - (v_direction - direction * dot(direction, v_direction)) * inv_distance;
        torque = torque_of(offset, of_place, q, v_q);
    }
    sum_pose(force, torque);
    if (lane == 0u && s < counters.visible_count) {
        pose_partials[2u * group] = vec4(forces[0], 0.0);
        pose_partials[2u * group + 1u] = vec4(torques[0], 0.0);
    }
}
