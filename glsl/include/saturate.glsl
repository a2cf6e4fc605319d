// Sums that saturate at the largest number instead of wrapping to 0, so that a need above 2^32 stays visible.

uint saturating_add(uint a, uint b) {
    uint sum = a + b;
    return sum < a ? 0xffffffffu : sum;
}
