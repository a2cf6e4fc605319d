// Updates an element of a plane and its moments like adam.comp: first the missed updates that look_up found
// (caught_up.glsl), then the step's update.

void shrink(uint plane, inout vec4 value, inout vec4 m, inout vec4 v, vec4 sums) {
    value = settled(plane, value, sums, m, v);
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
        vec4 value = name[e], m, v; \
        load_moments(name, e, m, v); \
        shrink(plane_##name, value, m, v, vec4(sums)); \
        name[e] = value; \
        store_moments(name, e, m, v, step.seed, MOMENT_PLANES + plane_##name); \
    } \
    void name##_step(StepUniforms u, uint e, vec4 g, vec4 rate) { \
        vec4 value = name[e], m, v; \
        load_moments(name, e, m, v); \
        if (is_late) { \
            shrink(plane_##name, value, m, v, vec4(sums)); \
        } \
        adam_step(u, value, m, v, g, rate); \
        name[e] = value; \
        store_moments(name, e, m, v, u.seed, plane_##name); \
    }

EACH_PLANE(LATE_ADAM)

shared uint touched_count; // Gaussians of the workgroup that are updated: row, and what they missed of colours
shared uint touched_row[64];
shared vec4 touched_late[64];

// Lists a Gaussian for EACH_COLOUR, after look_up. Returns its slot.
uint touch(uint i) {
    uint slot = atomicAdd(touched_count, 1u); // in any order: each is updated for itself
    touched_row[slot] = i;
    touched_late[slot] = is_late ? vec4(late_rest.zw, late_shrink) : vec4(0.0);
    return slot;
}

// Finds the listed Gaussian of a vec4 in a plane with this many vec4 per Gaussian. Returns the element.
uint find(uint at, uint stride, out uint slot, out uint part) {
    slot = at / stride;
    part = at - slot * stride;
    vec4 late = touched_late[slot];
    is_late = late.z > 0.0;
    late_rest.zw = late.xy;
    late_shrink = late.zw;
    return stride * touched_row[slot] + part;
}

// Runs UPDATE(name, e, slot, first) for each vec4 of the listed Gaussians in a plane from a degree on, shared among
// the invocations; `first`: of its floats among the coefficients above degree 0.
#define EACH_COLOUR(name, from, stride, before, UPDATE) \
    for (uint at = gl_LocalInvocationID.x, slot, part; SH_DEGREE >= from && at < stride * touched_count; at += 64u) { \
        uint e = find(at, stride, slot, part); \
        UPDATE(name, e, slot, before + 4u * part); \
    }
