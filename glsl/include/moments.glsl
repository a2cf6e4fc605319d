// The gradient record of a splat from its sums over the pixels of a tile: six moments of p about the tile's centre, in
// the order of transposed_sums.glsl, then v_colour, then the channel. `mean` is relative to the tile's corner, `q` the
// conic in the exponent.

void write_record(uint instance, vec2 mean, vec3 q, float sums[SUMS], uint stamp) {
    float o0 = sums[0], ox = sums[1], oy = sums[2], oxx = sums[3], oxy = sums[4], oyy = sums[5];
    vec2 d = mean - vec2(float(TILE_WIDTH), float(TILE_HEIGHT)) * 0.5;
    vec3 conic = conic_from_exponent(q);
    float Sx = d.x * o0 - ox, Sy = d.y * o0 - oy;
    float Sxx = d.x * (d.x * o0 - 2.0 * ox) + oxx;
    float Sxy = d.x * (d.y * o0 - oy) - d.y * ox + oxy;
    float Syy = d.y * (d.y * o0 - 2.0 * oy) + oyy;
#ifdef CHANNEL
    o0 += sums[9]; // not in the moments above: shapes and places follow the photo
#endif
    v_instances_a[instance] = vec4(-(conic.x * Sx + conic.y * Sy), -(conic.y * Sx + conic.z * Sy), -0.5 * Sxx, -Sxy);
    v_instances_b[instance] = vec4(-0.5 * Syy, o0, sums[6], sums[7]);
    v_instances_c[instance] = vec2(sums[8], uintBitsToFloat(stamp));
}
