// Ten sums over the lanes of a subgroup for each splat of a batch, by a butterfly in which a lane gives half of its
// values away at each distance: 12 exchanges at 32 lanes and 10 at 8. The additions, and thus the bits, are the same as
// in subgroup_sum.
//
// A lane ends with sums of other values than its neighbours. Which ones depends on the splat's lane j: value v of splat
// j lies in lane j ^ lane_of_sum(v) until the batch ends, and one exchange for each value then brings it to lane j.

const uint SUMS = 10u;

// Bit k of v is separated at the k-th distance. Values 8 and 9 are alone at the second and third.
uint lane_of_sum(uint v) {
    return (v & 1u) * (SUBGROUP_SIZE >> 1u) + (v >> 1u & 1u) * (SUBGROUP_SIZE >> 2u) + (v >> 2u & 1u) * (SUBGROUP_SIZE >> 3u)
        + (v >> 3u) * (SUBGROUP_SIZE >> 4u);
}

// A lane keeps its part of `a`, or of `b` where its lane has the bit of this distance.
#define HALVING(T) \
    T halved(T a, T b, uint place, uint apart) { \
        bool high = (place & apart) != 0u; \
        return (high ? b : a) + subgroup_shuffle_xor(high ? a : b, apart); \
    }
HALVING(float)
HALVING(vec2)
HALVING(vec3)

// Sums that end in the lane of this index. To omit the last value, pass the previous one twice.
vec3 transposed(vec3 even, vec3 odd, vec2 last_even, vec2 last_odd, uint place) {
    vec3 a = halved(even, odd, place, SUBGROUP_SIZE >> 1u);
    vec2 b = halved(last_even, last_odd, place, SUBGROUP_SIZE >> 1u);
    vec3 c = halved(vec3(a.x, a.z, b.y), vec3(a.y, b.x, b.y), place, SUBGROUP_SIZE >> 2u);
    if (SUBGROUP_SIZE >= 8u) {
        vec2 d = halved(vec2(c.x, c.z), vec2(c.y, c.z), place, SUBGROUP_SIZE >> 3u);
        c = d.xxy;
    }
    if (SUBGROUP_SIZE >= 16u) {
        c = vec3(halved(c.x, c.z, place, SUBGROUP_SIZE >> 4u));
    }
    if (SUBGROUP_SIZE >= 32u) {
        c = vec3(c.x + subgroup_shuffle_xor(c.x, SUBGROUP_SIZE >> 5u));
    }
    if (SUBGROUP_SIZE >= 64u) {
        c = vec3(c.x + subgroup_shuffle_xor(c.x, SUBGROUP_SIZE >> 6u));
    }
    return c;
}

// Adds the lanes' values of splat j to `sums` of the lane where each one ends.
void add_transposed(vec3 even, vec3 odd, vec2 last_even, vec2 last_odd, uint j, inout float sums[SUMS]) {
    uint place = gl_LocalInvocationID.x ^ j;
    vec3 c = transposed(even, odd, last_even, last_odd, place);
    [[unroll]] for (uint v = 0u; v < SUMS; v++) {
        sums[v] = place == lane_of_sum(v) ? c[v / 4u] : sums[v];
    }
}

// Brings the sums of each splat of the batch to its lane.
void return_sums(inout float sums[SUMS]) {
    [[unroll]] for (uint v = 1u; v < SUMS; v++) {
        sums[v] = subgroup_shuffle_xor(sums[v], lane_of_sum(v));
    }
}
