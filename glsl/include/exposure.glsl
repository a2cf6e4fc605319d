// The exposure of a photo: EXPOSURE_ROWS rows of its shared parameters, from row `row` of the step.
//   row 0: g, ln of the gains of r, g, b
//   row 1: a, how much r, g, b take of g, b, r
//   row 2: b, how much they take of b, r, g
// c'_k = exp(g_k) (c_k + s(a_k) (c_k+1 - c_k) + s(b_k) (c_k+2 - c_k)), s(x) = x / (1 + |x| / EXPOSURE_SHARE).
// Grey stays grey without gains. Shares stay below EXPOSURE_SHARE < 1/4, so that the matrix has an inverse.
// step_rows and shared_parameters are declared before.

struct Exposure {
    vec3 gain, next, last;
    // ds/da and ds/db.
    vec3 next_slope, last_slope;
};

vec3 exposure_row(uint row, uint k) {
    return shared_parameters[step_rows[row] + k].rgb;
}

Exposure exposure(uint row) {
    vec3 a = exposure_row(row, 1u), b = exposure_row(row, 2u);
    vec3 by_a = 1.0 / (1.0 + abs(a) / EXPOSURE_SHARE), by_b = 1.0 / (1.0 + abs(b) / EXPOSURE_SHARE);
    return Exposure(exp(exposure_row(row, 0u)), a * by_a, b * by_b, by_a * by_a, by_b * by_b);
}

// The matrix: columns for r, g and b of the scene.
mat3 colours(Exposure of) {
    vec3 own = of.gain * (1.0 - of.next - of.last), next = of.gain * of.next, last = of.gain * of.last;
    return mat3(own.r, last.g, next.b, next.r, own.g, last.b, last.r, next.g, own.b);
}
