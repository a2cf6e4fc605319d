// Gradient through the spherical harmonics of coefficients k to the direction.

vec3 sh_direction_gradient(vec3 k[16], vec3 direction, vec3 v_colour) {
    vec3 v = vec3(0.0);
    if (SH_DEGREE == 0u) {
        return v;
    }
    vec3 g[15];
    sh_basis_gradient(direction, g);
    v += g[0] * dot(v_colour, k[1]) + g[1] * dot(v_colour, k[2]) + g[2] * dot(v_colour, k[3]);
    if (SH_DEGREE >= 2u) {
        v += g[3] * dot(v_colour, k[4]) + g[4] * dot(v_colour, k[5]) + g[5] * dot(v_colour, k[6]) + g[6] * dot(v_colour, k[7])
            + g[7] * dot(v_colour, k[8]);
    }
    if (SH_DEGREE >= 3u) {
        v += g[8] * dot(v_colour, k[9]) + g[9] * dot(v_colour, k[10]) + g[10] * dot(v_colour, k[11]) + g[11] * dot(v_colour, k[12])
            + g[12] * dot(v_colour, k[13]) + g[13] * dot(v_colour, k[14]) + g[14] * dot(v_colour, k[15]);
    }
    return v;
}
