// Projection of one Gaussian: the forward quantities of project_forward, which project_backward recomputes.

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
};

// Unit quaternion, and 1 / length. If the squared length leaves the range of f32, the largest component is scaled to
// 1 first; a quaternion of 0 has no direction and gives NaN.
vec4 unit_quat(vec4 q, out float inv_norm) {
    float squared = dot(q, q);
    bool usual = squared > 1e-24 && squared < 1e24;
    float scale = usual ? 1.0 : 1.0 / max(max(abs(q.x), abs(q.y)), max(abs(q.z), abs(q.w)));
    vec4 scaled = q * scale;
    float inv_scaled = inversesqrt(usual ? squared : dot(scaled, scaled));
    inv_norm = scale * inv_scaled;
    return scaled * inv_scaled;
}

mat3 rotation_from_quat(vec4 q) { // unit (w, x, y, z)
    float w = q.x, x = q.y, y = q.z, z = q.w;
    return mat3(
        1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y),
        2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x),
        2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y));
}

// Subtracts the camera centre before the rotation, so that scenes far from the origin keep their precision.
vec3 to_view(StepUniforms step, vec3 mean) {
    vec3 d = mean - step.camera_centre;
    return vec3(dot(step.view_row0, d), dot(step.view_row1, d), dot(step.view_row2, d));
}

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
    return p;
}

// log2 of the sigmoid, without rounding the sigmoid first.
float log2_opacity(float logit) {
    return -log2(1.0 + exp(-clamp(logit, -30.0, 30.0)));
}

float sigmoid(float logit) {
    return exp2(log2_opacity(logit));
}

bool finite(float x) { // tests the exponent bits, because drivers fold x - x
    return (floatBitsToUint(x) & 0x7f800000u) != 0x7f800000u;
}
