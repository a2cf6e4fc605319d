#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
#include "gaussian.glsl"
#include "densify_rules.glsl"
#include "random.glsl"
// densify_geometry — write positions, scales and rotations of the densified model.
// Work:    64 old Gaussians per workgroup; the children of a parent are adjacent and replace it in the order.
// Reads:   step; old_means, old_scales, old_quats [N]; densify_actions [N]; child_offsets [N]
// Writes:  means, scales, quats [new N]
// Math:    clone: exact copy; split: mean + R (s * normal), ln s - ln 1.6 (3DGS); stack: r copies at one position with
//          1 - (1 - o')^r = o and the same light (3DGS-MCMC, see stack).
// Mirror:  src/reference/densify.rs::densify

layout(local_size_x = 64) in;
READ1(0, StepUniforms, step);
FETCH4(1, old_means);
FETCH4(2, old_scales);
FETCH4(3, old_quats);
FETCHU(4, densify_actions);
FETCHU(5, child_offsets);
WRITE(6, vec4, means);
WRITE(7, vec4, scales);
WRITE(8, vec4, quats);

// Opacity and size of r copies that together look like one Gaussian. In a picture, the copies absorb the light 2 pi
// s'^2 sum_j (1 - (1 - o')^j) / j, the original 2 pi s^2 o.
void stack(uint r, float opacity_min, inout float logit, inout vec3 log_scale) {
    float opacity = sigmoid(logit);
    float sum = logit > 0.0 ? logit + log(1.0 + exp(-logit)) : minus_log1m(opacity); // -ln(1 - o)
    float odds = expm1(max(sum / float(r), minus_log1m(opacity_min)));               // o' / (1 - o')
    float part = odds / (1.0 + odds), covered = 0.0, light = 0.0;
    for (uint j = 1u; j <= r; j++) {
        covered += (1.0 - covered) * part; // 1 - (1 - o')^j
        light += covered / float(j);
    }
    log_scale += 0.5 * log(opacity / light);
    logit = log(odds);
}

void main() {
    StepUniforms u = step;
    uint i = linear_group_id() * 64u + gl_LocalInvocationID.x;
    if (i >= u.gaussian_count) {
        return;
    }
    vec4 mean = fetch4(old_means, i), scale = fetch4(old_scales, i), quat = fetch4(old_quats, i);
    uint action = fetchu(densify_actions, i);
    uint to = fetchu(child_offsets, i);
    float inv_norm;
    mat3 rotation = rotation_from_quat(unit_quat(quat, inv_norm));
    for (uint child = 0u; child < children(action); child++) {
        vec4 m = mean, s = scale;
        if (action == ACTION_SPLIT && u.split_long != 0u) {
            float longest = max(scale.x, max(scale.y, scale.z));
            vec3 along = scale.x == longest ? vec3(1.0, 0.0, 0.0) : scale.y == longest ? vec3(0.0, 1.0, 0.0) : vec3(0.0, 0.0, 1.0);
            m.xyz += rotation * along * (exp(longest) * (child == 0u ? SPLIT_OFFSET : -SPLIT_OFFSET));
            s.xyz -= mix(vec3(SPLIT_OTHERS), vec3(SPLIT_LONG), along);
            m.w = -log((1.0 - SPLIT_OPACITY + exp(-mean.w)) / SPLIT_OPACITY); // logit of SPLIT_OPACITY times the opacity
        } else if (action == ACTION_SPLIT) {
            vec3 draw = vec3(normal_draw(u.seed, i, 3u * child), normal_draw(u.seed, i, 3u * child + 1u),
                normal_draw(u.seed, i, 3u * child + 2u));
            m.xyz += rotation * (exp(scale.xyz) * draw);
            s.xyz -= SPLIT_SHRINK;
        } else if (action > ACTION_STACK) {
            stack(children(action), u.prune_opacity, m.w, s.xyz);
        }
        means[to + child] = m;
        scales[to + child] = s;
        quats[to + child] = quat;
    }
}
