// Applies the updates that a Gaussian has missed: the steps since its last update, in which its gradient was 0. The
// includer declares touched_at and missed, and the planes that it names to CAUGHT_UP with their moments
// (moments_store.glsl); plane4 is an element of one of them. Without LAZY, nothing is missed.
//
// Without a gradient the moments shrink by beta1 and beta2, so that the k-th missed update moves a parameter by r^k m /
// sqrt(v) times w, with r = beta1 / sqrt(beta2) and w the bias-corrected rate of that update. The sums of r^k w are the
// same for all Gaussians that missed the same number of updates; the host computes them in f64.
//
// missed: rows of MISSED_VECTORS. Row 0: the number of updates before this step, and the last one that no Gaussian
// missed. Row 1 + age: after this many missed updates, the sums for means and opacities; for scales, rotations, colours
// of degree 0 and of higher degrees; beta1^age, beta2^age.

#ifdef LAZY

#ifndef touched
#define touched(i) fetchu(touched_at, i)
#endif

bool is_late = false;      // the Gaussian has missed updates; then
vec4 late_means, late_rest; // the sums,
vec2 late_shrink;          // and the factors of its moments

vec4 missed_row(uint row, uint column) {
    return uintBitsToFloat(missed[MISSED_VECTORS * row + column]);
}

// Number of updates before this step that a trained Gaussian has missed.
uint missed_updates(uint i) {
    uvec4 now = missed[0];
    return min(now.x - max(touched(i), now.y), MISSED_MOST);
}

void look_up(uint age) {
    is_late = age > 0u;
    late_means = missed_row(1u + age, 0u);
    late_rest = missed_row(1u + age, 1u);
    late_shrink = missed_row(1u + age, 2u).xy;
}

// Looks up the updates that a Gaussian has missed before this step, if it is trained.
void look_up_trained(StepUniforms u, uint i) {
    look_up(i < u.trained_count ? missed_updates(i) : 0u);
}

// The same after this step's update, which the Gaussian may also have missed.
void look_up_after(StepUniforms u, uint i) {
    uvec4 now = missed[0];
    uint last = max(touched(i), now.y);
    is_late = false;
    if (last <= now.x) {
        look_up(min(now.x - last, MISSED_MOST));
        is_late = true;
        vec2 shrink = late_shrink * vec2(ADAM_BETA1, ADAM_BETA2);
        float factor = shrink.x * inversesqrt(shrink.y) * u.adam_correction1 * inversesqrt(u.adam_correction2);
        late_means += factor * u.rate_means;
        late_rest += factor * vec4(u.rate_scales, u.rate_quats, u.rate_sh0, u.rate_sh_rest);
    }
}

// What a sum is multiplied by. Where v is 0, so is m.
vec4 late_direction(vec4 m, vec4 v) {
    return m / (sqrt(v) + ADAM_EPSILON);
}

// Planes of parameters, for the random draws of packed moments and for limits.
const uint plane_means = 0u, plane_scales = 1u, plane_quats = 2u, plane_sh0 = 3u, plane_sh1 = 4u, plane_sh2 = 5u, plane_sh3 = 6u;

// An element after missed updates. These move a scale in one direction, so the limit of each is the limit at the end.
vec4 settled(uint plane, vec4 value, vec4 sums, vec4 m, vec4 v) {
    value -= sums * late_direction(m, v);
    return plane == plane_scales ? limited(value) : value;
}

// Declares value4 of a plane: an element after the missed updates that look_up found.
#define CAUGHT_UP(name, sums) \
    vec4 name##_now(uint e) { \
        vec4 value = plane4(name, e); \
        if (is_late) { \
            vec4 m, v; \
            load_moments(name, e, m, v); \
            value = settled(plane_##name, value, vec4(sums), m, v); \
        } \
        return value; \
    }
#define value4(name, e) name##_now(e)

// Declares something of every plane, with its sums.
#define EACH_PLANE(DECLARE) \
    DECLARE(means, late_means) \
    DECLARE(scales, late_rest.x) \
    DECLARE(quats, late_rest.y) \
    DECLARE(sh0, late_rest.zzzw) \
    DECLARE(sh1, late_rest.w) \
    DECLARE(sh2, late_rest.w) \
    DECLARE(sh3, late_rest.w)

#else
#define value4(name, e) plane4(name, e)
#define look_up_trained(u, i)
#endif
