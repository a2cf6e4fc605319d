// Finds the tiles with a pixel where a splat counts (alpha >= ALPHA_MIN), in closed form: an ellipse is convex, so
// those of a row of tiles are an interval. Counting and emitting both use these functions. They are two pipelines but
// must agree to the last bit: hence `precise`. Rounding may add a tile but never drops one, so a picture does not
// depend on the tile size. Needs gaussian.glsl.

layout(constant_id = 1) const uint TILE_WIDTH = 8;
layout(constant_id = 2) const uint TILE_HEIGHT = 8;

// At y px below the mean, the ellipse reaches from lean y - w to lean y + w px right of it, where w w = width2 - taper
// y y. Its rightmost point is at y = tip, the leftmost one at -tip.
struct Ellipse {
    vec2 mean; // px
    float lean, width2, taper, tip;
    uint x_min, x_max; // first and last column of tiles of the bounding box,
    uint y_min, rows;  // first row, and number of rows; 0 if no pixel is in the box
};

// Half extents of the bounding box, with a margin for their rounding, px.
vec2 box_of(vec2 half_extent) {
    return half_extent * 1.0001 + 0.01;
}

// `extent` is that of the box.
Ellipse ellipse(StepUniforms step, vec2 mean, vec2 extent, vec3 q, float log2_o) {
    vec2 size = vec2(float(step.width), float(step.height));
    precise vec2 lo = max(ceil(mean - extent - 0.5), vec2(0.0)), hi = min(floor(mean + extent - 0.5), size - 1.0);
    bool some = lo.x <= hi.x && lo.y <= hi.y; // false for NaN too
    uvec2 a = uvec2(some ? lo : vec2(0.0)), b = uvec2(some ? hi : vec2(0.0));
    // The exponent falls from the mean to the border by `above`, and by a margin for its rounding in the picture.
    precise float above = max(log2_o - LOG2_ALPHA_MIN, 1e-6);
    precise vec2 far = min(extent, max(abs(mean), abs(size - mean)));
    precise float terms = abs(q.x) * far.x * far.x + abs(q.y) * far.x * far.y + abs(q.z) * far.y * far.y;
    precise float reach = above + 0.01 + 2e-6 * terms;
    precise float lean = -0.5 * q.y / q.x, width2 = reach / -q.x;
    // From the box without its margin: from q it would cancel for a needle.
    precise float height = (extent.y - 0.01) / 1.0001;
    precise float taper = above / (height * height) / -q.x;
    precise float tip = lean / sqrt(taper + lean * lean) * (height * sqrt(reach / above));
    bool sane = finite(lean * lean + width2 + taper + tip); // else beyond the range of floats: all tiles of the box
    Ellipse e;
    e.mean = mean;
    e.lean = sane ? lean : 0.0;
    e.width2 = sane ? width2 : 1e30;
    e.taper = sane ? taper : 0.0;
    e.tip = sane ? tip : 0.0;
    e.x_min = a.x / TILE_WIDTH;
    e.x_max = b.x / TILE_WIDTH;
    e.y_min = a.y / TILE_HEIGHT;
    e.rows = some ? b.y / TILE_HEIGHT - e.y_min + 1u : 0u;
    return e;
}

// First tile and number of tiles in a row of the bounding box.
uvec2 tiles_of_row(StepUniforms step, Ellipse e, uint row) {
    uint y = (e.y_min + row) * TILE_HEIGHT;
    precise float top = float(y) + 0.5 - e.mean.y, bottom = float(min(y + TILE_HEIGHT, step.height)) - 0.5 - e.mean.y;
    precise vec2 at = clamp(vec2(-e.tip, e.tip), vec2(top), vec2(bottom)); // where it is leftmost and rightmost in the row
    precise vec2 middle = e.lean * at, w = sqrt(max(e.width2 - e.taper * at * at, vec2(0.0)));
    precise vec2 margin = 0.001 + 1e-6 * (abs(e.mean.x) + abs(middle) + w);
    float x_min = float(e.x_min * TILE_WIDTH), x_max = float(min((e.x_max + 1u) * TILE_WIDTH, step.width) - 1u);
    precise float lo = max(ceil(e.mean.x + (middle.x - w.x) - margin.x - 0.5), x_min);
    precise float hi = min(floor(e.mean.x + (middle.y + w.y) + margin.y - 0.5), x_max);
    bool some = lo <= hi;
    uint first = uint(some ? lo : 0.0) / TILE_WIDTH, last = uint(some ? hi : 0.0) / TILE_WIDTH;
    return uvec2(first, some ? last - first + 1u : 0u);
}
