#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_control_flow_attributes : require
// arithmetic — how many multiplications and additions, exp2 or divisions the device does in a second: eight chains that do
// not wait for each other.

layout(constant_id = 0) const uint OPERATION = 0; // 0 v * a + b, 1 exp2, 2 division
layout(constant_id = 1) const uint ROUNDS = 4096;
layout(local_size_x = 64) in;
layout(scalar, set = 0, binding = 0) writeonly buffer to_block { float to[]; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    float a = 0.999 - float(i & 7u) * 1e-4, b = 1e-3; // values stay near 1: denormals are slow
    float v[8];
    [[unroll]] for (uint k = 0u; k < 8u; k++) {
        v[k] = float(k) * 0.1;
    }
    for (uint round = 0u; round < ROUNDS; round++) {
        [[unroll]] for (uint k = 0u; k < 8u; k++) {
            v[k] = OPERATION == 0u ? v[k] * a + b : OPERATION == 1u ? exp2(-v[k]) : a / (1.0 + v[k]);
        }
    }
    to[i] = v[0] + v[1] + v[2] + v[3] + v[4] + v[5] + v[6] + v[7];
}
