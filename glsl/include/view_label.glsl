// The id of a pixel of the mask, with LABEL_BORDER near a contour. view_labels is declared before.

layout(constant_id = 21) const uint LABELS_PER_WORD = 1; // 2: of 16 bits each, the highest of which is the flag

uint view_label(uint p) {
    if (LABELS_PER_WORD == 1u) {
        return fetchu(view_labels, p);
    }
    uint found = fetchu(view_labels, p >> 1u) >> 16u * (p & 1u);
    return (found & 0x7fffu) | (found & 0x8000u) << 1u;
}
