#version 460
#include "layout.glsl"
#include "constants.glsl"
#include "step.glsl"
#include "dispatch.glsl"
#include "gaussian.glsl"
#include "projection.glsl"
#include "sh.glsl"
#include "record.glsl"
#include "ellipse.glsl"
// project_forward — project and colour the visible Gaussians, and count the tiles of each.
// Work:    64 splats per workgroup, splats in depth order.
// Reads:   step, counters; gaussian_from_splat [V]; means, scales, quats, sh0 [N]; sh1 [N,2], sh2 [N,4], sh3 [N,5];
//          variant labels: labels [N], layer_from_label
// Writes:  splats [V,3] (record.glsl); tiles_touched [V] over all layers; splat_from_gaussian [N];
//          counters.unprojected_* (integer atomics): nonfinite splats, which touch no tile
// Math:    EWA splatting with Cauchy-Binet determinant; SH colour, clamped at 0; ellipse.glsl for the tiles;
//          variant antialiased: opacity times the root of the coverage (Mip-Splatting).
// Mirror:  src/reference/project.rs::project_forward, tile.rs::row_interval

layout(constant_id = 11) const uint SH_DEGREE = 3;
layout(local_size_x = 64) in;
READ1(0, StepUniforms, step);
INOUT1(1, Counters, counters);
FETCHU(2, gaussian_from_splat);
FETCH4(3, means);
FETCH4(4, scales);
FETCH4(5, quats);
FETCH4(6, sh0);
FETCH4(7, sh1);
FETCH4(8, sh2);
FETCH4(9, sh3);
WRITE(10, vec4, splats);
WRITE(11, uint, tiles_touched);
WRITE(12, uint, splat_from_gaussian);
#ifdef LABELS
FETCHU(13, labels);
FETCHU(14, layer_from_label);
#endif
#define plane4(name, e) fetch4(name, e)
#include "caught_up.glsl"
#include "splat.glsl"

void main() {
    StepUniforms u = step;
    uint s = linear_group_id() * 64u + gl_LocalInvocationID.x;
    if (s >= counters.visible_count) {
        return;
    }
    uint i = fetchu(gaussian_from_splat, s), touched = 0u;
    float z;
    Ellipse e = project_splat(u, s, i, z);
    for (uint row = 0u; row < e.rows; row++) {
        touched += tiles_of_row(u, e, row).y;
    }
#ifdef LABELS
    touched *= fetchu(layer_from_label, fetchu(labels, i)) != 0u ? 2u : 1u;
#endif
    tiles_touched[s] = touched;
}
