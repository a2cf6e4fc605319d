// Tests if a Gaussian counts at no pixel: behind the near plane, too transparent, or certainly outside the image. Needs
// gaussian.glsl.

// Bits of z, or KEY_INVISIBLE. `mean` as in means; `s` are the logarithms of the deviations.
uint depth_key(StepUniforms u, vec4 mean, vec3 s) {
    vec3 view = to_view(u, mean.xyz);
    float log2_o = log2_opacity(mean.w);
    float sigma = exp(max(s.x, max(s.y, s.z)));
    float inv_z = 1.0 / view.z;
    vec2 limit = max(abs(vec2(u.clamp_x_min, u.clamp_y_min)), abs(vec2(u.clamp_x_max, u.clamp_y_max)));
    vec2 focal = vec2(u.fx, u.fy);
    vec2 stretch = focal * inv_z * sigma;
    vec2 variance = stretch * stretch * (1.0 + limit * limit) + COV2D_BLUR;
    float reach = 2.0 * LN2 * (log2_o - LOG2_ALPHA_MIN);
    vec2 radius = sqrt(variance * max(reach, 0.0)) * 1.001 + 0.5;
    vec2 centre = focal * view.xy * inv_z + vec2(u.cx, u.cy);
    bool inside = all(greaterThanEqual(centre + radius, vec2(0.0)))
        && all(lessThanEqual(centre - radius, vec2(float(u.width), float(u.height))));
    bool visible = view.z > u.near && reach > 0.0 && inside && finite(view.z);
    return visible ? floatBitsToUint(view.z) : KEY_INVISIBLE;
}

bool is_broken(vec4 mean, vec3 s) {
    return !finite(mean.x + mean.y + mean.z + mean.w + s.x + s.y + s.z);
}
