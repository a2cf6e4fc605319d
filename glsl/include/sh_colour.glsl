// Reads the coefficients k of Gaussian i, of the active degrees, and returns its colour before the clamp at 0. They are
// consecutive rgb triples over sh0 to sh3 with 1, 2, 4 and 5 vec4: sh0 ends with the first float of degree 1, sh2 with
// the first float of degree 3. value4: an element of a plane after missed updates (caught_up.glsl).

#ifndef value4
#define value4(name, e) fetch4(name, e)
#endif

vec3 sh_colour(uint i, float basis[15], out vec3 k[16]) {
    vec4 last = value4(sh0, i);
    k[0] = last.xyz;
    vec3 colour = COLOUR_BIAS + SH_C0 * k[0];
    if (SH_DEGREE >= 1u) {
        vec4 a = value4(sh1, 2u * i), b = value4(sh1, 2u * i + 1u);
        k[1] = vec3(last.w, a.xy);
        k[2] = vec3(a.zw, b.x);
        k[3] = b.yzw;
        colour += basis[0] * k[1] + basis[1] * k[2] + basis[2] * k[3];
    }
    if (SH_DEGREE >= 2u) {
        vec4 a = value4(sh2, 4u * i), b = value4(sh2, 4u * i + 1u), c = value4(sh2, 4u * i + 2u);
        last = value4(sh2, 4u * i + 3u);
        k[4] = a.xyz;
        k[5] = vec3(a.w, b.xy);
        k[6] = vec3(b.zw, c.x);
        k[7] = c.yzw;
        k[8] = last.xyz;
        colour += basis[3] * k[4] + basis[4] * k[5] + basis[5] * k[6] + basis[6] * k[7] + basis[7] * k[8];
    }
    if (SH_DEGREE >= 3u) {
        vec4 a = value4(sh3, 5u * i), b = value4(sh3, 5u * i + 1u), c = value4(sh3, 5u * i + 2u);
        vec4 d = value4(sh3, 5u * i + 3u), e = value4(sh3, 5u * i + 4u);
        k[9] = vec3(last.w, a.xy);
        k[10] = vec3(a.zw, b.x);
        k[11] = b.yzw;
        k[12] = c.xyz;
        k[13] = vec3(c.w, d.xy);
        k[14] = vec3(d.zw, e.x);
        k[15] = e.yzw;
        colour += basis[8] * k[9] + basis[9] * k[10] + basis[10] * k[11] + basis[11] * k[12] + basis[12] * k[13]
            + basis[13] * k[14] + basis[14] * k[15];
    }
    return colour;
}
