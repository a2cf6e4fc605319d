// Colour of a Gaussian by its coefficients of the active degrees. They are consecutive rgb triples over sh0 to sh3 with
// 1, 2, 4 and 5 vec4: sh0 ends with the first float of degree 1, sh2 with the first float of degree 3. value4: an
// element of a plane after missed updates (caught_up.glsl).

#ifndef value4
#define value4(name, e) fetch4(name, e)
#endif

// Adds TERM(k, c) of the coefficients c of Gaussian i above degree 0 to a sum. `last` is its sh0. Each coefficient is
// used once, so few registers hold them.
#define ADD_COEFFICIENTS(sum, i, last, TERM) \
    if (SH_DEGREE >= 1u) { \
        vec4 a = value4(sh1, 2u * i), b = value4(sh1, 2u * i + 1u); \
        sum += TERM(0, vec3(last.w, a.xy)) + TERM(1, vec3(a.zw, b.x)) + TERM(2, b.yzw); \
    } \
    if (SH_DEGREE >= 2u) { \
        vec4 a = value4(sh2, 4u * i), b = value4(sh2, 4u * i + 1u), c = value4(sh2, 4u * i + 2u); \
        last = value4(sh2, 4u * i + 3u); \
        sum += TERM(3, a.xyz) + TERM(4, vec3(a.w, b.xy)) + TERM(5, vec3(b.zw, c.x)) + TERM(6, c.yzw) \
            + TERM(7, last.xyz); \
    } \
    if (SH_DEGREE >= 3u) { \
        vec4 a = value4(sh3, 5u * i), b = value4(sh3, 5u * i + 1u), c = value4(sh3, 5u * i + 2u); \
        vec4 d = value4(sh3, 5u * i + 3u), e = value4(sh3, 5u * i + 4u); \
        sum += TERM(8, vec3(last.w, a.xy)) + TERM(9, vec3(a.zw, b.x)) + TERM(10, b.yzw) + TERM(11, c.xyz) \
            + TERM(12, vec3(c.w, d.xy)) + TERM(13, vec3(d.zw, e.x)) + TERM(14, e.yzw); \
    }

// Colour before the clamp at 0.
vec3 sh_colour(uint i, float basis[15]) {
    vec4 last = value4(sh0, i);
    vec3 colour = COLOUR_BIAS + SH_C0 * last.xyz;
#define TERM(k, c) basis[k] * c
    ADD_COEFFICIENTS(colour, i, last, TERM)
#undef TERM
    return colour;
}
