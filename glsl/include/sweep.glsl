// Single-dispatch passes of a sort over partitions of keys: a workgroup takes the next one by a ticket, counts it, and
// looks back at the counts of the partitions before it (Merrill and Garland, "Single-pass parallel prefix scan with
// decoupled look-back", 2016). No workgroup depends on the progress of another one: if a count is late, it counts that
// partition itself. Counts are exact integers, so results do not depend on timing.
//
// The buffer `look_back` is 0 before the step. Per partition, it has the words of two sort passes, one per digit, which
// alternate and clear each other's words.

#include "partitions.glsl"
const uint SWEEP_SUBGROUPS = SWEEP_LANES / SUBGROUP_SIZE;

#include "partition_words.glsl"

shared uint sweep_ticket;
shared uint sweep_late;
shared uint sweep_found[SWEEP_LANES];

// Counts a partition into sweep_found, by all invocations; each pass has its own.
void sweep_recount(uint part);

// Index of this invocation by subgroup and lane.
uint sweep_lane() {
    return subgroup_id() * SUBGROUP_SIZE + subgroup_lane();
}

// The partition of this workgroup.
uint sweep_partition() {
    if (sweep_lane() == 0u) {
        sweep_ticket = atomicAdd(look_back[SORT_PASS], 1u);
    }
    barrier();
    return sweep_ticket;
}

// The lane's k-th item: neighbouring lanes have neighbouring items, and those of a subgroup are contiguous.
uint sweep_item(uint part, uint k) {
    return part * SWEEP_PARTITION + (subgroup_id() * SWEEP_ITEMS + k) * SUBGROUP_SIZE + subgroup_lane();
}

// First word of a partition for this pass.
uint sweep_words(uint part) {
    return SWEEP_WORDS + part * SWEEP_STRIDE + SORT_PASS % 2u * SWEEP_DIGITS;
}

// Publishes the partition's count of this invocation's word, if it has one, and returns the sum over earlier
// partitions. Called by all invocations of the workgroup.
uint sweep_look_back(uint part, bool has_word, uint own) {
    uint lane = sweep_lane(), word = sweep_words(part) + lane;
    bool tells = has_word && part + 1u != LOOK_HELD;
    if (tells) {
        atomicExchange(look_back[word], (part == 0u ? SWEEP_PREFIX : SWEEP_OWN) | own);
    }
    uint left = has_word ? part : 0u; // partitions that are not in the sum
    uint sum = 0u, looks = 0u;
    while (true) {
        for (bool is_there = true; left > 0u && (is_there || looks <= LOOKS);) {
            uint found = look_at(sweep_words(left - 1u) + lane);
            is_there = found > SWEEP_SUM;
            sum = is_there ? sweep_add(sum, found & SWEEP_SUM) : sum;
            left = (found & SWEEP_PREFIX) != 0u ? 0u : is_there ? left - 1u : left;
            looks += is_there ? 0u : 1u;
        }
        if (lane == 0u) {
            sweep_late = 0u;
        }
        barrier();
        if (left > 0u) {
            atomicMax(sweep_late, left);
        }
        barrier();
        uint late = sweep_late;
        if (late == 0u) {
            break;
        }
        if (lane == 0u) {
            atomicAdd(counters.recount_count, 1u);
        }
        sweep_recount(late - 1u);
        if (left == late) {
            sum = sweep_add(sum, sweep_found[lane]);
            left = late - 1u;
        }
        barrier();
    }
    if (tells && part > 0u) {
        atomicExchange(look_back[word], SWEEP_PREFIX | sweep_add(sum, own));
    }
    return sum;
}
