#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
// pose_reduce — gradient of the correction of the pose of the step's photo.
// Work:    one workgroup.
// Reads:   step, with the corrected camera; counters; step_rows from [ROW] on; shared_parameters [S]; pose_partials
// Writes:  v_shared [2 rows]
// Math:    the torque t in camera axes is the gradient of an additional rotation; the gradient of its vector is g = (t
//          + t x w) / (1 + w w). The gradient of the translation is -d R force, with the rotation R before the
//          correction. POSE_PRIOR pulls both to 0. The transposed preconditioner converts both to the trained numbers.
//          A settled pose has no gradient.
// Order:   fixed, bitwise reproducible.
// Mirror:  src/reference/pose.rs::backward

layout(constant_id = 17) const uint ROW = 0;
layout(constant_id = 18) const uint BY_SPLAT = 1; // the partials are those of pose_backward; 0: of update
layout(local_size_x = 64) in;
READ1(0, StepUniforms, step);
READ1(1, Counters, counters);
READ(2, uint, step_rows);
READ(3, vec4, shared_parameters);
READ(4, vec4, pose_partials);
WRITE(5, vec4, v_shared);

#include "pose.glsl"
#include "pose_sums.glsl"

void main() {
    uint lane = gl_LocalInvocationID.x, groups = ((BY_SPLAT != 0u ? counters.visible_count : step.gaussian_count) + 63u) / 64u;
    vec3 force = vec3(0.0), torque = vec3(0.0);
    for (uint group = lane; group < groups; group += 64u) {
        force += pose_partials[2u * group].xyz;
        torque += pose_partials[2u * group + 1u].xyz;
    }
    sum_pose(force, torque);
    if (lane == 0u) {
        uint turn = step_rows[ROW], move = step_rows[ROW + 1u];
        vec3 angle = vec3(correction(0u), correction(1u), correction(2u));
        vec3 shift = vec3(correction(3u), correction(4u), correction(5u));
        vec3 w = 0.5 * angle;
        mat3 world_from_camera = mat3(step.view_row0, step.view_row1, step.view_row2);
        vec3 t = torques[0] * world_from_camera, f = turned(-w, forces[0] * world_from_camera);
        vec3 g = (t + cross(t, w)) / (1.0 + dot(w, w));
        vec3 v_angle = g + POSE_PRIOR * angle, v_shift = POSE_PRIOR * shift - shared_parameters[move].w * f;
        vec3 v_turn = vec3(0.0), v_move = vec3(0.0);
        for (uint k = 0u; k < 6u; k++) {
            float v = k < 3u ? v_angle[k] : v_shift[k - 3u];
            uint row = ROW + 2u * (k + 1u);
            v_turn += v * shared_parameters[step_rows[row]].xyz;
            v_move += v * shared_parameters[step_rows[row + 1u]].xyz;
        }
        float open = 1.0 - shared_parameters[turn].w;
        v_shared[turn] = vec4(open * v_turn, 0.0);
        v_shared[move] = vec4(open * v_move, 0.0);
    }
}
