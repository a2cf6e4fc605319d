// Gradients of splat s's coefficients, given the gradient of its colour, in the layout of sh_colour.glsl; 0 above the
// active degree.

void store_sh_gradient(uint s, float basis[15], vec3 v) {
    v_sh0[s] = vec4(SH_C0 * v, SH_DEGREE >= 1u ? basis[0] * v.x : 0.0);
    if (SH_DEGREE >= 1u) {
        vec3 a = basis[0] * v, b = basis[1] * v, c = basis[2] * v;
        v_sh1[2u * s] = vec4(a.yz, b.xy);
        v_sh1[2u * s + 1u] = vec4(b.z, c);
    }
    if (SH_DEGREE >= 2u) {
        vec3 a = basis[3] * v, b = basis[4] * v, c = basis[5] * v, d = basis[6] * v, e = basis[7] * v;
        v_sh2[4u * s] = vec4(a, b.x);
        v_sh2[4u * s + 1u] = vec4(b.yz, c.xy);
        v_sh2[4u * s + 2u] = vec4(c.z, d);
        v_sh2[4u * s + 3u] = vec4(e, SH_DEGREE >= 3u ? basis[8] * v.x : 0.0);
    }
    if (SH_DEGREE >= 3u) {
        vec3 a = basis[8] * v, b = basis[9] * v, c = basis[10] * v, d = basis[11] * v;
        vec3 e = basis[12] * v, f = basis[13] * v, g = basis[14] * v;
        v_sh3[5u * s] = vec4(a.yz, b.xy);
        v_sh3[5u * s + 1u] = vec4(b.z, c);
        v_sh3[5u * s + 2u] = vec4(d, e.x);
        v_sh3[5u * s + 3u] = vec4(e.yz, f.xy);
        v_sh3[5u * s + 4u] = vec4(f.z, g);
    }
}
