// All constants of the algorithm. The build exports them to Rust. The f64 reference has its own copy, so that a slip
// here shows; a test compares the two (tests/verify/constants.rs).
// Only the kernel benchmark (tools/bench/kernels/modes.rs) replaces a constant by a macro.

#ifndef ALPHA_MIN
const float ALPHA_MIN = 1.0 / 255.0;         // pairs with less opacity at a pixel are skipped (3DGS)
#endif
const float LOG2_ALPHA_MIN = log2(ALPHA_MIN);
const float ALPHA_MAX = 0.99;                // upper limit of a pair's opacity (3DGS)
#ifndef TRANSMITTANCE_MIN
const float TRANSMITTANCE_MIN = 1e-4;        // a pixel stops before a splat that would go below this (3DGS)
#endif
const float COV2D_BLUR = 0.3;                // px^2 on the diagonal of the projected covariance (3DGS)
const float COVERAGE_MIN = 1e-6;             // smallest determinant ratio before and after blur
const float FINEST = 0.44721359549995794;    // smallest deviation, pixels of the nearest view (Mip-Splatting)
const float SMOOTH_MARGIN = 0.15;            // margin around views, as a share of their size (Mip-Splatting)
const float SSIM_C1 = 0.01 * 0.01;
const float SSIM_C2 = 0.03 * 0.03;
const float ADAM_BETA1 = 0.9;
const float ADAM_BETA2 = 0.999;
const float ADAM_EPSILON = 1e-15;
const uint MISSED_MOST = 255u;               // updates that a Gaussian may miss before all catch up (caught_up.glsl),
const uint MISSED_ROWS = MISSED_MOST + 2u;   // rows of the table of what they missed,
const uint MISSED_VECTORS = 3u;              // and the vec4 of a row
const float MOMENT_RATIO = 4096.0;           // steps of packed moments (moments_store.glsl): of m / sqrt(v),
const uint MOMENT_LOG = 1024u;               // of an octave of sqrt(v),
const uint MOMENT_FLOOR = 50u;               // octaves of it below 1,
const uint MOMENT_PLANES = 7u;               // planes of attributes,
const uint MOMENT_DRAWS = 64u;               // and the first draw index of an element
const float OPACITY_RESET_LOGIT = -4.5951198501345898; // logit(0.01)
const float SPLIT_SHRINK = 0.47000362924573558;        // ln 1.6
const float SPLIT_OFFSET = 0.5;              // split along the longest axis: children at this many deviations,
const float SPLIT_LONG = 0.69314718055994531;   // ln 2: that axis is halved,
const float SPLIT_OTHERS = 0.16251892949777494; // -ln 0.85: the others shrink less,
const float SPLIT_OPACITY = 0.6;             // and so does the opacity (Improved-GS, LichtFeld Studio)
const float FREE_SIZE = 0.5;                 // largest deviation, in distances from a camera
const float STAT_NEAR = 1e9;                 // number of views that marks a Gaussian in the free space of a camera
const float RELOCATE_ONE = 255.0;            // weight of an opaque Gaussian in a draw
const uint RELOCATE_MOST = 51u;              // most copies of a Gaussian (3DGS-MCMC)
const float NOISE_STEEP = 100.0;             // Gaussians move at random below
const float NOISE_OPACITY = 0.005;           // this opacity, and hardly above (3DGS-MCMC)
const uint FOLD = 32768u;                    // groups of one axis, over which one-dimensional work folds
const uint FINITE_GROUPS = 256u;            // workgroups of find_nonfinite
const uint EXPOSED = 512u;                   // pixels of a workgroup of expose_backward
const uint EXPOSURE_ROWS = 3u;               // rows of a photo (exposure.glsl)
const float EXPOSURE_SHARE = 0.24;           // largest share that a channel takes from another one
const float EXPOSURE_PRIOR = 1e-3;           // pull of the mean of each number over all photos to 0
const float POSE_PRIOR = 20.0;               // pull of a pose's correction to 0; a pixel's error pulls 100 times more
const float LN2 = 0.69314718055994531;
const float GRADIENT_MAX = 1e18;            // larger gradients are dropped: their square overflows in Adam
const float COLOUR_BIAS = 0.5;               // offset of the colour from spherical harmonics (3DGS)
const float NEAR = 0.2;                      // near plane, world units, smaller in small scenes (3DGS); host only
const float JACOBIAN_MARGIN = 0.3;           // limit of slopes beyond the image, in half images (3DGS); host only
const uint NO_SPLAT = 0xffffffffu;
const uint SPLAT_BITS = 29u;                 // of splat_from_gaussian; then a bit for each channel that is not clamped
const uint SPLAT_MASK = 0x1fffffffu;         // the splat of splat_from_gaussian
const uint UPDATE_REGULARISES = 2u;          // what a strategy adds to an update (strategy_moves.glsl): loss terms,
const uint UPDATE_EXPLORES = 4u;             // random moves,
const uint UPDATE_SMOOTHS = 8u;              // and a smallest size
const uint NO_ROW = 0xffffffffu;
const uint LABEL_MASK = 0xffffu;             // object id in a pixel of view_labels; the next bit is a flag:
const uint LABEL_BORDER = 0x10000u;          // pixel near a contour of the mask; ignored
const float ALPHA_SLACK = 0.5;               // opacity error of an object alone that causes no loss
const uint LABEL_OPEN = 0x10000u;            // pixel of label_map in which a label without a sum may win
const uint LABEL_ROUNDS = 8u;                // most walks of a tile for its label map: 32 labels
const uint VOTE_NONE = 0xffffffffu;         // column of a pixel without votes
const float VOTE_ONE = 65536.0;              // scale of the fixed-point votes for labels
const uint KEY_INVISIBLE = 0xffffffffu;

// The buffer `look_back`: tickets of the sorts, then their histograms, then the words of each partition (sweep.glsl);
// then a ticket, and a word a partition, of each other pass (look_back.glsl).
const uint SWEEP_LANES = 256u;               // invocations of a workgroup
const uint SWEEP_DIGITS = 256u;              // most values of a digit
const uint SWEEP_SORTS = 16u;                // most sort passes of a step
const uint SWEEP_HISTOGRAMS = SWEEP_SORTS;   // first word of the histograms, and of the partitions:
const uint SWEEP_WORDS = SWEEP_HISTOGRAMS + SWEEP_SORTS * SWEEP_DIGITS;
const uint SWEEP_STRIDE = 2u * SWEEP_DIGITS; // words per partition: of two sort passes
const uint VISIBLE_LANES = 128u;             // invocations of a workgroup of project_visible,
const uint VISIBLE_ITEMS_MIN = 2u;           // and the Gaussians of one
const uint VISIBLE_ITEMS_MOST = 8u;
const uint DEPTH_BITS = 28u;                 // of its depth keys, above the near plane: 32 octaves
const uint ORDERED_LANES = 64u;              // splats of a workgroup of emit_ordered

// Factors of the real spherical harmonics (sh.glsl).
const float SH_C0 = 0.28209479177387814;
const float SH_C1 = 0.48860251190291992;
const float SH_C2_0 = 1.0925484305920792;
const float SH_C2_2 = 0.31539156525252005;
const float SH_C2_4 = 0.54627421529603959;
const float SH_C3_0 = 0.59004358992664352;
const float SH_C3_1 = 2.8906114426405538;
const float SH_C3_2 = 0.45704579946446577;
const float SH_C3_3 = 0.37317633259011546;
const float SH_C3_5 = 1.4453057213202769;

// Entries of dispatch_args, 3 words each (VkDispatchIndirectCommand).
const uint ARGS_GAUSSIANS = 0u;
const uint ARGS_SPLATS = 3u;
const uint ARGS_BLEND = 6u;
const uint ARGS_SH1 = 9u;
const uint ARGS_SH2 = 12u;
const uint ARGS_SH3 = 15u;
const uint ARGS_TILES = 18u;
const uint ARGS_SWEEP_SPLATS = 21u;          // partitions of a sort
const uint ARGS_SWEEP_INSTANCES = 24u;
const uint ARGS_CHUNKS = 27u;                // chunks of the backward blend (group_tile.glsl)
const uint ARGS_VISIBLE = 30u;               // partitions of project_visible
const uint ARGS_WALK = 33u;                  // lists, and chunks of long ones, of the forward blend
const uint ARGS_PRODUCTS = 36u;              // these chunks alone
const uint ARGS_WORDS = 39u;                 // of all entries
