// Counter-based random numbers: a hash of (seed, index, draw), the same on every device.
#ifndef RANDOM_GLSL
#define RANDOM_GLSL
#include "near_zero.glsl"

uint pcg_hash(uint v) {
    uint state = v * 747796405u + 2891336453u;
    uint word = ((state >> ((state >> 28) + 4u)) ^ state) * 277803737u;
    return (word >> 22) ^ word;
}

float uniform_draw(uint seed, uint index, uint draw) { // in (0, 1)
    return (float(pcg_hash(pcg_hash(pcg_hash(seed) + index) + draw) >> 8) + 0.5) * (1.0 / 16777216.0);
}

// Vulkan allows `cos` an error of 5e-4, and drivers use it, so a series replaces it.

float cos_of_turns(float turns) { // turns in [0, 1]; Taylor series over a quarter of a turn
    float half_turn = abs(turns - 0.5); // cos(2 pi turns) = -cos(2 pi half_turn)
    bool second = half_turn > 0.25;
    float x = 6.2831853071795865 * (second ? 0.5 - half_turn : half_turn), y = x * x;
    float c = 1.0 + y * (-1.0 / 2.0 + y * (1.0 / 24.0 + y * (-1.0 / 720.0 + y * (1.0 / 40320.0
        + y * (-1.0 / 3628800.0 + y * (1.0 / 479001600.0))))));
    return second ? c : -c;
}

float normal_draw(uint seed, uint index, uint draw) { // Box and Muller
    float r = sqrt(2.0 * minus_log1m(1.0 - uniform_draw(seed, index, 2u * draw)));
    return r * cos_of_turns(uniform_draw(seed, index, 2u * draw + 1u));
}
#endif
