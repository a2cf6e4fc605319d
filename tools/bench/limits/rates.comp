#version 460
#extension GL_EXT_control_flow_attributes : require
// rates — how often a second the device does one thing: multiplies and adds, exp2, divides, loads 16 bytes of shared memory
// or adds to a word of a buffer. Eight chains do not wait for each other.

layout(constant_id = 0) const uint OPERATION = 0; // 0 v * a + b, 1 exp2, 2 division, 3 load, 4 and 5 atomic additions
layout(constant_id = 1) const uint ROUNDS = 4096;
layout(local_size_x = 64) in;
layout(std430, set = 0, binding = 0) buffer to_block { uint to[]; };
shared vec4 bank[64];

void main() {
    uint i = gl_GlobalInvocationID.x, lane = gl_LocalInvocationIndex;
    if (OPERATION >= 4u) { // each invocation a word of its own, or one of its workgroup
        uint at = OPERATION == 4u ? i : gl_WorkGroupID.x * 64u, sum = 0u;
        for (uint round = 0u; round < ROUNDS; round++) {
            [[unroll]] for (uint k = 0u; k < 8u; k++) {
                sum += atomicAdd(to[at], 1u + k);
            }
        }
        to[gl_NumWorkGroups.x * 64u + i] = sum;
        return;
    }
    if (OPERATION == 3u) {
        vec4 sum = vec4(0.0);
        bank[lane] = vec4(float(lane));
        barrier();
        for (uint round = 0u; round < ROUNDS; round++) {
            [[unroll]] for (uint k = 0u; k < 8u; k++) {
                sum += bank[(lane + round + k) & 63u];
            }
        }
        to[i] = floatBitsToUint(sum.x + sum.y + sum.z + sum.w);
        return;
    }
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
    to[i] = floatBitsToUint(v[0] + v[1] + v[2] + v[3] + v[4] + v[5] + v[6] + v[7]);
}
