// Distributes the tile rows of a workgroup's splats among its invocations, so that none waits for the one with a large
// splat. All invocations of the workgroup call share_rows and sums_before.

#include "sums_before.glsl"

shared uvec4 ellipses[2u * WALKERS]; // of each splat, packed: tiles of an axis fit in 16 bits
shared uint starts[2u * WALKERS]; // of a table's entries, ascending: first row of each splat; for the caller's use

// The last entry of a table that starts at `at` or before.
uint entry_at(uint table, uint at) {
    uint entry = 0u;
    [[unroll]] for (uint jump = WALKERS / 2u; jump > 0u; jump /= 2u) {
        entry += starts[table * WALKERS + entry + jump] <= at ? jump : 0u;
    }
    return entry;
}

// Adds this invocation's splat, which may have no rows, and sums another number. Returns the number of all rows;
// afterwards the splat of a row is entry_at(0, row), and starts[splat] is its first row.
uint share_rows(Ellipse e, uint v, out uint v_before) {
    uint lane = gl_LocalInvocationID.x;
    uvec2 all, before = sums_before(uvec2(e.rows, v), all);
    ellipses[lane] = uvec4(floatBitsToUint(vec3(e.mean, e.lean)), e.x_min | e.x_max << 16u);
    ellipses[WALKERS + lane] = uvec4(floatBitsToUint(vec3(e.width2, e.taper, e.tip)), e.y_min | e.rows << 16u);
    starts[lane] = before.x;
    v_before = before.y;
    barrier();
    return all.x;
}

Ellipse ellipse_of(uint splat) {
    uvec4 a = ellipses[splat], b = ellipses[WALKERS + splat];
    vec3 p = uintBitsToFloat(a.xyz), q = uintBitsToFloat(b.xyz);
    return Ellipse(p.xy, p.z, q.x, q.y, q.z, a.w & 0xffffu, a.w >> 16u, b.w & 0xffffu, b.w >> 16u);
}
