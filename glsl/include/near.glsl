// Tests if a Gaussian fogs the step's camera, or a camera on the way to another one. Needs gaussian.glsl.
//
// 0 <= z <= near and the slopes of the centre within the limits of the Jacobian, which are the image and a margin; or
// max(s) > FREE_SIZE |p|, in any direction. Views between the training cameras would show such Gaussians. The camera
// keeps its direction on the way, so each condition is linear in the share t of the way.

// The six conditions, each true if not negative.
float[6] conditions(StepUniforms u, vec3 p, float near) {
    return float[6](p.z, near - p.z, p.x - u.clamp_x_min * p.z, u.clamp_x_max * p.z - p.x, p.y - u.clamp_y_min * p.z,
        u.clamp_y_max * p.z - p.y);
}

// True if all conditions hold somewhere between a camera that sees the centre at `from` and one that sees it at `to`.
bool fogs(StepUniforms u, vec3 from, vec3 to, float near) {
    float first[6] = conditions(u, from, near), last[6] = conditions(u, to, near);
    float low = 0.0, high = 1.0;
    for (uint k = 0u; k < 6u; k++) {
        float zero = first[k] / (first[k] - last[k]);
        low = first[k] >= 0.0 ? low : last[k] >= 0.0 ? max(low, zero) : 2.0;
        high = last[k] >= 0.0 || first[k] < 0.0 ? high : min(high, zero);
    }
    return low <= high;
}

// `s` are the logarithms of the deviations.
bool is_near(StepUniforms u, vec3 mean, vec3 s) {
    vec3 d = mean - u.free_centre, from = to_view(u, mean);
    vec3 to = vec3(dot(u.view_row0, d), dot(u.view_row1, d), dot(u.view_row2, d));
    bool engulfs = exp(max(s.x, max(s.y, s.z))) > FREE_SIZE * length(from);
    return engulfs || fogs(u, from, from, u.near) || (u.free_near > 0.0 && fogs(u, from, to, u.free_near));
}
