// The word that a partition publishes (sweep.glsl, look_back.glsl): two state bits, then a sum.

layout(constant_id = 24) const uint LOOKS = 16; // of a workgroup at words that are not there; then it recounts

const uint SWEEP_OWN = 1u << 30u;    // of the partition alone
const uint SWEEP_PREFIX = 2u << 30u; // of all partitions up to this one
const uint SWEEP_SUM = (1u << 30u) - 1u;

// Words have all that partitions tell, so no other memory has to be visible.
#define look_at(place) \
    atomicLoad(look_back[place], gl_ScopeDevice, gl_StorageSemanticsNone, gl_SemanticsRelaxed)

// A sum that saturates at the largest value of its bits.
uint sweep_add(uint a, uint b) {
    return min(a + b, SWEEP_SUM);
}

// Sums of the low and the high halves of words, neither of which can overflow, as one sum.
uint joined(uint low, uint high) {
    high += low >> 16u;
    return high >= 0x4000u ? SWEEP_SUM : high << 16u | low & 0xffffu;
}

// The total as counters have it: the largest number if it saturated.
uint total_of(uint first, uint own) {
    uint total = sweep_add(first, own);
    return total == SWEEP_SUM ? 0xffffffffu : total;
}
