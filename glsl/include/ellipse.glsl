// Finds the tiles with a pixel where a splat counts (alpha >= ALPHA_MIN). Counting and emitting both use this function.
// They are two pipelines but must agree to the last bit: hence `precise`.

layout(constant_id = 1) const uint TILE_WIDTH = 8;
layout(constant_id = 2) const uint TILE_HEIGHT = 8;

struct TileRect { // inclusive; empty if count is 0
    uint x_min, x_max, y_min, y_max, count;
};

// Tiles that overlap the bounding box of the ellipse; half extents in px.
TileRect tile_rect(StepUniforms step, vec2 mean, vec2 extent) {
    precise vec2 lo = max(ceil(mean - extent - 0.5), vec2(0.0));
    precise vec2 hi = min(floor(mean + extent - 0.5), vec2(float(step.width) - 1.0, float(step.height) - 1.0));
    TileRect r;
    bool some = lo.x <= hi.x && lo.y <= hi.y; // false for NaN too
    uvec2 a = uvec2(some ? lo : vec2(0.0)), b = uvec2(some ? hi : vec2(0.0));
    r.x_min = a.x / TILE_WIDTH;
    r.x_max = b.x / TILE_WIDTH;
    r.y_min = a.y / TILE_HEIGHT;
    r.y_max = b.y / TILE_HEIGHT;
    r.count = some ? (r.x_max - r.x_min + 1u) * (r.y_max - r.y_min + 1u) : 0u;
    return r;
}

// Base-2 exponent of the splat at offset d = mean - pixel.
float splat_exponent(vec3 q, float log2_o, vec2 d) {
    precise float exponent = log2_o + q.x * d.x * d.x + d.y * (q.y * d.x + q.z * d.y);
    return exponent;
}

// True if the concave exponent reaches the cut somewhere in the rectangle of the tile's pixel centres. The rounding
// margin may add a tile but never drops one, so a picture does not depend on the tile size.
bool tile_touched(StepUniforms step, uint tx, uint ty, vec2 mean, vec3 q, float log2_o) {
    vec2 lo = vec2(float(tx * TILE_WIDTH), float(ty * TILE_HEIGHT)) + 0.5;
    vec2 hi = min(lo + vec2(float(TILE_WIDTH), float(TILE_HEIGHT)) - 1.0, vec2(float(step.width), float(step.height)) - 0.5);
    precise vec2 d_min = mean - hi, d_max = mean - lo; // range of mean - pixel
    vec2 e = clamp(vec2(0.0), d_min, d_max);   // offset closest to the mean, per axis
    // maximum along the vertical edge that faces the mean, and along the horizontal edge that faces it
    precise float y = clamp(-0.5 * q.y * e.x / q.z, d_min.y, d_max.y);
    precise float x = clamp(-0.5 * q.y * e.y / q.x, d_min.x, d_max.x);
    vec2 p = vec2(e.x, y), r = vec2(x, e.y);
    float best = max(splat_exponent(q, log2_o, p), splat_exponent(q, log2_o, r));
    vec2 m = max(abs(p), abs(r));
    precise float margin = 0.01 + 2e-6 * (abs(q.x) * m.x * m.x + abs(q.y) * m.x * m.y + abs(q.z) * m.y * m.y);
    return best >= LOG2_ALPHA_MIN - margin;
}
