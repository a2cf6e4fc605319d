#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "count.glsl"
#include "sort_key.glsl"
// radix_sweep — move keys and values to their sorted positions for one digit, in one dispatch; stable.
// Work:    one partition of SWEEP_LANES x SWEEP_ITEMS pairs per workgroup. Subgroups rank their keys by ballots; the
//          pairs of each digit are written together, through shared memory. Variant narrow: 16-bit keys.
// Reads:   step, counters; keys_in [n], values_in [n] (IDENTITY: the value is the index); look_back
//          (histogram of the digit)
// Writes:  keys_out [n], values_out [n]; look_back (words of this pass; zeros in the words of the next pass)
// Order:   exact integers, equal in every run: the order of the radix_scatter passes.
// Mirror:  src/reference/sort.rs::radix_sort

#define EXCHANGE_LANES SWEEP_LANES
#include "subgroup.glsl"
layout(constant_id = 9) const uint DIGIT_BITS = 8;
layout(constant_id = 10) const uint IDENTITY = 0;
layout(local_size_x = SWEEP_LANES) in;
READ1(0, StepUniforms, step);
INOUT1(1, Counters, counters);
READ(3, KEY, keys_in);
READ(4, uint, values_in);
INOUT(5, uint, look_back);
WRITE(6, KEY, keys_out);
WRITE(7, uint, values_out);
#include "sweep.glsl"

const uint DIGITS = 1u << DIGIT_BITS;
shared uint ranks[SWEEP_SUBGROUPS * DIGITS]; // keys of each digit, by subgroup; then those of the subgroups before
shared uint starts[DIGITS];                  // first of each digit among the partition's pairs
shared uint moves[DIGITS];                   // from a place in the partition to one in the output, by digit
shared uint words[SWEEP_PARTITION];          // the partition's keys, then its values, by digit
shared uvec2 sums[SWEEP_SUBGROUPS];

uint digit_of(uint key) {
    return bitfieldExtract(key, int(SHIFT), int(DIGIT_BITS));
}

uint counted_items() {
    return item_count(step, counters, counters.failure);
}

void sweep_recount(uint part) {
    uint n = counted_items();
    sweep_found[sweep_lane()] = 0u;
    barrier();
    for (uint k = 0u; k < SWEEP_ITEMS; k++) {
        uint i = sweep_item(part, k);
        if (i < n) {
            atomicAdd(sweep_found[digit_of(uint(keys_in[i]))], 1u);
        }
    }
    barrier();
}

// The rank of each lane's key among the subgroup's keys of the same digit.
uint rank(uint digit, bool is_item, uint table) {
    uvec2 peers = subgroup_ballot(is_item);
    [[unroll]] for (uint bit = 0u; bit < DIGIT_BITS; bit++) {
        bool is_set = (digit >> bit & 1u) != 0u;
        uvec2 set = subgroup_ballot(is_set);
        peers &= is_set ? set : ~set;
    }
    uint lane = subgroup_lane();
    uvec2 below = uvec2((1u << min(lane, 31u)) - 1u, lane > 32u ? (1u << (lane - 32u)) - 1u : 0u);
    below.x = lane >= 32u ? 0xffffffffu : below.x;
    ivec2 before = bitCount(peers & below), all = bitCount(peers);
    uint earlier = ranks[table + digit];
    subgroup_fence();
    if (is_item && before.x + before.y == 0) {
        ranks[table + digit] = earlier + uint(all.x + all.y);
    }
    subgroup_fence();
    return earlier + uint(before.x + before.y);
}

// Exclusive sums over the workgroup.
uvec2 sums_before(uvec2 v) {
    uvec2 before = uvec2(subgroup_exclusive_add(v.x), subgroup_exclusive_add(v.y));
    if (subgroup_lane() == SUBGROUP_SIZE - 1u) {
        sums[subgroup_id()] = before + v;
    }
    barrier();
    for (uint s = 0u; s < SWEEP_SUBGROUPS; s++) {
        before += s < subgroup_id() ? sums[s] : uvec2(0u);
    }
    return before;
}

void main() {
    uint n = counted_items(), part = sweep_partition(), lane = sweep_lane();
    if (part * SWEEP_PARTITION >= n) {
        return;
    }
    for (uint i = lane; i < SWEEP_SUBGROUPS * DIGITS; i += SWEEP_LANES) {
        ranks[i] = 0u;
    }
    barrier();
    uint table = subgroup_id() * DIGITS;
    uint keys[SWEEP_ITEMS], place[SWEEP_ITEMS];
    [[unroll]] for (uint k = 0u; k < SWEEP_ITEMS; k++) {
        uint i = sweep_item(part, k);
        keys[k] = uint(keys_in[min(i, n - 1u)]);
        place[k] = rank(digit_of(keys[k]), i < n, table);
    }
    barrier();
    bool has_digit = lane < DIGITS;
    uint own = 0u;
    if (has_digit) {
        for (uint at = lane; at < SWEEP_SUBGROUPS * DIGITS; at += DIGITS) {
            uint count = ranks[at];
            ranks[at] = own;
            own += count;
        }
    }
    uint all = has_digit ? look_back[SWEEP_HISTOGRAMS + SORT_PASS * SWEEP_DIGITS + lane] : 0u;
    uvec2 before = sums_before(uvec2(own, all));
    uint earlier = sweep_look_back(part, has_digit, own);
    if (has_digit) {
        starts[lane] = before.x;
        moves[lane] = before.y + earlier - before.x;
        uint other = SORT_PASS % 2u != 0u ? 0u - SWEEP_DIGITS : SWEEP_DIGITS;
        look_back[sweep_words(part) + other + lane] = 0u;
    }
    barrier();
    [[unroll]] for (uint k = 0u; k < SWEEP_ITEMS; k++) {
        uint digit = digit_of(keys[k]);
        place[k] += starts[digit] + ranks[table + digit];
        if (sweep_item(part, k) < n) {
            words[place[k]] = keys[k];
        }
    }
    barrier();
    uint count = min(n - part * SWEEP_PARTITION, SWEEP_PARTITION);
    uint to[SWEEP_ITEMS];
    [[unroll]] for (uint k = 0u; k < SWEEP_ITEMS; k++) {
        uint i = k * SWEEP_LANES + lane;
        if (i < count) {
            uint key = words[i];
            to[k] = moves[digit_of(key)] + i;
            keys_out[to[k]] = KEY(key);
        }
    }
    barrier();
    [[unroll]] for (uint k = 0u; k < SWEEP_ITEMS; k++) {
        uint i = sweep_item(part, k);
        if (i < n) {
            words[place[k]] = IDENTITY != 0u ? i : values_in[i];
        }
    }
    barrier();
    [[unroll]] for (uint k = 0u; k < SWEEP_ITEMS; k++) {
        uint i = k * SWEEP_LANES + lane;
        if (i < count) {
            values_out[to[k]] = words[i];
        }
    }
}
