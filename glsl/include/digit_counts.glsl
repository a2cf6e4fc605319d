// Histograms of the digits of the keys that a workgroup writes, for a look-back sort (sweep.glsl).
// All invocations clear the bins, then count their keys, then add to the buffer `look_back`, with a barrier between.

layout(constant_id = 9) const uint DIGIT_BITS = 8;
layout(constant_id = 22) const uint KEY_BITS = 32;
const uint BINS = (KEY_BITS + DIGIT_BITS - 1u) / DIGIT_BITS << DIGIT_BITS; // numbered digit by digit
shared uint bins[BINS];

void clear_bins(uint lane, uint lanes) {
    for (uint b = lane; b < BINS; b += lanes) {
        bins[b] = 0u;
    }
}

void count_digits(uint key) {
    for (uint shift = 0u; shift < KEY_BITS; shift += DIGIT_BITS) {
        atomicAdd(bins[(shift / DIGIT_BITS << DIGIT_BITS) + bitfieldExtract(key, int(shift), int(DIGIT_BITS))], 1u);
    }
}

void add_bins(uint lane, uint lanes) {
    for (uint b = lane; b < BINS; b += lanes) {
        if (bins[b] > 0u) {
            uint digit = b & ((1u << DIGIT_BITS) - 1u);
            atomicAdd(look_back[SWEEP_HISTOGRAMS + (SORT_PASS + (b >> DIGIT_BITS)) * SWEEP_DIGITS + digit], bins[b]);
        }
    }
}
