// Label rules: the pixels at which an object is hidden, and the lift.

#include "view_label.glsl"

// 1: the paper's lift is on; each pixel then records its main splat.
layout(constant_id = 16) const uint LIFT = 0;
const bool REMEMBERS_MAIN = LIFT != 0u;

// U_k(v) = 0: the pixel belongs to an object that hides this layer's object, or is near a contour.
bool left_out(uint layer, uint here, StepUniforms u) {
    if ((here & LABEL_BORDER) != 0u) {
        return true;
    }
    uint label = here & LABEL_MASK;
    uint word = layer_occluders[layer * u.occluder_words + (label >> 5)];
    return ((word >> (label & 31u)) & 1u) != 0u;
}

// Main-Gaussian labelling with the projection filter: pixel p of a sampled object votes for the Gaussian that
// dominates it. Keys order by weight, then label, so the maximum does not depend on the order of the votes.
void lift(uint p, uint splat, float weight, StepUniforms u) {
    uint label = view_label(p);
    // A pixel near a contour also has LABEL_BORDER set.
    if (label == 0u || label > LABEL_MASK || fetchu(layer_from_label, label) == 0u) {
        return;
    }
    vec2 centre = floor(fetch4(splats, 3u * splat).xy);
    bool inside = all(greaterThanEqual(centre, vec2(0.0))) && all(lessThan(centre, vec2(float(u.width), float(u.height))));
    if (!inside) {
        return;
    }
    if (u.gpf != 0u && (view_label(uint(centre.y) * u.width + uint(centre.x)) & LABEL_MASK) != label) {
        return;
    }
    uint key = (uint(weight * 65535.0) << 16) | label;
    atomicMax(label_keys[fetchu(gaussian_from_splat, splat)], key);
}

// Output of blend_forward for a layer's tile: its loss, and the state at the start of the backward pass.
void finish_layer(TileJob t, float T[ROWS], vec3 colour[ROWS], uint final_[ROWS], StepUniforms u) {
    float loss = 0.0;
    uint label = label_from_layer[t.layer];
    [[unroll]] for (uint k = 0u; k < ROWS; k++) {
        bool inside = t.x < u.width && t.y0 + k < u.height;
        uint p = inside ? (t.y0 + k) * u.width + t.x : 0u;
        uint here = view_label(p);
        vec4 photo = fetchc(target, p);
        vec4 wanted = here == label ? vec4(photo.xyz, 1.0) : vec4(0.0);
        bool counts = inside && photo.w > 0.5 && !left_out(t.layer, here, u);
        vec4 difference = counts ? vec4(colour[k], 1.0 - abs(T[k])) - wanted : vec4(0.0);
        vec4 change = counts ? abs(difference) - wanted : vec4(0.0); // wanted >= 0
        // The opacity error beyond the slack is penalised, except where another object may be in front. With zero
        // opacity, it is 1 - slack inside the mask, 0 outside.
        float off = here == label || here == 0u ? max(abs(difference.w) - ALPHA_SLACK, 0.0) : 0.0;
        loss += change.x + change.y + change.z + u.label_alpha * (off - (counts ? (1.0 - ALPHA_SLACK) * wanted.w : 0.0));
        difference.w = off > 0.0 ? difference.w : 0.0;
        layer_state[layer_pixel(t, k)] = uvec2(floatBitsToUint(abs(T[k])), final_[k] | pack_signs(difference));
    }
    loss = tile_sum(loss);
    if (gl_LocalInvocationID.x == 0u) {
        layer_loss[t.layer_tile] = loss * layer_weights[t.layer];
    }
}
