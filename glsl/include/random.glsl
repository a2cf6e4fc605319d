// Counter-based random numbers: a hash of (seed, index, draw), the same on every device.

uint pcg_hash(uint v) {
    uint state = v * 747796405u + 2891336453u;
    uint word = ((state >> ((state >> 28) + 4u)) ^ state) * 277803737u;
    return (word >> 22) ^ word;
}

float uniform_draw(uint seed, uint index, uint draw) { // in (0, 1)
    return (float(pcg_hash(pcg_hash(pcg_hash(seed) + index) + draw) >> 8) + 0.5) * (1.0 / 16777216.0);
}

float normal_draw(uint seed, uint index, uint draw) { // Box and Muller
    float r = sqrt(-2.0 * log(uniform_draw(seed, index, 2u * draw)));
    return r * cos(6.2831853071795865 * uniform_draw(seed, index, 2u * draw + 1u));
}
