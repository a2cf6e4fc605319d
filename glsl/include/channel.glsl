// An additional channel of the backward pass, for opacities only: the difference between splat and pixel values.

#ifdef DISAGREEMENT
#include "view_label.glsl"

// Labels: the mask's against the splat's; no label behind all splats.
uint channel_of_pixel(uint p, bool inside, StepUniforms u, out float weight, out float behind) {
    uint here = view_label(p), own = here & LABEL_MASK;
    bool counts = inside && fetchc(target, p).w > 0.5 && (here & LABEL_BORDER) == 0u;
    weight = counts ? u.label_weight * u.loss_scale : 0.0;
    behind = own != 0u ? weight : 0.0;
    return own;
}

uint channel_of_splat(uint index, float z) {
    return fetchu(labels, fetchu(gaussian_from_splat, index));
}

float differs(uint pixel, uint splat, float weight) {
    return splat == pixel ? 0.0 : weight;
}

#ifndef NO_SUM
void write_sum(uint tile, float wrong[ROWS]) {
    float sum = 0.0;
    [[unroll]] for (uint k = 0u; k < ROWS; k++) {
        sum += wrong[k];
    }
    sum = tile_sum(sum);
    if (gl_LocalInvocationID.x == 0u) {
        disagreement[tile] = sum;
    }
}
#endif
#else
// Depths: 1 / known depth of the pixel, 0 for unknown, against the splat's; the background never matches.
uint channel_of_pixel(uint p, bool inside, StepUniforms u, out float weight, out float behind) {
    float inverse = inside ? depths[p] : 0.0;
    weight = inverse > 0.0 ? u.depth_weight : 0.0;
    behind = weight;
    return floatBitsToUint(inverse);
}

uint channel_of_splat(uint index, float z) {
    return floatBitsToUint(z);
}

float differs(uint pixel, uint splat, float weight) {
    return weight * min(abs(uintBitsToFloat(splat) * uintBitsToFloat(pixel) - 1.0), 1.0);
}
#endif
