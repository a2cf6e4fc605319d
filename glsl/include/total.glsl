// Writes the total of a scan to its counter.
void put_total(uint total) {
    if (TOTAL == 0u) {
        counters.visible_count = total;
    } else if (TOTAL == 1u) {
        counters.instance_count = total;
    } else if (TOTAL == 2u) {
        counters.layer_tile_count = total;
    } else {
        counters.densified_count = total;
    }
}
