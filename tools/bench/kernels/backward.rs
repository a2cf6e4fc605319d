//! Other ways through the backward pass, as changes of `blend_backward.comp`.
//!
//! The engine walks back to front and has the transmittance in front of a splat by division. Two modes here walk
//! forward first, as the forward pass did, and keep T: at least every 8th splat, in shared memory, where each lane
//! reads its own words alone, so that no barrier is needed. Lists of more batches than there is room for keep T less
//! often. One mode walks front to back.

use super::patch::Patch;

const FILE: &str = "blend_backward";

/// Declarations, and a walk forward through a batch.
const WALK: &str = "
// T in front of every STRIDE-th batch.
const uint KEPT = 8192u / (TILE_WIDTH * TILE_HEIGHT);
shared float kept_T[KEPT * TILE_WIDTH * TILE_HEIGHT];

TileSplat load(uint list_start, uint at, vec2 corner) {
    uint index = fetchu(splat_from_instance, fetchu(instance_from_sorted, list_start + at));
    vec4 r0 = fetch4(splats, 3u * index), r1 = fetch4(splats, 3u * index + 1u);
    return TileSplat(r0.x - corner.x, r0.y - corner.y, r0.z, r0.w, r1.x, r1.y, vec3(0.0), 0.0);
}

// T behind splat j of a batch, in the arithmetic of blend_forward.
void step_forward(TileSplat mine, uint j, uint position, TileJob t, uint last_[ROWS], inout float T[ROWS]) {
    TileSplat s = broadcast(mine, j);
    float dx = s.x - t.px;
    float ax = s.lo + s.a * dx * dx, bx = s.b * dx;
    float dy0 = s.y - t.row0;
    [[unroll]] for (uint k = 0u; k < ROWS; k++) {
        float dy = dy0 - float(k);
        precise float e = ax + dy * (bx + s.c * dy);
        float alpha = min(ALPHA_MAX, exp2(max(e, -20.0)));
        alpha = e < LOG2_ALPHA_MIN || position > last_[k] ? 0.0 : alpha;
        precise float next = T[k] * (1.0 - alpha);
        T[k] = next;
    }
}

void main() {";

/// Before the walk back: the walk forward.
const KEEP: &str = "    uint stride = max((batches + KEPT - 1u) / KEPT, 1u);
    float ahead[ROWS];
    [[unroll]] for (uint k = 0u; k < ROWS; k++) {
        ahead[k] = 1.0;
    }
    for (uint batch = 0u; batch < batches; batch++) {
        if (batch % stride == 0u) {
            [[unroll]] for (uint k = 0u; k < ROWS; k++) {
                kept_T[((batch / stride) * ROWS + k) * SUBGROUP_SIZE + lane] = ahead[k];
            }
        }
        uint base = batch * SUBGROUP_SIZE;
        uint count = min(SUBGROUP_SIZE, deepest - base);
        TileSplat mine = load(list_start, min(base + lane, deepest - 1u), corner);
        for (uint j = 0u; j < count; j++) {
            step_forward(mine, j, base + j + 1u, t, final_, ahead);
        }
    }
    for (uint batch = batches; batch > first; batch--) {";

/// Before a batch of the walk back: T behind it is that in front of the next one, where that was kept.
const RESTART: &str = "        if (batch < batches && batch % stride == 0u) {
            [[unroll]] for (uint k = 0u; k < ROWS; k++) {
                T[k] = kept_T[((batch / stride) * ROWS + k) * SUBGROUP_SIZE + lane];
            }
        }
        for (uint back = count; back > 0u; back--) {";

/// Before a batch of the walk back: T in front of each of its splats.
const REPLAY: &str = "        float front[SUBGROUP_SIZE * ROWS];
        uint from = (batch - 1u) / stride;
        [[unroll]] for (uint k = 0u; k < ROWS; k++) {
            ahead[k] = kept_T[(from * ROWS + k) * SUBGROUP_SIZE + lane];
        }
        for (uint early = from * stride; early + 1u < batch; early++) {
            TileSplat theirs = load(list_start, early * SUBGROUP_SIZE + lane, corner);
            for (uint j = 0u; j < SUBGROUP_SIZE; j++) {
                step_forward(theirs, j, early * SUBGROUP_SIZE + j + 1u, t, final_, ahead);
            }
        }
        for (uint j = 0u; j < count; j++) {
            [[unroll]] for (uint k = 0u; k < ROWS; k++) {
                front[j * ROWS + k] = ahead[k];
            }
            step_forward(mine, j, base + j + 1u, t, final_, ahead);
        }
        for (uint back = count; back > 0u; back--) {";

const MAIN: &str = "void main() {";
const BATCHES: &str = "    for (uint batch = batches; batch > first; batch--) {";
const SPLATS: &str = "        for (uint back = count; back > 0u; back--) {";
const DIVISION: &str = "T[k] = T[k] / (1.0 - alpha);";

const fn change(find: &'static str, replace: &'static str) -> Patch {
    Patch { file: FILE, find, replace }
}

/// T is kept on a walk forward; in between by division.
pub const RESTARTED: &[Patch] = &[change(MAIN, WALK), change(BATCHES, KEEP), change(SPLATS, RESTART)];

/// T is kept on a walk forward, and each batch is walked forward again; no division.
pub const REPLAYED: &[Patch] = &[
    change(MAIN, WALK),
    change(BATCHES, KEEP),
    change(SPLATS, REPLAY),
    change(DIVISION, "T[k] = front[j * ROWS + k];"),
];

/// Front to back: `behind` holds the light of everything not passed yet, with its transmittance, and what is passed is
/// subtracted: p = w u - alpha / (1 - alpha) rest.
pub const FROM_THE_FRONT: &[Patch] = &[
    change(
        "            T[k] = fetch4(image, p).w;
            final_[k] = inside ? fetchu(last, p) : 0u;
            g = fetch4(v_image, p).xyz;
            behind[k] = dot(u.background, g);",
        "            T[k] = 1.0;
            final_[k] = inside ? fetchu(last, p) : 0u;
            g = fetch4(v_image, p).xyz;
            behind[k] = dot(fetch4(image, p).xyz, g);",
    ),
    change(BATCHES, "    for (uint batch = first + 1u; batch <= batches; batch++) {"),
    change("uint j = back - 1u;", "uint j = count - back;"),
    change(DIVISION, ""),
    change(
        "float difference = light - behind[k];
                float p = raw >= ALPHA_MAX ? 0.0 : w * difference;
                behind[k] += alpha * difference;",
        "behind[k] -= w * light;
                float p = raw >= ALPHA_MAX ? 0.0 : w * light - alpha / (1.0 - alpha) * behind[k];
                T[k] *= 1.0 - alpha;",
    ),
];
