// Sums over the invocations of a workgroup, all of which call sums_before.

#ifndef WALKERS
#define WALKERS 64u // invocations of a workgroup
#endif
shared uvec2 sums[2u * WALKERS];
uint sums_half = 0u; // halves take turns: one barrier a step is then enough

// Sums over earlier invocations, and over all.
uvec2 sums_before(uvec2 v, out uvec2 all) {
    uint lane = gl_LocalInvocationID.x;
    uvec2 sum = v;
    [[unroll]] for (uint distance = 1u; distance <= WALKERS; distance *= 2u) {
        sums_half = WALKERS - sums_half;
        sums[sums_half + lane] = sum;
        barrier();
        sum += distance <= lane ? sums[sums_half + lane - distance] : uvec2(0u);
    }
    all = sums[sums_half + WALKERS - 1u];
    return sum - v;
}
