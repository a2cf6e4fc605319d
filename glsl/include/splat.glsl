// Projects and colours a Gaussian that counts. The includer declares the planes, splats, splat_from_gaussian, counters
// and SH_DEGREE, and includes gaussian.glsl, projection.glsl, sh.glsl, record.glsl, ellipse.glsl and caught_up.glsl.
// Variant antialiased: opacity times the root of the coverage (Mip-Splatting).

#include "sh_colour.glsl"

// Writes the record of a splat. Returns its tile ellipse, and its depth.
Ellipse project_splat(StepUniforms u, uint s, uint i, out float z) {
    look_up_trained(u, i);
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
    splat_from_gaussian[i] = s | uint(dot(vec3(greaterThan(raw, vec3(0.0))), vec3(1.0, 2.0, 4.0))) << SPLAT_BITS;
    z = p.view.z;
    Ellipse e = ellipse(u, centre, extent, q, log2_o);
    e.rows = sane ? e.rows : 0u;
    return e;
}
