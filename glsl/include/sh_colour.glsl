// Colour of Gaussian i before the clamp at 0.

vec3 sh_colour(uint i, float basis[15]) {
    vec3 c = COLOUR_BIAS + SH_C0 * value4(sh0, i).xyz;
    if (SH_DEGREE >= 1u) {
        c += basis[0] * band1(i, 0u) + basis[1] * band1(i, 1u) + basis[2] * band1(i, 2u);
    }
    if (SH_DEGREE >= 2u) {
        vec4 a = value4(sh2, 4u * i), b = value4(sh2, 4u * i + 1u), d = value4(sh2, 4u * i + 2u), e = value4(sh2, 4u * i + 3u);
        c += basis[3] * a.xyz + basis[4] * vec3(a.w, b.xy) + basis[5] * vec3(b.zw, d.x) + basis[6] * d.yzw + basis[7] * e.xyz;
    }
    if (SH_DEGREE >= 3u) {
        vec4 a = value4(sh3, 6u * i), b = value4(sh3, 6u * i + 1u), d = value4(sh3, 6u * i + 2u);
        vec4 e = value4(sh3, 6u * i + 3u), f = value4(sh3, 6u * i + 4u), g = value4(sh3, 6u * i + 5u);
        c += basis[8] * a.xyz + basis[9] * vec3(a.w, b.xy) + basis[10] * vec3(b.zw, d.x) + basis[11] * d.yzw
            + basis[12] * e.xyz + basis[13] * vec3(e.w, f.xy) + basis[14] * vec3(f.zw, g.x);
    }
    return c;
}
