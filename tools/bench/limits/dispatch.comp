#version 460
// dispatch — a dispatch that does nothing, or writes words of 1: the size of a grid, too.

layout(local_size_x = 64) in;
#ifdef EMPTY
void main() {}
#else
layout(std430, set = 0, binding = 0) writeonly buffer to_block { uint to[]; };

void main() {
    to[gl_LocalInvocationIndex] = 1u;
}
#endif
