// Operations over the lanes of one subgroup; kernels use no others. A sum or maximum is a butterfly of shuffles, the
// one subgroup operation that is fast on all devices. It is unrolled by hand, because some drivers do not unroll a loop
// over the distances, and lavapipe counts loop rounds.
//
// EMULATED: SUBGROUP_SIZE neighbouring invocations of a workgroup form a subgroup, and shuffles go through shared
// memory. All invocations of the workgroup must call an operation together.

layout(constant_id = 0) const uint SUBGROUP_SIZE = 8;

#ifndef EXCHANGE_LANES
#define EXCHANGE_LANES 64u // the largest workgroup with subgroup operations
#endif
#ifdef EMULATED
// Exchanges use the two halves in turn. One barrier each is then enough: no invocation writes to a half again before
// all have read it, because the exchange in between also has a barrier.
shared uvec3 exchange[2u * EXCHANGE_LANES];
uint exchange_half = 0u;

uint subgroup_lane() {
    return gl_LocalInvocationIndex % SUBGROUP_SIZE;
}

uint subgroup_id() {
    return gl_LocalInvocationIndex / SUBGROUP_SIZE;
}

// Makes the lanes' writes to shared memory visible to their subgroup.
#define subgroup_fence() barrier()

uvec3 subgroup_shuffle(uvec3 v, uint lane) {
    exchange_half = EXCHANGE_LANES - exchange_half;
    exchange[exchange_half + gl_LocalInvocationIndex] = v;
    barrier();
    return exchange[exchange_half + gl_LocalInvocationIndex - subgroup_lane() + lane];
}

uint subgroup_shuffle(uint v, uint lane) {
    return subgroup_shuffle(uvec3(v, 0u, 0u), lane).x;
}

float subgroup_shuffle(float v, uint lane) {
    return uintBitsToFloat(subgroup_shuffle(floatBitsToUint(v), lane));
}

vec2 subgroup_shuffle(vec2 v, uint lane) {
    return uintBitsToFloat(subgroup_shuffle(uvec3(floatBitsToUint(v), 0u), lane)).xy;
}

vec3 subgroup_shuffle(vec3 v, uint lane) {
    return uintBitsToFloat(subgroup_shuffle(floatBitsToUint(v), lane));
}

#define subgroup_shuffle_xor(v, distance) subgroup_shuffle(v, subgroup_lane() ^ (distance))

uint subgroup_exclusive_add(uint v) {
    uint sum = v;
    [[unroll]] for (uint distance = 1u; distance < 64u; distance *= 2u) {
        if (distance < SUBGROUP_SIZE) {
            uint before = subgroup_shuffle(sum, subgroup_lane() - min(distance, subgroup_lane()));
            sum += subgroup_lane() >= distance ? before : 0u;
        }
    }
    return sum - v;
}

// A bit for each lane.
uvec2 subgroup_ballot(bool v) {
    uint lane = subgroup_lane();
    uvec3 bits = uvec3(v && lane < 32u ? 1u << lane : 0u, v && lane >= 32u ? 1u << (lane - 32u) : 0u, 0u);
    [[unroll]] for (uint distance = 1u; distance < 64u; distance *= 2u) {
        if (distance < SUBGROUP_SIZE) {
            bits |= subgroup_shuffle(bits, lane ^ distance);
        }
    }
    return bits.xy;
}

bool subgroup_elect() {
    return subgroup_lane() == 0u;
}
#else
#define subgroup_lane() gl_SubgroupInvocationID
#define subgroup_id() gl_SubgroupID
#define subgroup_ballot(v) subgroupBallot(v).xy
#define subgroup_fence() subgroupMemoryBarrierShared(); subgroupBarrier()
#define subgroup_shuffle(v, lane) subgroupShuffle(v, lane)
#define subgroup_shuffle_xor(v, distance) subgroupShuffleXor(v, distance)
#define subgroup_exclusive_add(v) subgroupExclusiveAdd(v)
#define subgroup_elect() subgroupElect()
#endif

#define BUTTERFLY_STEP(DISTANCE, COMBINE) \
    if (SUBGROUP_SIZE > DISTANCE) { \
        v = COMBINE(v, subgroup_shuffle_xor(v, DISTANCE)); \
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

// Three sums at once: the same additions, but a third of the exchanges where they are emulated.
#ifdef EMULATED
BUTTERFLY(vec3, subgroup_sum, PLUS)
#else
vec3 subgroup_sum(vec3 v) {
    return vec3(subgroup_sum(v.x), subgroup_sum(v.y), subgroup_sum(v.z));
}
#endif

// The sum in the device's native order.
float subgroup_add(float v) {
#ifdef EMULATED
    return subgroup_sum(v);
#else
    return subgroupAdd(v);
#endif
}
