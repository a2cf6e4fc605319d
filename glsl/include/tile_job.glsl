// What a subgroup or workgroup of the blend passes works on, and the order of that.

struct TileJob {
    uint layer;      // 0: the scene
    uint tile;       // within the layer
    uint layer_tile; // index among the occupied layer tiles
    uint x, y0;      // the lane's column and first row, px
    float px;        // centre of the lane's column relative to the tile's left edge
    float row0;      // first row of the lane relative to the tile's top edge
};

// Some devices split a dispatch in two halves; they split it here.
bool in_first_half(uint i, uint n) {
    return i < (n + 1u) / 2u;
}

// Neighbouring tiles cost about the same. The even ones form the first half of the groups and the odd ones the second,
// so devices that split a dispatch into fixed halves get two halves of equal cost.
uint interleave(uint i, uint n) {
    return in_first_half(i, n) ? 2u * i : 2u * (i - (n + 1u) / 2u) + 1u;
}
