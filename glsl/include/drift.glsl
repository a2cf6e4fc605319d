// Tests a late Gaussian by its stored parameters, without reading its moments: may it be visible, or fog a camera, once
// it has caught up? Needs gaussian.glsl and caught_up.glsl.
//
// Missed updates move a parameter by a sum times m / sqrt(v). Adam lets no such ratio be more than (1 - beta1) /
// sqrt((1 - beta2) (1 - beta1^2 / beta2)) = 7.3, by Cauchy and Schwarz, and packed moments have room for 8. The tests
// below add the drift at that ratio, and what roundings can do, to each side of those in cull.glsl and near.glsl.

const float RATIO_MOST = 8.1;

bool may_count(StepUniforms u, vec4 mean, vec3 s, bool marks_near) {
    vec3 view = to_view(u, mean.xyz);
    float drift = RATIO_MOST * length(late_means.xyz) + 1e-5 * (length(mean.xyz) + length(view));
    float sigma = exp(max(s.x, max(s.y, s.z)) + RATIO_MOST * late_rest.x);
    float log2_o = log2_opacity(mean.w + RATIO_MOST * late_means.w);
    vec2 limit = max(abs(vec2(u.clamp_x_min, u.clamp_y_min)), abs(vec2(u.clamp_x_max, u.clamp_y_max)));
    float slant = 1.0 + dot(limit, limit);

    float way = u.free_near > 0.0 ? distance(u.free_centre, u.camera_centre) : 0.0; // to the other camera
    float apart = length(view) - drift;
    bool fogs = apart <= way + max(u.near, u.free_near) * sqrt(slant) || sigma > FREE_SIZE * apart;

    float z = max(view.z - drift, u.near), far = view.z + drift;
    vec2 focal = vec2(u.fx, u.fy), stretch = focal * sigma / z;
    float reach = 2.0 * LN2 * (log2_o - LOG2_ALPHA_MIN) + 2e-4;
    vec2 radius = sqrt((stretch * stretch * slant + COV2D_BLUR) * max(reach, 0.0)) * 1.002 + 1.0;
    vec2 low = view.xy - drift, high = view.xy + drift, centre = vec2(u.cx, u.cy), size = vec2(u.width, u.height);
    bool inside = all(greaterThanEqual(centre + focal * max(high / z, high / far) + radius, vec2(0.0)))
        && all(lessThanEqual(centre + focal * min(low / z, low / far) - radius, size));
    return (marks_near && fogs) || (far > u.near && reach > 0.0 && inside) || !finite(view.x + view.y + view.z + sigma);
}
