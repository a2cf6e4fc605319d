#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
#include "gaussian.glsl"
#include "projection.glsl"
#include "sh.glsl"
// project_backward — carry the gradients of each splat back to the parameters of its Gaussian.
// Work:    64 splats per workgroup.
// Reads:   step, failure; gaussian_from_splat [V]; means, scales, quats, sh0..sh3 [N]; v_splats [V,3]
// Writes:  v_means [V] (xyz world, w opacity logit), v_scales [V] (ln), v_quats [V], v_sh0 [V], v_sh1 [V,3], v_sh2 [V,4],
//          v_sh3 [V,6]; counters.nonfinite_* (integer atomics): Gaussians with a nonfinite gradient, which becomes 0
// Math:    dSigma = -Q dQ Q through the inverse; dM = 2 G M; Jacobian, view direction and mean2d paths reach the mean;
//          a clamped x/z or y/z has gradient 0; so does a colour clamped at 0;
//          variant antialiased: the opacity reaches M through the coverage.
// Mirror:  src/reference/project.rs::project_backward

layout(constant_id = 11) const uint SH_DEGREE = 3;
layout(local_size_x = 64) in;
READ1(0, StepUniforms, step);
READ1(1, uint, failure);
FETCHU(2, gaussian_from_splat);
FETCH4(3, means);
FETCH4(4, scales);
FETCH4(5, quats);
FETCH4(6, sh0);
FETCH4(7, sh1);
FETCH4(8, sh2);
FETCH4(9, sh3);
FETCH4(10, v_splats);
WRITE(11, vec4, v_means);
WRITE(12, vec4, v_scales);
WRITE(13, vec4, v_quats);
WRITE(14, vec4, v_sh0);
WRITE(15, vec4, v_sh1);
WRITE(16, vec4, v_sh2);
WRITE(17, vec4, v_sh3);
INOUT1(18, Counters, counters);

#include "sh_fetch.glsl"
#include "sh_colour.glsl"
#include "sh_backward.glsl"
#include "sh_store.glsl"

void main() {
    StepUniforms u = step;
    uint s = linear_group_id() * 64u + gl_LocalInvocationID.x;
    if (s >= counters.visible_count || failure != 0u) {
        return;
    }
    uint i = fetchu(gaussian_from_splat, s);
    vec4 mean = fetch4(means, i), quat = fetch4(quats, i);
    Projection p = project_gaussian(u, mean.xyz, fetch4(scales, i).xyz, quat);
    vec4 a = fetch4(v_splats, 3u * s), b = fetch4(v_splats, 3u * s + 1u);
    float blue = fetch4(v_splats, 3u * s + 2u).x;
    bool sane = finite(dot(abs(a), vec4(1.0)) + dot(abs(b), vec4(1.0)) + abs(blue));

    vec3 offset = mean.xyz - u.camera_centre;
    float inv_distance = inversesqrt(max(dot(offset, offset), 1e-24));
    vec3 direction = offset * inv_distance;
    float basis[15];
    sh_basis(direction, SH_DEGREE, basis);
    vec3 colour = sh_colour(i, basis);
    vec3 v_colour = mix(vec3(0.0), vec3(b.zw, blue), greaterThan(colour, vec3(0.0)));
    vec3 v_direction = sh_direction_gradient(i, direction, v_colour);
    vec3 v_mean = (v_direction - direction * dot(direction, v_direction)) * inv_distance;

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
    if (!sane) {
        atomicAdd(counters.nonfinite_count, 1u);
        atomicMin(counters.nonfinite_first, i);
    }
    v_means[s] = sane ? vec4(v_mean, v_logit) : vec4(0.0);
    v_scales[s] = sane ? vec4(v_log_scale, 0.0) : vec4(0.0);
    v_quats[s] = sane ? v_quat : vec4(0.0);
    store_sh_gradient(s, basis, sane ? v_colour : vec3(0.0));
}
