//! The table of all buffers of the engine: element, length, lifetime and description.

use super::domains::cures;
use crate::scheduler::plan::{Buf, BufferDecl, Class, Domain, Table, TexelFormat};
use crate::shaders::constants::ARGS_WORDS;
use crate::shaders::structs::{Counters, StepUniforms};

const VEC4_TEXEL: Option<TexelFormat> = Some(TexelFormat::Rgba32Sfloat);
const VEC2_TEXEL: Option<TexelFormat> = Some(TexelFormat::Rg32Sfloat);
const WORD_TEXEL: Option<TexelFormat> = Some(TexelFormat::R32Uint);

crate::buffers! { cures::whole;
    STEP "step": size_of::<StepUniforms>() as u32, Domain::ONE, Class::PerFrame, None,
        "Uniforms of the step (glsl/include/step.glsl).";
    TARGET "target": 4, Domain::PIXELS, Class::PerFrame, WORD_TEXEL,
        "Photo, `[P]`, RGBA8; pixels with alpha 0 are ignored.";
    VIEW_LABELS "view_labels": 4, Domain::LABELLED_PIXELS, Class::PerFrame, WORD_TEXEL,
        "Visible object of each pixel, `[P]`, with LABEL_BORDER near a contour; in a vote sweep, the column of \
         each pixel.";
    DEPTHS "depths": 4, Domain::KNOWN_DEPTHS, Class::PerFrame, None,
        "1 / known depth of each pixel, `[P]`, 1 / world units; 0 if unknown.";
    LAYER_FROM_LABEL "layer_from_label": 4, Domain::LABELS, Class::PerFrame, WORD_TEXEL,
        "Layer of each label id; 0 if the step does not sample the label.";
    LABEL_FROM_LAYER "label_from_layer": 4, Domain::LAYERS, Class::PerFrame, WORD_TEXEL,
        "Label id of each layer; layer 0 is the scene.";
    LAYER_WEIGHTS "layer_weights": 4, Domain::LAYERS, Class::PerFrame, None, "Weight of each layer's label loss.";
    LAYER_OCCLUDERS "layer_occluders": 4, Domain::OCCLUDER_WORDS, Class::PerFrame, WORD_TEXEL,
        "For each layer, one bit per label id; set if that object hides the layer's object.";
    VOTE_WEIGHTS "vote_weights": 4, Domain::VOTE_COLUMNS, Class::PerFrame, None,
        "Weight of the votes for each label in this view.";
    STEP_ROWS "step_rows": 4, Domain::SHARED_ROWS, Class::PerFrame, WORD_TEXEL,
        "Shared rows of the step: the scene's, then the photo's, then NO_ROW.";
    STEP_RATES "step_rates": 16, Domain::SHARED_ROWS, Class::PerFrame, None,
        "Learning rates of these rows; rows with zero rates stay unchanged.";
    MISSED "missed": 48, Domain::MISSED_ROWS, Class::PerFrame, None,
        "Missed movement of Gaussians, by number of missed updates (glsl/include/caught_up.glsl).";
    REPORT "report": size_of::<Counters>() as u32, Domain::ONE, Class::Report, None,
        "Counters of the step, for the host.";

    MEANS "means": 16, Domain::GAUSSIANS, Class::Model, VEC4_TEXEL,
        "Positions, `[N]`: x, y, z (world units), opacity logit.";
    SCALES "scales": 16, Domain::GAUSSIANS, Class::Model, VEC4_TEXEL,
        "ln of the standard deviations, `[N]`: x, y, z; and the smallest deviation (smooth), 0 if unlimited.";
    QUATS "quats": 16, Domain::GAUSSIANS, Class::Model, VEC4_TEXEL, "Rotations, `[N]`: w, x, y, z.";
    SH0 "sh0": 16, Domain::GAUSSIANS, Class::Model, VEC4_TEXEL,
        "Colour coefficients as consecutive rgb triples over all four planes: degree 0, `[N]`, and the first \
         float of degree 1 (glsl/include/sh_colour.glsl).";
    SH1 "sh1": 32, Domain::GAUSSIANS, Class::Model, VEC4_TEXEL, "The other 8 floats of degree 1, `[N, 2 vec4]`.";
    SH2 "sh2": 64, Domain::GAUSSIANS, Class::Model, VEC4_TEXEL,
        "15 floats of degree 2, and the first float of degree 3, `[N, 4 vec4]`.";
    SH3 "sh3": 80, Domain::GAUSSIANS, Class::Model, VEC4_TEXEL, "The other 20 floats of degree 3, `[N, 5 vec4]`.";
    M_MEANS "m_means": 16, Domain::TRAINED, Class::Model, VEC4_TEXEL,
        "First moments of means; packed, both moments of each parameter (glsl/include/moments_store.glsl); \
         the same below.";
    M_SCALES "m_scales": 16, Domain::TRAINED, Class::Model, VEC4_TEXEL, "First moments of scales.";
    M_QUATS "m_quats": 16, Domain::TRAINED, Class::Model, VEC4_TEXEL, "First moments of quats.";
    M_SH0 "m_sh0": 16, Domain::TRAINED, Class::Model, VEC4_TEXEL, "First moments of sh0.";
    M_SH1 "m_sh1": 32, Domain::TRAINED, Class::Model, VEC4_TEXEL, "First moments of sh1.";
    M_SH2 "m_sh2": 64, Domain::TRAINED, Class::Model, VEC4_TEXEL, "First moments of sh2.";
    M_SH3 "m_sh3": 80, Domain::TRAINED, Class::Model, VEC4_TEXEL, "First moments of sh3.";
    U_MEANS "u_means": 16, Domain::SECOND_MOMENTS, Class::Model, VEC4_TEXEL, "Second moments of means.";
    U_SCALES "u_scales": 16, Domain::SECOND_MOMENTS, Class::Model, VEC4_TEXEL, "Second moments of scales.";
    U_QUATS "u_quats": 16, Domain::SECOND_MOMENTS, Class::Model, VEC4_TEXEL, "Second moments of quats.";
    U_SH0 "u_sh0": 16, Domain::SECOND_MOMENTS, Class::Model, VEC4_TEXEL, "Second moments of sh0.";
    U_SH1 "u_sh1": 32, Domain::SECOND_MOMENTS, Class::Model, VEC4_TEXEL, "Second moments of sh1.";
    U_SH2 "u_sh2": 64, Domain::SECOND_MOMENTS, Class::Model, VEC4_TEXEL, "Second moments of sh2.";
    U_SH3 "u_sh3": 80, Domain::SECOND_MOMENTS, Class::Model, VEC4_TEXEL, "Second moments of sh3.";
    LABELS "labels": 4, Domain::LABELLED, Class::Model, WORD_TEXEL,
        "Object of each Gaussian, `[N]`; 0 without a label.";
    SHARED "shared_parameters": 16, Domain::SHARED_ROWS, Class::Model, VEC4_TEXEL,
        "Parameters of the scene and of each photo, `[S]`.";
    M_SHARED "m_shared": 16, Domain::SHARED_ROWS, Class::Model, VEC4_TEXEL, "First moments of shared_parameters.";
    U_SHARED "u_shared": 16, Domain::SHARED_ROWS, Class::Model, VEC4_TEXEL, "Second moments of shared_parameters.";
    W_SHARED "w_shared": 8, Domain::SHARED_ROWS, Class::Model, None,
        "Bias correction of both moments of each row, `[S]`: 1 - beta^t after its t-th update.";
    DENSIFY_STATS "densify_stats": 8, Domain::TRAINED, Class::Model, None,
        "Sum of screen gradients and number of views since the last densification, or the blending weights before \
         pruning by weight, `[N]`.";
    TOUCHED_AT "touched_at": 4, Domain::LATE_GAUSSIANS, Class::Model, WORD_TEXEL,
        "Number of the last update of each Gaussian, `[N]`.";
    LABEL_KEYS "label_keys": 4, Domain::LABELLED, Class::Persistent, None,
        "Highest vote of the step, `[N]`: weight in the high half, label in the low half; 0 without votes.";
    LABEL_MAP "label_map": 4, Domain::LABELLED_PIXELS, Class::Persistent, None,
        "Label of each pixel, `[P]`: the one with the largest sum of weights.";
    LABEL_WEIGHTS "label_weights": 4, Domain::LABELLED_PIXELS, Class::Step, None,
        "Sum of the weights of that label, `[P]`.";
    LABEL_TABLES "label_tables": 16, Domain::LABEL_TABLES, Class::Step, None,
        "Labels that each walk over a tile sums, `[T, rounds]`.";
    VOTES_LOW "votes_low": 4, Domain::VOTE_CELLS, Class::Model, None,
        "Votes of a sweep by Gaussian and label, `[N, columns]`: low words; in training, only during the sweep.";
    VOTES_HIGH "votes_high": 4, Domain::VOTE_CELLS, Class::Model, None,
        "Votes of a sweep by Gaussian and label, `[N, columns]`: high words.";
    NONFINITE_ROWS "nonfinite_rows": 4, Domain::fixed(64), Class::Persistent, None,
        "First row of each plane of the state with a NaN or infinity.";
    V_INSTANCES_A "v_instances_a": 16, Domain::TRAINED_INSTANCES, Class::Persistent, VEC4_TEXEL,
        "Gradient record of each (splat, tile) pair, `[I]`: v_mean2d, v_conic xy.";
    V_INSTANCES_B "v_instances_b": 16, Domain::TRAINED_INSTANCES, Class::Persistent, VEC4_TEXEL,
        "Gradient record of each (splat, tile) pair, `[I]`: v_conic z, v_log_opacity, v_colour rg.";
    V_INSTANCES_C "v_instances_c": 8, Domain::TRAINED_INSTANCES, Class::Persistent, VEC2_TEXEL,
        "Gradient record of each (splat, tile) pair, `[I]`: v_colour b, stamp; valid if the stamp is the step's.";

    COUNTERS "counters": size_of::<Counters>() as u32, Domain::ONE, Class::Persistent, None,
        "Counts of this step (glsl/include/step.glsl).";
    DISPATCH_ARGS "dispatch_args": 4, Domain::fixed(ARGS_WORDS), Class::Step, None,
        "Indirect dispatch arguments (ARGS_ words of constants.glsl).";
    DEPTH_KEYS "depth_keys": 4, Domain::GAUSSIANS, Class::Step, WORD_TEXEL, "Bits of z, or KEY_INVISIBLE, `[N]`.";
    VISIBLE_OFFSETS "visible_offsets": 4, Domain::GAUSSIANS, Class::Step, WORD_TEXEL,
        "Index among the visible Gaussians, `[N]`.";
    SPLAT_FROM_GAUSSIAN "splat_from_gaussian": 4, Domain::GAUSSIANS, Class::Step, WORD_TEXEL,
        "Splat of each Gaussian, or NO_SPLAT, `[N]`.";
    DEPTH_KEYS_A "depth_keys_a": 4, Domain::GAUSSIANS, Class::Step, WORD_TEXEL,
        "Depth keys of the visible Gaussians, before and after every second sort pass, `[V]`.";
    DEPTH_KEYS_B "depth_keys_b": 4, Domain::GAUSSIANS, Class::Step, WORD_TEXEL,
        "Depth keys between two sort passes, `[V]`.";
    DEPTH_VALUES_A "gaussian_from_splat": 4, Domain::GAUSSIANS, Class::Step, WORD_TEXEL,
        "Gaussian of each splat, `[V]`; in depth order, or in model order (DEPTH_ORDER).";
    DEPTH_VALUES_B "depth_values_b": 4, Domain::GAUSSIANS, Class::Step, WORD_TEXEL,
        "Gaussians between two sort passes, `[V]`.";
    SCAN_PARTIALS "scan_partials": 4, Domain::SCAN_LANES, Class::Step, None, "Sum of each lane's share in a scan.";
    SORT_HISTOGRAM "sort_histogram": 4, Domain::SORT_CELLS, Class::Step, WORD_TEXEL,
        "Digit counts of the sort in earlier lanes of a workgroup, by digit and lane.";
    SORT_TOTALS "sort_totals": 4, Domain::SORT_TOTALS, Class::Step, WORD_TEXEL,
        "Digit counts of the sort, by digit and workgroup.";
    LOOK_BACK "look_back": 4, Domain::LOOK_CELLS, Class::Step, None,
        "Tickets and counts of passes that look back (glsl/include/sweep.glsl, look_back.glsl).";
    DEPTH_ORDER "depth_order": 4, Domain::GAUSSIANS, Class::Step, WORD_TEXEL,
        "Splats in depth order, `[V]`, if they are numbered in model order.";
    SPLATS "splats": 48, Domain::GAUSSIANS, Class::Step, VEC4_TEXEL,
        "Projected Gaussians, `[V, 3 vec4]` (glsl/include/record.glsl).";
    TILES_TOUCHED "tiles_touched": 4, Domain::GAUSSIANS, Class::Step, WORD_TEXEL,
        "Number of tiles of each splat over all layers, `[V]`.";
    INSTANCE_OFFSETS "instance_offsets": 4, Domain::GAUSSIANS, Class::Step, WORD_TEXEL,
        "First instance of each splat, `[V]`.";
    TILE_KEYS_A "tile_keys_a": 4, Domain::KEY_WORDS, Class::Step, WORD_TEXEL,
        "Layer and tile of each pair, `[I]`; 16-bit if that suffices (glsl/include/sort_key.glsl).";
    TILE_KEYS_B "tile_keys_b": 4, Domain::KEY_WORDS, Class::Step, WORD_TEXEL,
        "Layer and tile of each pair between two sort passes, `[I]`; also 16-bit if that suffices.";
    TILE_VALUES_A "tile_values_a": 4, Domain::INSTANCES, Class::Step, WORD_TEXEL,
        "Instance of each pair during the sort, `[I]`.";
    TILE_VALUES_B "tile_values_b": 4, Domain::INSTANCES, Class::Step, WORD_TEXEL,
        "Instance of each pair during the sort, `[I]`.";
    SPLAT_FROM_INSTANCE "splat_from_instance": 4, Domain::INSTANCES, Class::Step, WORD_TEXEL,
        "Splat of each pair, `[I]`, in order before the sort.";
    TILE_STARTS "tile_starts": 4, Domain::VIRTUAL_TILES, Class::Step, WORD_TEXEL,
        "First sorted pair of each tile of each layer.";
    TILE_ENDS "tile_ends": 4, Domain::VIRTUAL_TILES, Class::Step, WORD_TEXEL,
        "One past the last sorted pair of each tile of each layer.";
    LAYER_OCCUPIED "layer_occupied": 4, Domain::VIRTUAL_TILES, Class::Step, WORD_TEXEL,
        "1 for each tile of an object layer with splats, else 0.";
    LAYER_OFFSETS "layer_offsets": 4, Domain::VIRTUAL_TILES, Class::Step, WORD_TEXEL,
        "Index among the occupied tiles of object layers.";
    LAYER_TILES "layer_tiles": 4, Domain::LAYER_TILES, Class::Step, WORD_TEXEL, "Occupied tiles of object layers.";
    LAYER_STATE "layer_state": 8, Domain::LAYER_PIXELS, Class::Step, None,
        "Transmittance, last splat and gradient signs of each pixel of an occupied layer tile.";
    LAYER_LOSS "layer_loss": 4, Domain::LAYER_TILES, Class::Step, None,
        "Label loss of each occupied layer tile minus the loss of an empty picture, without the layer's weight.";
    DISAGREEMENT "disagreement": 4, Domain::LABELLED_TILES, Class::Step, None,
        "Weighted disagreement of the labels in each tile of the scene.";
    IMAGE "image": 16, Domain::PIXELS, Class::Step, VEC4_TEXEL,
        "Picture, `[P]`: r, g, b over the background, final transmittance.";
    LAST "last": 4, Domain::PIXELS, Class::Step, WORD_TEXEL,
        "1 + index in the tile's list of the last splat that contributes, `[P]`.";
    SEGMENT_COLOURS "segment_colours": 16, Domain::SEGMENT_PIXELS, Class::Step, None,
        "State of each pixel of each job between two segments of a long list: colour, transmittance.";
    SEGMENT_REST "segment_rest": 16, Domain::SEGMENT_PIXELS, Class::Step, None,
        "State of each pixel of each job between two segments: last splat, main splat, its weight, depth.";
    SEGMENT_BACK "segment_back": 8, Domain::SEGMENT_PIXELS, Class::Step, None,
        "State between two segments of the backward pass: transmittance, light from behind.";
    CHUNK_JOBS "chunk_jobs": 4, Domain::CHUNKS, Class::Step, None,
        "Tile of each chunk with work for the backward pass, or NO_CHUNK (glsl/include/group_tile.glsl).";
    LONG_CHUNKS "long_chunks": 8, Domain::CHUNKS, Class::Step, None,
        "Tile and chunk index of each chunk of the lists that are processed forward in parts.";
    FIRST_LISTS "first_lists": 4, Domain::CHUNKS, Class::Step, None,
        "Tiles whose lists are processed forward first.";
    CHUNK_STATES "chunk_states": 16, Domain::CHUNK_PIXELS, Class::Step, None,
        "State of each pixel of a tile at the end of a chunk of its list: light from behind, transmittance.";
    CHUNK_CHANNEL "chunk_channel": 4, Domain::CHUNK_CHANNELS, Class::Step, None,
        "Disagreement or depth error from behind, at the end of a chunk.";
    MAIN_GAUSSIAN "main_gaussian": 4, Domain::PIXELS, Class::Step, None,
        "Gaussian with the largest weight, or NO_SPLAT, `[P]`.";
    MAIN_WEIGHT_DEPTH "main_weight_depth": 8, Domain::PIXELS, Class::Step, None,
        "Weight of the main Gaussian, and the weighted sum of z over all splats, `[P]`.";
    SSIM_A "ssim_a": 48, Domain::PIXELS, Class::Step, VEC4_TEXEL,
        "Moments, then filtered derivative maps, `[3, P vec4]`.";
    SSIM_B "ssim_b": 48, Domain::PIXELS, Class::Step, VEC4_TEXEL,
        "Derivatives of SSIM with respect to its moments, and its value, `[3, P vec4]`.";
    V_IMAGE "v_image": 16, Domain::PIXELS, Class::Step, VEC4_TEXEL,
        "Gradient of the photo loss with respect to the picture, `[P]`.";
    LOSS_PARTIALS "loss_partials": 8, Domain::LOSS_PARTIALS, Class::Step, None,
        "Sums of |x - y| and of SSIM over strips or tiles.";
    EXPOSURE_PARTIALS "exposure_partials": 48, Domain::LOSS_PARTIALS, Class::Step, None,
        "Sums of the gradient of the exposure over pixels, `[3 vec4]` each.";
    V_SPLATS "v_splats": 48, Domain::GAUSSIANS, Class::Step, VEC4_TEXEL, "Gradients of the splats, `[V, 3 vec4]`.";
    V_MEANS "v_means": 16, Domain::GAUSSIANS, Class::Step, VEC4_TEXEL, "Gradients of means, `[V]`.";
    V_SCALES "v_scales": 16, Domain::GAUSSIANS, Class::Step, VEC4_TEXEL, "Gradients of scales, `[V]`.";
    V_QUATS "v_quats": 16, Domain::GAUSSIANS, Class::Step, VEC4_TEXEL, "Gradients of quats, `[V]`.";
    V_SH0 "v_sh0": 16, Domain::GAUSSIANS, Class::Step, VEC4_TEXEL, "Gradients of sh0, `[V]`.";
    V_SH1 "v_sh1": 32, Domain::GAUSSIANS, Class::Step, VEC4_TEXEL, "Gradients of sh1, `[V]`.";
    V_SH2 "v_sh2": 64, Domain::GAUSSIANS, Class::Step, VEC4_TEXEL, "Gradients of sh2, `[V]`.";
    V_SH3 "v_sh3": 80, Domain::GAUSSIANS, Class::Step, VEC4_TEXEL, "Gradients of sh3, `[V]`.";
    V_SHARED "v_shared": 16, Domain::SHARED_ROWS, Class::Step, VEC4_TEXEL, "Gradients of shared_parameters, `[S]`.";
    CHILDREN_COUNTS "children_counts": 4, Domain::GAUSSIANS, Class::Step, WORD_TEXEL,
        "Number of Gaussians that each one becomes, `[N]`: 0, 1 or 2.";
    CHILD_OFFSETS "child_offsets": 4, Domain::GAUSSIANS, Class::Step, WORD_TEXEL, "Index of the first child, `[N]`.";
    DENSIFY_ACTIONS "densify_actions": 4, Domain::GAUSSIANS, Class::Step, WORD_TEXEL,
        "Decision for each Gaussian, `[N]`.";
    OLD_MEANS "old_means": 16, Domain::GAUSSIANS, Class::Step, VEC4_TEXEL, "Means before densification.";
    OLD_SCALES "old_scales": 16, Domain::GAUSSIANS, Class::Step, VEC4_TEXEL, "Scales before densification.";
    OLD_QUATS "old_quats": 16, Domain::GAUSSIANS, Class::Step, VEC4_TEXEL, "Quats before densification.";
    OLD_VALUES "old_values": 96, Domain::GAUSSIANS, Class::Step, VEC4_TEXEL, "One attribute before densification.";
    OLD_LABELS "old_labels": 4, Domain::LABELLED, Class::Step, WORD_TEXEL, "Labels before densification.";
}
