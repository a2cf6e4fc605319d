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
#include "moments_store.glsl"
// project_forward — project and colour the visible Gaussians, and count the tiles of each.
// Work:    64 splats per workgroup, splats in depth order; variant group: the rows of their tiles are shared out.
// Reads:   step, counters; gaussian_from_splat [V]; means, scales, quats, sh0 [N]; sh1 [N,3], sh2 [N,4], sh3 [N,6];
//          variant labels: labels [N], layer_from_label; variant lazy: moments [N], touched_at [N], missed
// Writes:  splats [V,3] (record.glsl); tiles_touched [V] over all layers; splat_from_gaussian [N]; counters.unprojected_*
//          (integer atomics): nonfinite splats, which touch no tile
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

#ifdef LAZY
READ_MOMENTS(15, 22, means);
READ_MOMENTS(16, 23, scales);
READ_MOMENTS(17, 24, quats);
READ_MOMENTS(18, 25, sh0);
READ_MOMENTS(19, 26, sh1);
READ_MOMENTS(20, 27, sh2);
READ_MOMENTS(21, 28, sh3);
FETCHU(29, touched_at);
READ(30, uvec4, missed);
#endif
#define plane4(name, e) fetch4(name, e)
#include "caught_up.glsl"
#ifdef LAZY
EACH_PLANE(CAUGHT_UP)
#endif
#include "sh_fetch.glsl"
#include "sh_colour.glsl"
#ifdef GROUP
#include "rows.glsl"
shared uint tiles[WALKERS];
#endif

// Writes the record of a splat. Returns where its tiles are.
Ellipse project(StepUniforms u, uint s, uint i) {
#ifdef LAZY
    look_up(i < u.trained_count ? missed_updates(i) : 0u);
#endif
    vec4 mean = value4(means, i);
    Projection p = project_gaussian(u, mean.xyz, value4(scales, i).xyz, value4(quats, i));
    vec3 q = exponent_from_conic(p.conic);
    float log2_o = log2_opacity(mean.w);
#ifdef ANTIALIASED
    log2_o += 0.5 * log2(p.coverage);
#endif
    vec2 centre = vec2(u.fx, u.fy) * p.slope_raw + vec2(u.cx, u.cy);
    float reach = 2.0 * LN2 * (log2_o - LOG2_ALPHA_MIN);
    vec2 extent = box_of(sqrt(p.cov.xz * max(reach, 0.0)));
    vec3 direction = normalize(mean.xyz - u.camera_centre);
    float basis[15];
    sh_basis(direction, SH_DEGREE, basis);
    vec3 raw = sh_colour(i, basis), colour = max(raw, 0.0); // in drivers, max(NaN, 0) is 0

    bool sane = finite(centre.x + centre.y + q.x + q.y + q.z + log2_o + raw.x + raw.y + raw.z);
    if (!sane) {
        atomicAdd(counters.unprojected_count, 1u);
        atomicMin(counters.unprojected_first, i);
    }
    splats[3u * s] = vec4(centre, q.x, q.y);
    splats[3u * s + 1u] = vec4(q.z, log2_o, colour.x, colour.y);
    splats[3u * s + 2u] = vec4(colour.z, p.view.z, extent);
    splat_from_gaussian[i] = s;
    Ellipse e = ellipse(u, centre, extent, q, log2_o);
    e.rows = sane ? e.rows : 0u;
    return e;
}

// Counts the tiles of the splat of this invocation, which may have no rows.
uint count_tiles(StepUniforms u, Ellipse e) {
#ifdef GROUP
    uint lane = gl_LocalInvocationID.x, unused;
    tiles[lane] = 0u;
    uint rows = share_rows(e, 0u, unused);
    for (uint row = lane; row < rows; row += WALKERS) {
        uint splat = entry_at(0u, row);
        atomicAdd(tiles[splat], tiles_of_row(u, ellipse_of(splat), row - starts[splat]).y);
    }
    barrier();
    return tiles[lane];
#else
    uint count = 0u;
    for (uint row = 0u; row < e.rows; row++) {
        count += tiles_of_row(u, e, row).y;
    }
    return count;
#endif
}

void main() {
    StepUniforms u = step;
    uint s = linear_group_id() * 64u + gl_LocalInvocationID.x, i = 0u;
    bool is_splat = s < counters.visible_count;
    Ellipse e;
    e.rows = 0u;
    if (is_splat) {
        i = fetchu(gaussian_from_splat, s);
        e = project(u, s, i);
    }
    uint touched = count_tiles(u, e);
    if (is_splat) {
#ifdef LABELS
        touched *= fetchu(layer_from_label, fetchu(labels, i)) != 0u ? 2u : 1u;
#endif
        tiles_touched[s] = touched;
    }
}
