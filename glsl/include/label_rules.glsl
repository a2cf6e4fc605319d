// Rules of the labels: which pixels are hidden from an object, and the lift.

// 1: the paper's lift is on, for which each pixel remembers its main splat.
layout(constant_id = 16) const uint LIFT = 0;
const bool REMEMBERS_MAIN = LIFT != 0u;

// U_k(v) = 0: the pixel belongs to an object that hides this layer's object, or lies too near to a contour.
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
    uint label = fetchu(view_labels, p);
    // A pixel near a contour has the bit above the label too.
    if (label == 0u || label > LABEL_MASK || fetchu(layer_from_label, label) == 0u) {
        return;
    }
    vec2 centre = floor(fetch4(splats, 3u * splat).xy);
    bool inside = all(greaterThanEqual(centre, vec2(0.0))) && all(lessThan(centre, vec2(float(u.width), float(u.height))));
    if (!inside) {
        return;
    }
    if (u.gpf != 0u && (fetchu(view_labels, uint(centre.y) * u.width + uint(centre.x)) & LABEL_MASK) != label) {
        return;
    }
    uint key = (uint(weight * 65535.0) << 16) | label;
    atomicMax(label_keys[fetchu(gaussian_from_splat, splat)], key);
}
