// State of a layer's pixel for the backward pass: transmittance, position of the last splat, signs of the L1 gradients.

uint layer_pixel(TileJob t, uint k) { // index into layer_state
    return t.layer_tile * (TILE_WIDTH * TILE_HEIGHT) + tile_pixel(t, k);
}

const uint LAST_MASK = 0x00ffffffu; // 24 bits of position, then four signs (0: 0, 1: +, 2: -): alpha, rgb

uint pack_signs(vec4 d) {
    uvec4 s = mix(mix(uvec4(0u), uvec4(2u), lessThan(d, vec4(0.0))), uvec4(1u), greaterThan(d, vec4(0.0)));
    return (s.w << 24) | (s.x << 26) | (s.y << 28) | (s.z << 30);
}

vec4 unpack_signs(uint packed) {
    uvec4 s = (uvec4(packed) >> uvec4(26u, 28u, 30u, 24u)) & 3u;
    return vec4(s & 1u) - vec4(s >> 1);
}
