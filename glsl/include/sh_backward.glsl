// Gradient through the spherical harmonics to the direction.

vec3 sh_direction_gradient(uint i, vec3 direction, vec3 v_colour) {
    vec3 v = vec3(0.0);
    if (SH_DEGREE == 0u) {
        return v;
    }
    vec3 g[15];
    sh_basis_gradient(direction, g);
    v += g[0] * dot(v_colour, band1(i, 0u)) + g[1] * dot(v_colour, band1(i, 1u)) + g[2] * dot(v_colour, band1(i, 2u));
    if (SH_DEGREE >= 2u) {
        vec4 a = value4(sh2, 4u * i), b = value4(sh2, 4u * i + 1u), d = value4(sh2, 4u * i + 2u), e = value4(sh2, 4u * i + 3u);
        v += g[3] * dot(v_colour, a.xyz) + g[4] * dot(v_colour, vec3(a.w, b.xy)) + g[5] * dot(v_colour, vec3(b.zw, d.x))
            + g[6] * dot(v_colour, d.yzw) + g[7] * dot(v_colour, e.xyz);
    }
    if (SH_DEGREE >= 3u) {
        vec4 a = value4(sh3, 6u * i), b = value4(sh3, 6u * i + 1u), d = value4(sh3, 6u * i + 2u);
        vec4 e = value4(sh3, 6u * i + 3u), f = value4(sh3, 6u * i + 4u), h = value4(sh3, 6u * i + 5u);
        v += g[8] * dot(v_colour, a.xyz) + g[9] * dot(v_colour, vec3(a.w, b.xy)) + g[10] * dot(v_colour, vec3(b.zw, d.x))
            + g[11] * dot(v_colour, d.yzw) + g[12] * dot(v_colour, e.xyz) + g[13] * dot(v_colour, vec3(e.w, f.xy))
            + g[14] * dot(v_colour, vec3(f.zw, h.x));
    }
    return v;
}
