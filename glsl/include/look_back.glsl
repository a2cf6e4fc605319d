// Sums over the partitions before this one, for single-dispatch passes with one word per partition. As in sweep.glsl,
// but all invocations of a workgroup look back at once, each at a different partition. The includer declares counters,
// the buffer look_back, which is 0 before the step, and WALKERS, its invocations.

#include "partition_words.glsl"

shared uint look_ticket, look_failed;
shared uint look_nearest, look_missing, look_low, look_high;

// Counts a partition, by all its invocations; each pass defines its own.
uint look_recount(uint part);

// The partition of this workgroup, taken from a ticket, and the failure word, equal for all of them.
uint look_partition(out bool has_failed) {
    if (gl_LocalInvocationIndex == 0u) {
        look_ticket = atomicAdd(look_back[LOOK_FIRST], 1u);
        look_failed = atomicOr(counters.failure, 0u); // the last partition may set it
    }
    barrier();
    has_failed = look_failed != 0u;
    return look_ticket;
}

// Publishes the partition's count, and returns the sum over earlier partitions. Called by all invocations of the
// workgroup with equal arguments.
uint look_before(uint part, uint own) {
    uint lane = gl_LocalInvocationIndex, words = LOOK_FIRST + 1u;
    bool tells = lane == 0u && part + 1u != LOOK_HELD;
    if (tells) {
        atomicExchange(look_back[words + part], (part == 0u ? SWEEP_PREFIX : SWEEP_OWN) | own);
    }
    uint sum = 0u, left = part, looks = 0u; // left: partitions that are not in the sum
    while (left > 0u) {
        if (lane == 0u) {
            look_nearest = WALKERS;
            look_missing = WALKERS;
            look_low = 0u;
            look_high = 0u;
        }
        barrier();
        uint found = lane < left ? look_at(words + left - 1u - lane) : SWEEP_OWN;
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
        looks += taken > 0u ? 0u : 1u;
        barrier();
        if (taken == 0u && looks > LOOKS) {
            if (lane == 0u) {
                atomicAdd(counters.recount_count, 1u);
            }
            sum = sweep_add(sum, look_recount(left - 1u));
            left--;
        }
    }
    if (tells && part > 0u) {
        atomicExchange(look_back[words + part], SWEEP_PREFIX | sweep_add(sum, own));
    }
    return sum;
}
