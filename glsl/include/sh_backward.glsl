// The direction from the camera to Gaussian i, and its gradient through the spherical harmonics (sh_colour.glsl).

vec3 direction_of(vec3 offset, out float inv_distance) {
    inv_distance = inversesqrt(max(dot(offset, offset), 1e-24));
    return offset * inv_distance;
}

vec3 sh_direction_gradient(uint i, vec3 direction, vec3 v_colour) {
    vec3 g[15], v = vec3(0.0);
    sh_basis_gradient(direction, g);
    vec4 last = SH_DEGREE >= 1u ? value4(sh0, i) : vec4(0.0);
#define TERM(k, c) g[k] * dot(v_colour, c)
    ADD_COEFFICIENTS(v, i, last, TERM)
#undef TERM
    return v;
}
