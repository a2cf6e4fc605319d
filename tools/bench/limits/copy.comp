#version 460
#extension GL_EXT_samplerless_texture_functions : require
// copy — bytes a second from one large buffer to another, as the engine's kernels move them.

layout(local_size_x = 64) in;
#ifdef TEXEL
layout(set = 0, binding = 0) uniform textureBuffer from;
#define FROM(i) texelFetch(from, int(i))
#else
layout(std430, set = 0, binding = 0) readonly buffer from_block { vec4 from[]; };
#define FROM(i) from[i]
#endif
layout(std430, set = 0, binding = 1) writeonly buffer to_block { vec4 to[]; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    to[i] = FROM(i);
}
