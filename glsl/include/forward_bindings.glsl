// Interface of the forward blend on GPUs, by variant.

READ1(0, StepUniforms, step);
INOUT1(1, Counters, counters);
FETCHU(2, tile_starts);
FETCHU(3, tile_ends);
FETCHU(4, instance_from_sorted);
FETCH4(5, splats);
FETCHU(19, splat_from_instance);
layout(constant_id = 15) const uint GROUP_LANES = 128;
#ifdef PRODUCTS
const uint COUNTS = 0;
#else
layout(constant_id = 17) const uint COUNTS = 0; // 1: count contributing pairs, and tests and hits of subgroups
#endif
#ifdef MAIN
WRITE(6, vec4, image);
WRITE(7, uint, last);
WRITE(8, uint, main_gaussian);
WRITE(9, vec2, main_weight_depth);
FETCHU(10, gaussian_from_splat);
const bool REMEMBERS_MAIN = true;
#else
INOUT_SHARED(6, vec4, image);
INOUT_SHARED(7, uint, last);
INOUT(20, uint, chunk_jobs);
INOUT_SHARED(21, vec4, chunk_states);
READ(23, uvec2, long_chunks);
#ifndef PRODUCTS
READ(24, uint, first_lists);
#endif
#endif
#ifdef LABELS
FETCHU(8, layer_tiles);
FETCHC(9, target);
FETCHU(10, view_labels);
READ(11, uint, layer_occluders);
READ(12, uint, label_from_layer);
FETCHU(13, gaussian_from_splat);
WRITE(14, uvec2, layer_state);
WRITE(15, float, layer_loss);
INOUT(16, uint, label_keys);
FETCHU(17, layer_from_label);
READ(18, float, layer_weights);
#endif
#ifdef DISAGREEMENT
FETCHC(8, target);
FETCHU(9, view_labels);
FETCHU(10, labels);
FETCHU(11, gaussian_from_splat);
WRITE(12, float, disagreement);
#endif
#ifdef DEPTH
READ(8, float, depths);
#endif
#if defined(DISAGREEMENT) || defined(DEPTH)
#define CHANNEL
INOUT_SHARED(22, float, chunk_channel);
#endif
#if defined(MAIN) || defined(LABELS)
#define ONE_IS_MAIN
#endif
