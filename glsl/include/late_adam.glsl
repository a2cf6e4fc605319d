// Updates of an element of a plane and of its moments (caught_up.glsl), as adam.comp makes them: first those that look_up has
// found missing, then that of the step.

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

#define LATE_ADAM(name, sums) \
    void name##_catch_up(uint e) { \
        vec4 value = name[e], m = m_##name[e], v = u_##name[e]; \
        shrink(value, m, v, vec4(sums)); \
        name[e] = value; \
        m_##name[e] = m; \
        u_##name[e] = v; \
    } \
    void name##_step(StepUniforms u, uint e, vec4 g, vec4 rate) { \
        vec4 value = name[e], m = m_##name[e], v = u_##name[e]; \
        if (is_late) { \
            shrink(value, m, v, vec4(sums)); \
        } \
        adam_step(u, value, m, v, g, rate); \
        name[e] = value; \
        m_##name[e] = m; \
        u_##name[e] = v; \
    }

EACH_PLANE(LATE_ADAM)
