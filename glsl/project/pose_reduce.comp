#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "pose.glsl"
// pose_reduce — gradient of the correction of the pose of the step's photo.
// Work:    one workgroup.
// Reads:   step, with the corrected camera; counters; step_rows [ROW], [ROW + 1]; shared_parameters [S]; pose_partials
// Writes:  v_shared [2 rows]
// Math:    the torque t in camera axes is the gradient of a turn on top; that of its vector is g = (t + t x w) / (1 + w w).
//          That of the move is -d R force, with the rotation R before the turn. POSE_PRIOR pulls both to 0.
// Order:   fixed, bitwise reproducible.
// Mirror:  src/verify/reference/pose.rs::backward

layout(constant_id = 17) const uint ROW = 0;
layout(local_size_x = 64) in;
READ1(0, StepUniforms, step);
READ1(1, Counters, counters);
READ(2, uint, step_rows);
READ(3, vec4, shared_parameters);
READ(4, vec4, pose_partials);
WRITE(5, vec4, v_shared);

shared vec3 forces[64];
shared vec3 torques[64];

void main() {
    uint lane = gl_LocalInvocationID.x, groups = (counters.visible_count + 63u) / 64u;
    vec3 force = vec3(0.0), torque = vec3(0.0);
    for (uint group = lane; group < groups; group += 64u) {
        force += pose_partials[2u * group].xyz;
        torque += pose_partials[2u * group + 1u].xyz;
    }
    forces[lane] = force;
    torques[lane] = torque;
    for (uint half_ = 32u; half_ > 0u; half_ /= 2u) {
        barrier();
        if (lane < half_) {
            forces[lane] += forces[lane + half_];
            torques[lane] += torques[lane + half_];
        }
    }
    if (lane == 0u) {
        uint turn = step_rows[ROW], move = step_rows[ROW + 1u];
        vec3 angle = shared_parameters[turn].xyz;
        vec4 shift = shared_parameters[move];
        vec3 w = 0.5 * angle;
        mat3 world_from_camera = mat3(step.view_row0, step.view_row1, step.view_row2);
        vec3 t = torques[0] * world_from_camera, f = turned(-w, forces[0] * world_from_camera);
        vec3 g = (t + cross(t, w)) / (1.0 + dot(w, w));
        v_shared[turn] = vec4(g + POSE_PRIOR * angle, 0.0);
        v_shared[move] = vec4(POSE_PRIOR * shift.xyz - shift.w * f, 0.0);
    }
}
