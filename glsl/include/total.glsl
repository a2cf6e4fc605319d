// Takes the total of a scan.

#include "count_args.glsl"

void put_total(uint total) {
    if (TOTAL == 0u) {
        put_visible(total);
    } else if (TOTAL == 1u) {
        put_instances(total);
    } else if (TOTAL == 2u) {
        counters.layer_tile_count = total;
        put_blend(total, counters.longest_list);
    } else {
        counters.densified_count = total;
    }
}
