// Uniforms of a step, written by the host for the step's frame; and the counters that the device reports back.

struct StepUniforms {
    vec3 view_row0;         // rows of the rotation of camera_from_world
    float fx;               // px; a float follows each vec3, which std430 rounds to 16 bytes
    vec3 view_row1;
    float fy;
    vec3 view_row2;
    float cx;
    vec3 camera_centre;     // world
    float cy;
    vec3 background;
    float lambda_dssim;
    vec3 free_centre;       // partner camera: space in front of cameras in between is free (mark_near)
    float free_near;        // near plane of the cameras in between; 0 without a partner
    vec3 grow_axis0;        // Gaussians grow at low <= mean < high along these axes; everywhere if equal
    float clamp_x_min;      // limits of x/z and y/z in the Jacobian
    vec3 grow_axis1;
    float clamp_x_max;
    vec3 grow_axis2;
    float clamp_y_min;
    vec3 grow_low;
    float clamp_y_max;
    vec3 grow_high;
    float near;             // world; a Gaussian counts where z > near
    vec4 rate_means;        // xyz: position rate, w: opacity rate
    uint width, height;     // px
    uint tiles_x, tile_count;
    uint gaussian_count;
    uint trained_count;     // the Gaussians from this row on are frozen: no pass changes them
    uint layer_count;       // sampled objects of this step: layers 1..layer_count
    float loss_scale;       // 1 / (3 valid pixels)
    float label_weight;     // lambda_2
    float label_alpha;      // weight of the alpha term within the label loss
    float depth_weight;     // of a pixel with a known depth
    float label_threshold;  // the lift needs at least this main weight
    uint gpf;               // 1: projection filter on
    uint occluder_words;    // words of occluder bits per layer
    uint stamp;             // differs from step to step; the bits of a normal float
    float adam_correction1, adam_correction2; // 1 / (1 - beta^t)
    float rate_scales, rate_quats, rate_sh0, rate_sh_rest;
    float densify_threshold, densify_scale, prune_scale, prune_opacity; // scales in world units
    uint prune_big;
    uint split_long;        // 1: splits along the longest axis, else at random
    uint sum_absolute;      // 1: the statistic sums absolute gradients over tiles
    uint draws;             // Gaussians to draw for relocation
    float draws_per_weight; // draws over the sum of all weights
    float opacity_weight, scale_weight; // of a Gaussian's opacity and standard deviations in the loss
    float noise;            // factor of random moves, 1 / world unit
    uint seed;
    uint vote_columns;      // labels that a sweep counts at once
    uint instance_capacity; // (splat, tile) pairs,
    uint layer_tile_capacity; // tiles of object layers,
    uint longest_list;      // and splats of a tile that fit
    uint chunk_length;      // splats of a workgroup of the backward blend; 0 for tiles (group_tile.glsl)
    float finest;           // smallest deviation at depth 1 of this view (smooth)
};

struct Counters {
    uint visible_count;     // splats of this view
    uint instance_count;    // (splat, tile) pairs over all layers; the need, even beyond capacity
    uint layer_tile_count;  // tiles of object layers with a splat
    uint longest_list;      // splats in the fullest tile
    uint long_chunk_count;  // chunks of lists that are processed in parts (long_lists.glsl),
    uint first_list_count;  // and lists that follow them, before the others
    uint nonfinite_count, nonfinite_first; // Gaussians with a dropped, nonfinite gradient; lowest index
    uint broken_count, broken_first; // Gaussians with a nonfinite position, opacity or scale (cull); lowest index
    uint unprojected_count, unprojected_first; // Gaussians with a nonfinite splat (project_forward); lowest index
    uint densified_count;   // Gaussians after densification
    uint walked_first, walked_second; // splats walked by tiles in blend_forward, in the first and second half
                            // of its workgroups; times the pixels per tile: pairs
    uint contributing_pairs; // (pixel, splat) pairs with a weight; counted only on request, as are
    uint tested_splats, hit_splats; // splats that subgroups of the forward pass on GPUs tested, and did not skip
    uint ranges_groups, loss_groups; // workgroups of tile_ranges and of loss_tile that are done
    uint undecided_tiles;   // tiles whose label map needs another walk
    uint cloned_count, split_count, pruned_count;
    uint recount_count;     // late partitions that others counted (look_back.glsl); depends on timing
    uint failure;           // sticky bits (below), from step to step until the host clears them
    float loss_l1, loss_ssim, loss_label; // unnormalised sums; label loss minus the loss of empty layers
};

// Bits of counters.failure. While it is not 0, passes do not change the model.
const uint FAILED_INSTANCES = 1u;
const uint FAILED_LAYER_TILES = 2u;
const uint FAILED_SEGMENTS = 4u;
