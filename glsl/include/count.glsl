// Number of items of a kernel; its source is fixed per recording.

const uint COUNT_GAUSSIANS = 0u;
const uint COUNT_SPLATS = 1u;
const uint COUNT_INSTANCES = 2u;
const uint COUNT_VIRTUAL_TILES = 3u;

uint item_count(StepUniforms step, Counters counters, uint failed) {
    uint n = COUNT_SOURCE == COUNT_GAUSSIANS ? step.gaussian_count
        : COUNT_SOURCE == COUNT_SPLATS ? counters.visible_count
        : COUNT_SOURCE == COUNT_INSTANCES ? counters.instance_count
        : step.tile_count * (step.layer_count + 1u);
    return failed != 0u ? 0u : n;
}
