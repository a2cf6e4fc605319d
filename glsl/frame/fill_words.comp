#version 460
#include "layout.glsl"

// fill_words — write one word to a run of words of a buffer.
// Work:   one invocation per word.
// Writes: words [first .. first + count].

WRITE(0, uint, words);
PUSH {
    uint first;
    uint count;
    uint word;
} push;

layout(local_size_x = 64) in;

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i < push.count) {
        words[push.first + i] = push.word;
    }
}
