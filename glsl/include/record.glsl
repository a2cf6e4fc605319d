// The splat record: three vec4, with the exponent in base 2 for fast blend loops.
//   0: mean x, mean y (px), a, b       1: c, log2 opacity, red, green       2: blue, z, half extent x, half extent y (px)
// exponent(d) = log2 o + a dx^2 + b dx dy + c dy^2 with d = mean - pixel; a = -A/(2 ln 2), b = -B/ln 2, c = -C/(2 ln
// 2).

vec3 exponent_from_conic(vec3 conic) {
    return conic * vec3(-0.5 / LN2, -1.0 / LN2, -0.5 / LN2);
}

vec3 conic_from_exponent(vec3 q) {
    return q * vec3(-2.0 * LN2, -LN2, -2.0 * LN2);
}
