// What a partition tells those after it (sweep.glsl, look_back.glsl): two bits for the state of a word, then a sum.

const uint SWEEP_OWN = 1u << 30u;    // of the partition alone
const uint SWEEP_PREFIX = 2u << 30u; // of all partitions up to this one
const uint SWEEP_SUM = (1u << 30u) - 1u;

// A sum that does not leave the bits of a word; the largest stands for all above.
uint sweep_add(uint a, uint b) {
    return min(a + b, SWEEP_SUM);
}

// Sums of the low and the high halves of words, neither of which can overflow, as one sum.
uint joined(uint low, uint high) {
    high += low >> 16u;
    return high >= 0x4000u ? SWEEP_SUM : high << 16u | low & 0xffffu;
}
