// Densification decision for one Gaussian; the same function is used for counting and applying.

const uint ACTION_PRUNE = 0u;
const uint ACTION_KEEP = 1u;
const uint ACTION_CLONE = 2u;
const uint ACTION_SPLIT = 3u;
const uint ACTION_STACK = 4u; // plus the number of copies, 2 to RELOCATE_MOST

// True where new Gaussians are wanted.
bool grows_at(StepUniforms u, vec3 mean) {
    vec3 at = vec3(dot(u.grow_axis0, mean), dot(u.grow_axis1, mean), dot(u.grow_axis2, mean));
    return u.grow_low == u.grow_high || (all(greaterThanEqual(at, u.grow_low)) && all(lessThan(at, u.grow_high)));
}

uint densify_action(StepUniforms u, vec4 mean, vec3 log_scale, vec2 stats) {
    float logit = mean.w;
    float gradient = stats.y > 0.0 ? stats.x / stats.y : 0.0;
    float size = exp(max(log_scale.x, max(log_scale.y, log_scale.z)));
    bool grows = gradient >= u.densify_threshold && u.densify_threshold > 0.0 && grows_at(u, mean.xyz);
    bool splits = grows && size > u.densify_scale;
    float child = splits && u.split_long == 0u ? exp(max(log_scale.x, max(log_scale.y, log_scale.z)) - SPLIT_SHRINK) : size;
    float opacity = exp2(-log2(1.0 + exp(-clamp(logit, -30.0, 30.0))));
    opacity *= splits && u.split_long != 0u ? SPLIT_OPACITY : 1.0;
    bool drop = opacity < u.prune_opacity
        || (u.prune_big != 0u && child > u.prune_scale) || stats.y >= STAT_NEAR;
    return drop ? ACTION_PRUNE : splits ? ACTION_SPLIT : grows ? ACTION_CLONE : ACTION_KEEP;
}

uint children(uint action) {
    return action > ACTION_STACK ? action - ACTION_STACK : action == ACTION_PRUNE ? 0u : action == ACTION_KEEP ? 1u : 2u;
}
