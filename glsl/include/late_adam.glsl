// Updates an element of a plane and its moments like adam.comp: first the missed updates that look_up found
// (caught_up.glsl), then the step's update.

void shrink(inout vec4 value, inout vec4 m, inout vec4 v, vec4 sums) {
    value -= sums * late_direction(m, v);
    m *= late_shrink.x;
    v *= late_shrink.y;
}

void adam_step(StepUniforms u, inout vec4 value, inout vec4 m, inout vec4 v, vec4 g, vec4 rate) {
    m = ADAM_BETA1 * m + (1.0 - ADAM_BETA1) * g;
    v = ADAM_BETA2 * v + (1.0 - ADAM_BETA2) * g * g;
    value -= rate * (m * u.adam_correction1) / (sqrt(v * u.adam_correction2) + ADAM_EPSILON);
}

// Plane numbers for the random draws of packed moments.
const uint plane_means = 0u, plane_scales = 1u, plane_quats = 2u, plane_sh0 = 3u, plane_sh1 = 4u, plane_sh2 = 5u, plane_sh3 = 6u;

#define LATE_ADAM(name, sums) \
    void name##_catch_up(uint e) { \
        vec4 value = name[e], m, v; \
        load_moments(name, e, m, v); \
        shrink(value, m, v, vec4(sums)); \
        name[e] = value; \
        store_moments(name, e, m, v, step.seed, MOMENT_PLANES + plane_##name); \
    } \
    void name##_step(StepUniforms u, uint e, vec4 g, vec4 rate) { \
        vec4 value = name[e], m, v; \
        load_moments(name, e, m, v); \
        if (is_late) { \
            shrink(value, m, v, vec4(sums)); \
        } \
        adam_step(u, value, m, v, g, rate); \
        name[e] = value; \
        store_moments(name, e, m, v, u.seed, plane_##name); \
    }

EACH_PLANE(LATE_ADAM)
