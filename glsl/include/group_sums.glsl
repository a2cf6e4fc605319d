// Ten sums over the lanes of each subgroup of a workgroup, for each of the splats that they process at once, in shared
// memory.

#include "transposed_sums.glsl"

const uint SUM_PITCH = SUMS + 1u; // odd: neighbouring lanes meet no bank together
shared float sums_of[GROUP_LANES * SUM_PITCH]; // by subgroup and splat

// Writes the subgroup's sums of a splat, each from the lane where it ended.
void put_sums(uint row, vec3 sums) {
    uint lane = subgroup_lane(), at = row * SUM_PITCH;
    uint v = ((lane & SUBGROUP_SIZE >> 1u) != 0u ? 1u : 0u) + ((lane & SUBGROUP_SIZE >> 2u) != 0u ? 2u : 0u)
        + ((lane & SUBGROUP_SIZE >> 3u) != 0u ? 4u : 0u) + ((lane & SUBGROUP_SIZE >> 4u) != 0u ? 8u : 0u);
    bool is_first = SUBGROUP_SIZE < 32u || (lane & (SUBGROUP_SIZE / 16u - 1u)) == 0u; // of those that have the same sum
    if (is_first && v < SUMS) {
        sums_of[at + v] = sums.x;
    }
    if (SUBGROUP_SIZE < 8u) {
        sums_of[at + 4u + v] = sums.y;
    }
    if (SUBGROUP_SIZE < 16u && v < 2u) {
        sums_of[at + 8u + v] = sums.z;
    }
}
