// How a layer's pixels wait for the backward pass: transmittance, position of the last splat, signs of the L1 gradient.

uint layer_pixel(TileJob t, uint k) { // index into layer_state
    return t.slot * (TILE_WIDTH * TILE_HEIGHT) + k * SUBGROUP_SIZE + gl_LocalInvocationID.x;
}

const uint LAST_MASK = 0x03ffffffu; // 26 bits of position, above them three signs (0: 0, 1: +, 2: -)

uint pack_signs(vec3 d) {
    uvec3 s = mix(mix(uvec3(0u), uvec3(2u), lessThan(d, vec3(0.0))), uvec3(1u), greaterThan(d, vec3(0.0)));
    return (s.x << 26) | (s.y << 28) | (s.z << 30);
}

vec3 unpack_signs(uint packed) {
    uvec3 s = (uvec3(packed) >> uvec3(26u, 28u, 30u)) & 3u;
    return vec3(s & 1u) - vec3(s >> 1);
}
