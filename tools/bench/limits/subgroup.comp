#version 460
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_shuffle : require
#extension GL_KHR_shader_subgroup_ballot : require
// subgroup — shuffles and ballots a second, counted by invocation.

layout(constant_id = 0) const uint OPERATION = 0; // 0 shuffle, 1 ballot
layout(constant_id = 1) const uint ROUNDS = 4096;
layout(local_size_x = 64) in;
layout(std430, set = 0, binding = 0) writeonly buffer to_block { uint to[]; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    uint v[8];
    [[unroll]] for (uint k = 0u; k < 8u; k++) {
        v[k] = i * (k + 3u);
    }
    for (uint round = 0u; round < ROUNDS; round++) {
        [[unroll]] for (uint k = 0u; k < 8u; k++) {
            v[k] += OPERATION == 0u ? subgroupShuffleXor(v[k], 1u + (k & 1u)) : subgroupBallot((v[k] & 2u) == 0u).x;
        }
    }
    to[i] = v[0] + v[1] + v[2] + v[3] + v[4] + v[5] + v[6] + v[7];
}
