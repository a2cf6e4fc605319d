// The exposure of a photo: EXPOSURE_ROWS rows of its shared parameters, from row `row` of the step.
//   row 0: g, ln of the gains of r, g, b
//   row 1: p; s(p) is the share that r, g, b take of g, b, r
//   row 2: q; s(q) is the share that they take of b, r, g
// c'_k = exp(g_k) (c_k + s(p_k) (c_k+1 - c_k) + s(q_k) (c_k+2 - c_k)), s(x) = x / (1 + |x| / EXPOSURE_SHARE).
// Shares keep grey as it is. They stay below EXPOSURE_SHARE < 1/4, so that the matrix has an inverse.
// step_rows and shared_parameters are declared before.

struct Exposure {
    vec3 gain, next, last;
    // ds/dp and ds/dq.
    vec3 next_slope, last_slope;
};

vec3 exposure_row(uint row, uint k) {
    return shared_parameters[step_rows[row] + k].rgb;
}

Exposure exposure(uint row) {
    vec3 p = exposure_row(row, 1u), q = exposure_row(row, 2u);
    vec3 by_p = 1.0 / (1.0 + abs(p) / EXPOSURE_SHARE), by_q = 1.0 / (1.0 + abs(q) / EXPOSURE_SHARE);
    return Exposure(exp(exposure_row(row, 0u)), p * by_p, q * by_q, by_p * by_p, by_q * by_q);
}

// The matrix: columns for r, g and b of the scene.
mat3 colours(Exposure of) {
    vec3 own = of.gain * (1.0 - of.next - of.last), next = of.gain * of.next, last = of.gain * of.last;
    return mat3(own.r, last.g, next.b, next.r, own.g, last.b, last.r, next.g, own.b);
}
