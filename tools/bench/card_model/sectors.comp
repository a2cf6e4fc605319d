#version 460
#include "layout.glsl"
// sectors — count the bits that a counting kernel has set, and clear them.
// Work:    one word of bits per invocation.
// Reads:   sectors [WORDS * cells]
// Writes:  counts [cells] from FIRST on; sectors = 0

layout(local_size_x = 64) in;
layout(constant_id = 0) const uint WORDS = 64; // words of bits per cell
layout(constant_id = 1) const uint FIRST = 0;  // cell of the first word
INOUT(0, uint, sectors);
INOUT(1, uint, counts);

void main() {
    uint i = gl_GlobalInvocationID.x;
    uint word = sectors[i];
    if (word != 0u) {
        atomicAdd(counts[FIRST + i / WORDS], uint(bitCount(word)));
        sectors[i] = 0u;
    }
}
