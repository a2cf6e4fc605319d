// Coefficients of degree 1 of Gaussian i. Each band has a plane of vec4, packed with consecutive rgb triples.

vec3 band1(uint i, uint k) {
    vec4 a = fetch4(sh1, 3u * i), b = fetch4(sh1, 3u * i + 1u);
    return k == 0u ? a.xyz : k == 1u ? vec3(a.w, b.xy) : vec3(b.zw, fetch4(sh1, 3u * i + 2u).x);
}
