// Projection of one Gaussian: the forward quantities of project_forward, which project_backward recomputes. The
// includer includes gaussian.glsl before. ANTIALIASED: blur reduces opacity, so that a splat's light stays the same.

struct Projection {
    vec3 view;      // mean in camera space
    vec2 slope;     // x/z and y/z, clamped
    vec2 slope_raw; // x/z and y/z before the clamp
    vec3 t0, t1;    // rows of J W (2x3)
    mat3 rotation;  // of the Gaussian; columns are its axes in world space
    vec3 sigma;     // standard deviations
    vec3 m0, m1;    // rows of M = J W R S; cov2d = M M^T + blur
    vec3 cov;       // xx, xy, yy with blur
    vec3 conic;     // A, B, C
    vec3 q_m0, q_m1; // rows of Q M, Q being the matrix of the conic
#ifdef ANTIALIASED
    float coverage; // determinant of cov2d before blur by that after it, at least COVERAGE_MIN
    vec3 i_m0, i_m1; // rows of (M M^T)^-1 M - Q M: gradient of ln(coverage) / 2
#endif
};

Projection project_gaussian(StepUniforms step, vec3 mean, vec3 log_scale, vec4 quat) {
    Projection p;
    p.view = to_view(step, mean);
    float inv_z = 1.0 / p.view.z;
    p.slope_raw = p.view.xy * inv_z;
    p.slope = clamp(p.slope_raw, vec2(step.clamp_x_min, step.clamp_y_min), vec2(step.clamp_x_max, step.clamp_y_max));
    p.t0 = step.fx * inv_z * (step.view_row0 - p.slope.x * step.view_row2);
    p.t1 = step.fy * inv_z * (step.view_row1 - p.slope.y * step.view_row2);
    float inv_norm;
    p.rotation = rotation_from_quat(unit_quat(quat, inv_norm));
    p.sigma = exp(log_scale);
    p.m0 = (p.t0 * p.rotation) * p.sigma;
    p.m1 = (p.t1 * p.rotation) * p.sigma;
    float a = dot(p.m0, p.m0), b = dot(p.m0, p.m1), c = dot(p.m1, p.m1);
    vec3 crossed = cross(p.m0, p.m1);
    // Cauchy-Binet: every term is >= 0, so needles keep an accurate, positive determinant.
    float det = dot(crossed, crossed) + COV2D_BLUR * (a + c) + COV2D_BLUR * COV2D_BLUR;
    p.cov = vec3(a + COV2D_BLUR, b, c + COV2D_BLUR);
    p.conic = vec3(p.cov.z, -b, p.cov.x) / det;
    // The adjugate of M M^T times M is (m1 x n, n x m0). For a needle, conic times M would cancel; this form does not.
    p.q_m0 = (COV2D_BLUR * p.m0 + cross(p.m1, crossed)) / det;
    p.q_m1 = (COV2D_BLUR * p.m1 + cross(crossed, p.m0)) / det;
#ifdef ANTIALIASED
    float before = dot(crossed, crossed);
    bool covers = before > COVERAGE_MIN * det;
    p.coverage = covers ? before / det : COVERAGE_MIN;
    p.i_m0 = covers ? cross(p.m1, crossed) / before - p.q_m0 : vec3(0.0);
    p.i_m1 = covers ? cross(crossed, p.m0) / before - p.q_m1 : vec3(0.0);
#endif
    return p;
}
