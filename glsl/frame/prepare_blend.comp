#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
// prepare_blend — size the blend dispatches of a step without object layers.
// Work:    one invocation.
// Reads:   step, counters
// Writes:  dispatch_args (blend); failure (sticky bits)
// Mirror:  none (bookkeeping; tests/train/overflow.rs)

layout(local_size_x = 1) in;
READ1(0, StepUniforms, step);
INOUT1(1, Counters, counters);
INOUT(2, uint, dispatch_args);
INOUT1(3, uint, failure);
#include "total.glsl"

void main() {
    put_blend(0u);
}
