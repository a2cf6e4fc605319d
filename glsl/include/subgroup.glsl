// Butterflies over one subgroup by shuffles, the one subgroup operation that is fast on all devices. Unrolled by hand,
// because some drivers do not unroll a loop over the distances, and lavapipe counts loop rounds.

layout(constant_id = 0) const uint SUBGROUP_SIZE = 8;

#define BUTTERFLY_STEP(DISTANCE, COMBINE) \
    if (SUBGROUP_SIZE > DISTANCE) { \
        v = COMBINE(v, subgroupShuffleXor(v, DISTANCE)); \
    }
#define BUTTERFLY(T, NAME, COMBINE) \
    T NAME(T v) { \
        BUTTERFLY_STEP(32u, COMBINE) \
        BUTTERFLY_STEP(16u, COMBINE) \
        BUTTERFLY_STEP(8u, COMBINE) \
        BUTTERFLY_STEP(4u, COMBINE) \
        BUTTERFLY_STEP(2u, COMBINE) \
        BUTTERFLY_STEP(1u, COMBINE) \
        return v; \
    }
#define PLUS(a, b) ((a) + (b))

BUTTERFLY(float, subgroup_sum, PLUS)
BUTTERFLY(float, subgroup_max, max)
BUTTERFLY(uint, subgroup_max, max)
BUTTERFLY(uint, subgroup_min, min)
