// Sums that stop at the largest number instead of beginning anew at 0: a need beyond 2^32 must look like one.

uint saturating_add(uint a, uint b) {
    uint sum = a + b;
    return sum < a ? 0xffffffffu : sum;
}
