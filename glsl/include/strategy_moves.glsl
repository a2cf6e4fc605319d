// What strategies add to an update of a Gaussian. The includer includes gaussian.glsl before.
#include "random.glsl"

// Adds the gradient of mean opacity and mean standard deviation. 3DGS-MCMC: L += opacity_weight sum o + scale_weight
// sum (s_x + s_y + s_z), over the visible Gaussians.
void regularise(StepUniforms u, float logit, vec3 log_scale, inout float v_logit, inout vec3 v_log_scale) {
    float opacity = sigmoid(logit);
    v_logit += u.opacity_weight * opacity * (1.0 - opacity);
    v_log_scale += u.scale_weight * exp(log_scale);
}

// Random move within the Gaussian's own shape; fainter Gaussians move farther. 3DGS-MCMC: x += noise
// sigmoid(-NOISE_STEEP (o - NOISE_OPACITY)) Sigma xi, xi standard normal.
vec3 random_move(StepUniforms u, uint i, float logit, vec3 log_scale, vec4 quat) {
    float inv_norm;
    mat3 rotation = rotation_from_quat(unit_quat(quat, inv_norm));
    vec3 draw = vec3(normal_draw(u.seed, i, 0u), normal_draw(u.seed, i, 1u), normal_draw(u.seed, i, 2u));
    vec3 variance = exp(2.0 * log_scale);
    float gate = u.noise * sigmoid(-NOISE_STEEP * (sigmoid(logit) - NOISE_OPACITY));
    return gate * (rotation * (variance * (draw * rotation)));
}

// The smallest deviation that photos can resolve after this view, given that before. Finer Gaussians would show as
// needles and gaps in close views. 3-D filter of Mip-Splatting as a lower limit: s >= FINEST z / f, f of the photo at
// full size; Adam's update is projected onto it.
float smallest_size(StepUniforms u, vec3 mean, float before) {
    vec3 p = to_view(u, mean);
    vec2 size = vec2(u.width, u.height), margin = SMOOTH_MARGIN * size * p.z;
    vec2 at = vec2(u.fx, u.fy) * p.xy + vec2(u.cx, u.cy) * p.z; // px times depth
    bool seen = p.z > u.near && all(greaterThan(at, -margin)) && all(lessThan(at, size * p.z + margin));
    float limit = u.finest * p.z;
    return !seen ? before : before > 0.0 ? min(before, limit) : limit;
}
