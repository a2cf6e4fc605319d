// Carries the gradients of a splat back to the parameters of its Gaussian, after the code that reads coefficients.

struct GaussianGradient {
    vec3 mean;
    float logit;
    vec3 log_scale;
    vec4 quat;
    vec3 colour;       // without the channels that were clamped at 0
    vec3 by_direction; // part of the mean's gradient, through the direction from which its colour is seen
    bool is_finite;    // otherwise all are 0
};

// a: mean2d, conic xy; b: conic z, ln opacity, colour rg; and blue. `above`: a bit for each channel without a clamp.
GaussianGradient project_splat_backward(StepUniforms u, uint i, vec4 mean, vec3 log_scale, vec4 quat, vec4 a, vec4 b,
    float blue, uint above) {
    bool sane = finite(dot(abs(a), vec4(1.0)) + dot(abs(b), vec4(1.0)) + abs(blue));
    float inv_distance;
    vec3 direction = direction_of(mean.xyz - u.camera_centre, inv_distance);
    vec3 v_colour = mix(vec3(0.0), vec3(b.zw, blue), notEqual(uvec3(above) & uvec3(1u, 2u, 4u), uvec3(0u)));
    vec3 v_direction = sh_direction_gradient(i, direction, v_colour);
    vec3 by_direction = (v_direction - direction * dot(direction, v_direction)) * inv_distance, v_mean = by_direction;
    Projection p = project_gaussian(u, mean.xyz, log_scale, quat);

    // conic -> covariance -> M
    vec3 q = p.conic;
    vec3 v = vec3(a.z, 0.5 * a.w, b.x); // symmetric matrix of the conic's gradient
    vec3 e0 = -2.0 * (v.x * p.q_m0 + v.y * p.q_m1), e1 = -2.0 * (v.y * p.q_m0 + v.z * p.q_m1); // -2 V Q M
    vec3 v_m0 = q.x * e0 + q.y * e1, v_m1 = q.y * e0 + q.z * e1;                             // -2 Q V Q M
    vec3 v_log_scale = p.q_m0 * e0 + p.q_m1 * e1; // diagonal of M^T v_M
#ifdef ANTIALIASED
    // ln opacity -> coverage -> M
    v_m0 += b.y * p.i_m0;
    v_m1 += b.y * p.i_m1;
    v_log_scale += b.y * (p.m0 * p.i_m0 + p.m1 * p.i_m1);
#endif
    vec3 w0 = v_m0 * p.sigma, w1 = v_m1 * p.sigma;
    vec3 v_t0 = p.rotation * w0, v_t1 = p.rotation * w1;
    mat3 v_r = mat3(w0.x * p.t0 + w1.x * p.t1, w0.y * p.t0 + w1.y * p.t1, w0.z * p.t0 + w1.z * p.t1);

    // rotation -> quaternion, then through the normalisation
    float inv_norm;
    vec4 n = unit_quat(quat, inv_norm);
    vec4 v_n = 2.0 * vec4(
        n.y * (v_r[1].z - v_r[2].y) + n.z * (v_r[2].x - v_r[0].z) + n.w * (v_r[0].y - v_r[1].x),
        -2.0 * n.y * (v_r[1].y + v_r[2].z) + n.z * (v_r[0].y + v_r[1].x) + n.w * (v_r[0].z + v_r[2].x) + n.x * (v_r[1].z - v_r[2].y),
        n.y * (v_r[0].y + v_r[1].x) - 2.0 * n.z * (v_r[0].x + v_r[2].z) + n.w * (v_r[1].z + v_r[2].y) + n.x * (v_r[2].x - v_r[0].z),
        n.y * (v_r[0].z + v_r[2].x) + n.z * (v_r[1].z + v_r[2].y) - 2.0 * n.w * (v_r[0].x + v_r[1].y) + n.x * (v_r[0].y - v_r[1].x));
    vec4 v_quat = (v_n - n * dot(n, v_n)) * inv_norm;

    // Jacobian and mean2d -> camera space
    float inv_z = 1.0 / p.view.z;
    vec2 focal = vec2(u.fx, u.fy) * inv_z;
    vec2 v_scale = vec2(dot(v_t0, u.view_row0) - p.slope.x * dot(v_t0, u.view_row2),
        dot(v_t1, u.view_row1) - p.slope.y * dot(v_t1, u.view_row2)); // by fx/z and fy/z
    vec2 v_slope = -focal * vec2(dot(v_t0, u.view_row2), dot(v_t1, u.view_row2));
    v_slope = mix(vec2(0.0), v_slope, equal(p.slope, p.slope_raw));
    v_slope += vec2(u.fx, u.fy) * a.xy; // the centre uses the unclamped slope
    vec3 v_view = vec3(v_slope * inv_z, -inv_z * (dot(v_slope, p.slope_raw) + dot(v_scale, focal)));
    v_mean += u.view_row0 * v_view.x + u.view_row1 * v_view.y + u.view_row2 * v_view.z;

    float opacity = exp2(log2_opacity(mean.w));
    float v_logit = b.y * (1.0 - opacity);
    float size = dot(abs(v_mean) + abs(v_log_scale) + abs(v_colour), vec3(1.0)) + dot(abs(v_quat), vec4(1.0)) + abs(v_logit);
    sane = sane && finite(size) && size < GRADIENT_MAX;
    GaussianGradient gradient = GaussianGradient(vec3(0.0), 0.0, vec3(0.0), vec4(0.0), vec3(0.0), vec3(0.0), false);
    if (sane) {
        gradient = GaussianGradient(v_mean, v_logit, v_log_scale, v_quat, v_colour, by_direction, true);
    } else {
        atomicAdd(counters.nonfinite_count, 1u);
        atomicMin(counters.nonfinite_first, i);
    }
    return gradient;
}
