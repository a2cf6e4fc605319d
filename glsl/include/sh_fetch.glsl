// Coefficients of degree 1 of Gaussian i. Each band has a plane of vec4, packed with consecutive rgb triples.
// value4: an element of a plane, with what the Gaussian has missed (caught_up.glsl).

#ifndef value4
#define value4(name, e) fetch4(name, e)
#endif

vec3 band1(uint i, uint k) {
    vec4 a = value4(sh1, 3u * i), b = value4(sh1, 3u * i + 1u);
    return k == 0u ? a.xyz : k == 1u ? vec3(a.w, b.xy) : vec3(b.zw, value4(sh1, 3u * i + 2u).x);
}
