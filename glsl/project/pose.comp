#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
// pose — correct the pose of the step's camera.
// Work:    one invocation.
// Reads:   step_rows from [ROW] on, the rows of the photo; shared_parameters [S] (pose.glsl)
// Writes:  step: rotation and centre of the camera, in place; the host rewrites them for each submit
// Math:    R' = T(w) R, c' = c + d R^T m with the depth d in the fourth number of the second row
// Mirror:  src/reference/pose.rs::corrected

layout(constant_id = 17) const uint ROW = 0;
layout(local_size_x = 1) in;
INOUT1(0, StepUniforms, step);
READ(1, uint, step_rows);
READ(2, vec4, shared_parameters);

#include "pose.glsl"

void main() {
    vec3 w = 0.5 * vec3(correction(0u), correction(1u), correction(2u));
    vec3 move = shared_parameters[step_rows[ROW + 1u]].w * vec3(correction(3u), correction(4u), correction(5u));
    vec3 x = step.view_row0, y = step.view_row1, z = step.view_row2;
    // Columns of T.
    vec3 a = turned(w, vec3(1, 0, 0)), b = turned(w, vec3(0, 1, 0)), c = turned(w, vec3(0, 0, 1));
    step.view_row0 = a.x * x + b.x * y + c.x * z;
    step.view_row1 = a.y * x + b.y * y + c.y * z;
    step.view_row2 = a.z * x + b.z * y + c.z * z;
    step.camera_centre += move.x * x + move.y * y + move.z * z;
}
