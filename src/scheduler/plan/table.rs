//! The table of all buffers of the engine: element, length, lifetime and description.

use super::buffers::{Class, TexelFormat};
use super::capacity::Domain;
use crate::shaders::structs::{Counters, StepUniforms};

const VEC4: Option<TexelFormat> = Some(TexelFormat::Rgba32Sfloat);
const WORD: Option<TexelFormat> = Some(TexelFormat::R32Uint);

crate::buffers! {
    STEP "step": size_of::<StepUniforms>() as u32, Domain::One, Class::PerFrame, None, "Uniforms of the step (glsl/include/step.glsl).";
    TARGET "target": 4, Domain::Pixels, Class::PerFrame, WORD, "Photo, `[P]`, RGBA8; pixels with alpha 0 are ignored.";
    VIEW_LABELS "view_labels": 4, Domain::LabelledPixels, Class::PerFrame, WORD, "Visible object of each pixel, `[P]`, with LABEL_BORDER near a contour; in a sweep of votes, the column of each pixel.";
    DEPTHS "depths": 4, Domain::KnownDepths, Class::PerFrame, None, "1 / known depth of each pixel, `[P]`, 1 / world units; 0 where it is not known.";
    LAYER_FROM_LABEL "layer_from_label": 4, Domain::Labels, Class::PerFrame, WORD, "Layer of each label id; 0 if the step does not sample the label.";
    LABEL_FROM_LAYER "label_from_layer": 4, Domain::Layers, Class::PerFrame, WORD, "Label id of each layer; layer 0 is the scene.";
    LAYER_WEIGHTS "layer_weights": 4, Domain::Layers, Class::PerFrame, None, "Weight of each layer's label loss.";
    LAYER_OCCLUDERS "layer_occluders": 4, Domain::OccluderWords, Class::PerFrame, WORD, "A bit per label id for each layer; set if that object hides the layer's object.";
    LABEL_TRUST "label_trust": 4, Domain::Labels, Class::PerFrame, None, "Weight of the disagreement of pixels with each label id in this view.";
    VOTE_WEIGHTS "vote_weights": 4, Domain::VoteColumns, Class::PerFrame, None, "Weight of the votes for each label in this view.";
    STEP_ROWS "step_rows": 4, Domain::SharedRows, Class::PerFrame, WORD, "Shared rows of the step: the scene's, then the photo's, then NO_ROW.";
    STEP_RATES "step_rates": 16, Domain::SharedRows, Class::PerFrame, None, "Learning rates of these rows; rows with rates of 0 stay unchanged.";
    REPORT "report": size_of::<Counters>() as u32, Domain::One, Class::Report, None, "Counters of the step, for the host.";
    REPORT_FAILURE "report_failure": 4, Domain::One, Class::Report, None, "Failure word of the step, for the host.";

    MEANS "means": 16, Domain::Gaussians, Class::Model, VEC4, "Positions, `[N]`: x, y, z (world units), opacity logit.";
    SCALES "scales": 16, Domain::Gaussians, Class::Model, VEC4, "ln of the standard deviations, `[N]`: x, y, z; and the least deviation (smooth), 0 without.";
    QUATS "quats": 16, Domain::Gaussians, Class::Model, VEC4, "Rotations, `[N]`: w, x, y, z.";
    SH0 "sh0": 16, Domain::Gaussians, Class::Model, VEC4, "Colour coefficients of degree 0, `[N]`: r, g, b, 0.";
    SH1 "sh1": 48, Domain::Gaussians, Class::Model, VEC4, "Colour coefficients of degree 1, `[N, 3 vec4]`: 9 floats, coefficient-major rgb, then 3 of padding.";
    SH2 "sh2": 64, Domain::Gaussians, Class::Model, VEC4, "Colour coefficients of degree 2, `[N, 4 vec4]`: 15 floats, then 1 of padding.";
    SH3 "sh3": 96, Domain::Gaussians, Class::Model, VEC4, "Colour coefficients of degree 3, `[N, 6 vec4]`: 21 floats, then 3 of padding.";
    M_MEANS "m_means": 16, Domain::Trained, Class::Model, VEC4, "First moments of means.";
    M_SCALES "m_scales": 16, Domain::Trained, Class::Model, VEC4, "First moments of scales.";
    M_QUATS "m_quats": 16, Domain::Trained, Class::Model, VEC4, "First moments of quats.";
    M_SH0 "m_sh0": 16, Domain::Trained, Class::Model, VEC4, "First moments of sh0.";
    M_SH1 "m_sh1": 48, Domain::Trained, Class::Model, VEC4, "First moments of sh1.";
    M_SH2 "m_sh2": 64, Domain::Trained, Class::Model, VEC4, "First moments of sh2.";
    M_SH3 "m_sh3": 96, Domain::Trained, Class::Model, VEC4, "First moments of sh3.";
    U_MEANS "u_means": 16, Domain::Trained, Class::Model, VEC4, "Second moments of means.";
    U_SCALES "u_scales": 16, Domain::Trained, Class::Model, VEC4, "Second moments of scales.";
    U_QUATS "u_quats": 16, Domain::Trained, Class::Model, VEC4, "Second moments of quats.";
    U_SH0 "u_sh0": 16, Domain::Trained, Class::Model, VEC4, "Second moments of sh0.";
    U_SH1 "u_sh1": 48, Domain::Trained, Class::Model, VEC4, "Second moments of sh1.";
    U_SH2 "u_sh2": 64, Domain::Trained, Class::Model, VEC4, "Second moments of sh2.";
    U_SH3 "u_sh3": 96, Domain::Trained, Class::Model, VEC4, "Second moments of sh3.";
    LABELS "labels": 4, Domain::Labelled, Class::Model, WORD, "Object of each Gaussian, `[N]`; 0 without a label.";
    SHARED "shared_parameters": 16, Domain::SharedRows, Class::Model, VEC4, "Parameters of the scene and of each photo, `[S]`.";
    M_SHARED "m_shared": 16, Domain::SharedRows, Class::Model, VEC4, "First moments of shared_parameters.";
    U_SHARED "u_shared": 16, Domain::SharedRows, Class::Model, VEC4, "Second moments of shared_parameters.";
    W_SHARED "w_shared": 8, Domain::SharedRows, Class::Model, None, "Bias correction of both moments of each row, `[S]`: 1 - beta^t after its t-th update.";
    DENSIFY_STATS "densify_stats": 8, Domain::Trained, Class::Model, None, "Sum of screen gradients and number of views since the last densification, or the weights of a pruning by weight, `[N]`.";
    LABEL_KEYS "label_keys": 4, Domain::Labelled, Class::Persistent, None, "Highest vote of the step, `[N]`: weight in the high half, label in the low half; 0 without votes.";
    LABEL_MAP "label_map": 4, Domain::LabelledPixels, Class::Persistent, None, "Label of each pixel, `[P]`: the one with the largest sum of weights.";
    LABEL_WEIGHTS "label_weights": 4, Domain::LabelledPixels, Class::Step, None, "Sum of the weights of that label, `[P]`.";
    LABEL_TABLES "label_tables": 16, Domain::LabelTables, Class::Step, None, "Labels that each walk of a tile sums, `[T, rounds]`.";
    VOTES_LOW "votes_low": 4, Domain::VoteCells, Class::Model, None, "Votes of a sweep by Gaussian and label, `[N, columns]`: low words.";
    VOTES_HIGH "votes_high": 4, Domain::VoteCells, Class::Model, None, "Votes of a sweep by Gaussian and label, `[N, columns]`: high words.";
    FAILURE "failure": 4, Domain::One, Class::Persistent, None, "Sticky failure bits; while one is set, passes do not change the model.";
    V_INSTANCES_A "v_instances_a": 16, Domain::TrainedInstances, Class::Persistent, VEC4, "Gradient record of each (splat, tile) pair, `[I]`: v_mean2d, v_conic xy.";
    V_INSTANCES_B "v_instances_b": 16, Domain::TrainedInstances, Class::Persistent, VEC4, "Gradient record of each (splat, tile) pair, `[I]`: v_conic z, v_log_opacity, v_colour rg.";
    V_INSTANCES_C "v_instances_c": 16, Domain::TrainedInstances, Class::Persistent, VEC4, "Gradient record of each (splat, tile) pair, `[I]`: v_colour b, stamp; valid if the stamp is the step's.";

    COUNTERS "counters": size_of::<Counters>() as u32, Domain::One, Class::Persistent, None, "Counts of this step (glsl/include/step.glsl).";
    DISPATCH_ARGS "dispatch_args": 4, Domain::Fixed(21), Class::Step, None, "Indirect dispatch arguments (ARGS_ words of constants.glsl).";
    DEPTH_KEYS "depth_keys": 4, Domain::Gaussians, Class::Step, WORD, "Bits of z, or KEY_INVISIBLE, `[N]`.";
    VISIBLE_OFFSETS "visible_offsets": 4, Domain::Gaussians, Class::Step, WORD, "Index among the visible Gaussians, `[N]`.";
    SPLAT_FROM_GAUSSIAN "splat_from_gaussian": 4, Domain::Gaussians, Class::Step, WORD, "Splat of each Gaussian, or NO_SPLAT, `[N]`.";
    DEPTH_KEYS_A "depth_keys_a": 4, Domain::Gaussians, Class::Step, WORD, "Depth keys of the visible Gaussians, before and after each two passes of the sort, `[V]`.";
    DEPTH_KEYS_B "depth_keys_b": 4, Domain::Gaussians, Class::Step, WORD, "Depth keys between two passes of the sort, `[V]`.";
    DEPTH_VALUES_A "gaussian_from_splat": 4, Domain::Gaussians, Class::Step, WORD, "Gaussian of each splat, `[V]`; in depth order after the sort.";
    DEPTH_VALUES_B "depth_values_b": 4, Domain::Gaussians, Class::Step, WORD, "Gaussians between two passes of the sort, `[V]`.";
    SCAN_PARTIALS "scan_partials": 4, Domain::ScanLanes, Class::Step, None, "Sum of each lane's share in a scan.";
    SORT_HISTOGRAM "sort_histogram": 4, Domain::SortCells, Class::Step, WORD, "Digit counts of the sort in the lanes before of a workgroup, by digit and lane.";
    SORT_TOTALS "sort_totals": 4, Domain::SortTotals, Class::Step, WORD, "Digit counts of the sort, by digit and workgroup.";
    SPLATS "splats": 48, Domain::Gaussians, Class::Step, VEC4, "Projected Gaussians in depth order, `[V, 3 vec4]` (glsl/include/record.glsl).";
    TILES_TOUCHED "tiles_touched": 4, Domain::Gaussians, Class::Step, WORD, "Number of tiles of each splat over all layers, `[V]`.";
    INSTANCE_OFFSETS "instance_offsets": 4, Domain::Gaussians, Class::Step, WORD, "First instance of each splat, `[V]`.";
    TILE_KEYS_A "tile_keys_a": 4, Domain::Instances, Class::Step, WORD, "Layer and tile of each pair, `[I]`.";
    TILE_KEYS_B "tile_keys_b": 4, Domain::Instances, Class::Step, WORD, "Layer and tile of each pair between two passes of the sort, `[I]`.";
    TILE_VALUES_A "tile_values_a": 4, Domain::Instances, Class::Step, WORD, "Instance of each pair during the sort, `[I]`.";
    TILE_VALUES_B "tile_values_b": 4, Domain::Instances, Class::Step, WORD, "Instance of each pair during the sort, `[I]`.";
    SPLAT_FROM_INSTANCE "splat_from_instance": 4, Domain::Instances, Class::Step, WORD, "Splat of each pair, `[I]`, in the order before the sort.";
    TILE_STARTS "tile_starts": 4, Domain::VirtualTiles, Class::Step, WORD, "First sorted pair of each tile of each layer.";
    TILE_ENDS "tile_ends": 4, Domain::VirtualTiles, Class::Step, WORD, "One past the last sorted pair of each tile of each layer.";
    LAYER_OCCUPIED "layer_occupied": 4, Domain::VirtualTiles, Class::Step, WORD, "1 for each tile of an object layer with a splat, else 0.";
    LAYER_OFFSETS "layer_offsets": 4, Domain::VirtualTiles, Class::Step, WORD, "Index among the occupied tiles of object layers.";
    LAYER_TILES "layer_tiles": 4, Domain::LayerTiles, Class::Step, WORD, "Occupied tiles of object layers.";
    LAYER_STATE "layer_state": 8, Domain::LayerPixels, Class::Step, None, "Transmittance, last splat and gradient signs of each pixel of an occupied layer tile.";
    LAYER_LOSS "layer_loss": 4, Domain::LayerTiles, Class::Step, None, "Label loss of each occupied layer tile minus the loss of an empty picture, without the layer's weight.";
    DISAGREEMENT "disagreement": 4, Domain::LabelledTiles, Class::Step, None, "Weighted disagreement of the labels in each tile of the scene.";
    IMAGE "image": 16, Domain::Pixels, Class::Step, VEC4, "Picture, `[P]`: r, g, b over the background, final transmittance.";
    LAST "last": 4, Domain::Pixels, Class::Step, WORD, "1 + index in the tile's list of the last splat that contributes, `[P]`.";
    SEGMENT_COLOURS "segment_colours": 16, Domain::SegmentPixels, Class::Step, None, "State of each pixel of each job between two segments of a long list: colour, transmittance.";
    SEGMENT_REST "segment_rest": 16, Domain::SegmentPixels, Class::Step, None, "State of each pixel of each job between two segments: last splat, main splat, its weight, depth.";
    SEGMENT_BACK "segment_back": 8, Domain::SegmentPixels, Class::Step, None, "State between two segments of the backward walk: transmittance, light from behind.";
    MAIN_GAUSSIAN "main_gaussian": 4, Domain::Pixels, Class::Step, None, "Gaussian with the largest weight, or NO_SPLAT, `[P]`.";
    MAIN_WEIGHT_DEPTH "main_weight_depth": 8, Domain::Pixels, Class::Step, None, "Weight of the main Gaussian, and the weighted sum of z over all splats, `[P]`.";
    SSIM_A "ssim_a": 48, Domain::Pixels, Class::Step, VEC4, "Moments, then filtered derivative maps, `[3, P vec4]`.";
    SSIM_B "ssim_b": 48, Domain::Pixels, Class::Step, VEC4, "Derivatives of SSIM with respect to its moments, and its value, `[3, P vec4]`.";
    V_IMAGE "v_image": 16, Domain::Pixels, Class::Step, VEC4, "Gradient of the photo loss with respect to the picture, `[P]`.";
    LOSS_PARTIALS "loss_partials": 8, Domain::LossPartials, Class::Step, None, "Sums of |x - y| and of SSIM over strips.";
    V_SPLATS "v_splats": 48, Domain::Gaussians, Class::Step, VEC4, "Gradients of the splats, `[V, 3 vec4]`.";
    V_MEANS "v_means": 16, Domain::Gaussians, Class::Step, VEC4, "Gradients of means, `[V]`.";
    V_SCALES "v_scales": 16, Domain::Gaussians, Class::Step, VEC4, "Gradients of scales, `[V]`.";
    V_QUATS "v_quats": 16, Domain::Gaussians, Class::Step, VEC4, "Gradients of quats, `[V]`.";
    V_SH0 "v_sh0": 16, Domain::Gaussians, Class::Step, VEC4, "Gradients of sh0, `[V]`.";
    V_SH1 "v_sh1": 48, Domain::Gaussians, Class::Step, VEC4, "Gradients of sh1, `[V]`.";
    V_SH2 "v_sh2": 64, Domain::Gaussians, Class::Step, VEC4, "Gradients of sh2, `[V]`.";
    V_SH3 "v_sh3": 96, Domain::Gaussians, Class::Step, VEC4, "Gradients of sh3, `[V]`.";
    V_SHARED "v_shared": 16, Domain::SharedRows, Class::Step, VEC4, "Gradients of shared_parameters, `[S]`.";
    CHILDREN_COUNTS "children_counts": 4, Domain::Gaussians, Class::Step, WORD, "Number of Gaussians that each one becomes, `[N]`: 0, 1 or 2.";
    CHILD_OFFSETS "child_offsets": 4, Domain::Gaussians, Class::Step, WORD, "Index of the first child, `[N]`.";
    DENSIFY_ACTIONS "densify_actions": 4, Domain::Gaussians, Class::Step, WORD, "Decision for each Gaussian, `[N]`.";
    OLD_MEANS "old_means": 16, Domain::Gaussians, Class::Step, VEC4, "Means before densification.";
    OLD_SCALES "old_scales": 16, Domain::Gaussians, Class::Step, VEC4, "Scales before densification.";
    OLD_QUATS "old_quats": 16, Domain::Gaussians, Class::Step, VEC4, "Quats before densification.";
    OLD_VALUES "old_values": 96, Domain::Gaussians, Class::Step, VEC4, "One attribute before densification.";
    OLD_LABELS "old_labels": 4, Domain::Labelled, Class::Step, WORD, "Labels before densification.";
    #[cfg(feature = "lab")]
    OBJECT "object": 4, Domain::One, Class::Step, None, "Layer of the object whose passes run, in a step with separate passes for each object.";
    #[cfg(feature = "lab")]
    OBJECT_COUNTERS "object_counters": size_of::<Counters>() as u32, Domain::One, Class::Step, None, "Counters of the passes before those of that object.";
    #[cfg(feature = "lab")]
    OBJECT_STEP "object_step": size_of::<StepUniforms>() as u32, Domain::One, Class::Step, None, "Uniforms of the step with that object as the only layer.";
    #[cfg(feature = "lab")]
    OBJECT_LABEL "object_label": 4, Domain::Fixed(2), Class::Step, None, "label_from_layer of that object's layer.";
    #[cfg(feature = "lab")]
    OBJECT_WEIGHT "object_weight": 4, Domain::Fixed(2), Class::Step, None, "layer_weights of that object's layer.";
    #[cfg(feature = "lab")]
    OBJECT_OCCLUDERS "object_occluders": 4, Domain::OccluderWords, Class::Step, None, "layer_occluders of that object's layer.";
    #[cfg(feature = "lab")]
    OBJECT_SPLATS "object_splats": 4, Domain::Gaussians, Class::Step, None, "splat_from_gaussian among that object's splats, `[N]`.";
}
