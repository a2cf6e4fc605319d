// Sums over the partitions before this one, for single-dispatch passes with one word per partition. As in sweep.glsl,
// but all invocations of a workgroup look back at once, each at a different partition. The includer declares the buffer
// look_back, which is 0 before the step, and LOOK_LANES, its invocations.
//
// The buffer: a ticket for each of the two passes; the words of project_visible; those of emit_ordered.

#include "partition_words.glsl"
const uint LOOK_SPINS = 16u;        // looks at a word that is not there yet

// Gaussians per invocation of project_visible, of `n` in all: few if there would not be enough workgroups.
uint visible_items(uint n) {
    return clamp(n >> 17u, VISIBLE_ITEMS_MIN, VISIBLE_ITEMS_MOST);
}

uint visible_partitions(uint n) {
    uint own = VISIBLE_LANES * visible_items(n);
    return (n + own - 1u) / own;
}

const uint LOOK_VISIBLE = 2u; // first word of project_visible

uint look_ordered(uint n) { // first word of emit_ordered
    return LOOK_VISIBLE + visible_partitions(n);
}

// Words in use in a step over `n` Gaussians.
uint look_words(uint n) {
    return look_ordered(n) + (n + ORDERED_LANES - 1u) / ORDERED_LANES;
}

#ifdef LOOK_LANES
shared uint look_ticket, look_failed;
shared uint look_nearest, look_missing, look_low, look_high;

// Counts a partition, by all its invocations; each pass defines its own.
uint look_recount(uint part);

// The partition of this workgroup, taken from a ticket, and the failure word, equal for all of them.
uint look_partition(uint ticket, uint failed, out bool has_failed) {
    if (gl_LocalInvocationIndex == 0u) {
        look_ticket = atomicAdd(look_back[ticket], 1u);
        look_failed = failed;
    }
    barrier();
    has_failed = look_failed != 0u;
    return look_ticket;
}

// Publishes the partition's count, and returns the sum over earlier partitions. Called by all invocations of the
// workgroup with equal arguments.
uint look_before(uint words, uint part, uint own) {
    uint lane = gl_LocalInvocationIndex;
    bool tells = lane == 0u && part + 1u != SWEEP_HELD;
    if (tells) {
        atomicExchange(look_back[words + part], (part == 0u ? SWEEP_PREFIX : SWEEP_OWN) | own);
    }
    uint sum = 0u, left = part, spins = 0u; // left: partitions that are not in the sum
    while (left > 0u) {
        if (lane == 0u) {
            look_nearest = LOOK_LANES;
            look_missing = LOOK_LANES;
            look_low = 0u;
            look_high = 0u;
        }
        barrier();
        uint found = lane < left ? atomicOr(look_back[words + left - 1u - lane], 0u) : SWEEP_OWN;
        if (found <= SWEEP_SUM) {
            atomicMin(look_missing, lane);
        } else if ((found & SWEEP_PREFIX) != 0u) {
            atomicMin(look_nearest, lane);
        }
        barrier();
        uint nearest = look_nearest, missing = look_missing;
        bool ends = nearest < missing;
        uint taken = min(ends ? nearest + 1u : missing, left);
        if (lane < taken) {
            // By halves: neither sum overflows.
            atomicAdd(look_low, found & 0xffffu);
            atomicAdd(look_high, (found & SWEEP_SUM) >> 16u);
        }
        barrier();
        sum = sweep_add(sum, joined(look_low, look_high));
        left = ends ? 0u : left - taken;
        spins = taken > 0u ? 0u : spins + 1u;
        barrier();
        if (spins > LOOK_SPINS) {
            sum = sweep_add(sum, look_recount(left - 1u));
            left--;
            spins = 0u;
        }
    }
    if (tells && part > 0u) {
        atomicExchange(look_back[words + part], SWEEP_PREFIX | sweep_add(sum, own));
    }
    return sum;
}
#endif
