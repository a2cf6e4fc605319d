// Gradients of a camera's pose by its Gaussians: the force, and the torque around the camera, both in world axes.
// Moving the camera by u moves all Gaussians by -u: force = sum dL/dp. Rotating it rotates them around the camera, but
// not their colours: torque = sum (p - c) x (dL/dp without the view direction's part) + the part of the orientations,
// (q v_xyz - v_w q_xyz + q_xyz x v_xyz) / 2.

shared vec3 forces[64], torques[64];

vec3 torque_of(vec3 offset, vec3 of_place, vec4 q, vec4 v_q) { // quaternions are w, x, y, z
    return cross(offset, of_place) + 0.5 * (q.x * v_q.yzw - v_q.x * q.yzw + cross(q.yzw, v_q.yzw));
}

// Sums what the invocations of a workgroup have; forces[0] and torques[0] have the result for the first one.
void sum_pose(vec3 force, vec3 torque) {
    uint lane = gl_LocalInvocationID.x;
    forces[lane] = force;
    torques[lane] = torque;
    for (uint half_ = 32u; half_ > 0u; half_ /= 2u) {
        barrier();
        if (lane < half_) {
            forces[lane] += forces[lane + half_];
            torques[lane] += torques[lane + half_];
        }
    }
}
