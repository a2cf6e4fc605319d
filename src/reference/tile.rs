//! Tiles in which a splat counts: by testing every pixel, by a continuous test over the tile's pixel centres, and in
//! closed form for a row of tiles.

use super::Rules;
use super::splat::Splat;

/// log2 of alpha at a position (px), before the clamp.
pub fn exponent(splat: &Splat, at: [f64; 2]) -> f64 {
    let (dx, dy) = (splat.mean2d[0] - at[0], splat.mean2d[1] - at[1]);
    let [a, b, c] = splat.conic;
    splat.opacity.log2() - (0.5 * (a * dx * dx + c * dy * dy) + b * dx * dy) * std::f64::consts::LOG2_E
}

/// A grid of tiles over an image; the image border may cut the last column and row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TileGrid {
    /// Image size, px.
    pub size: (usize, usize),
    /// Tile size, px.
    pub tile: (usize, usize),
}

impl TileGrid {
    /// Number of tile columns.
    pub fn columns(&self) -> usize {
        self.size.0.div_ceil(self.tile.0)
    }

    /// Number of tile rows.
    pub fn rows(&self) -> usize {
        self.size.1.div_ceil(self.tile.1)
    }

    /// Columns and rows of pixels `[start, end)` of each tile, in row-major order.
    fn spans(&self) -> impl Iterator<Item = ((usize, usize), (usize, usize))> {
        let all = (0..self.rows()).flat_map(|row| (0..self.columns()).map(move |column| (column, row)));
        all.map(|(column, row)| (self.span_x(column), self.span_y(row)))
    }

    /// Number of tiles.
    pub fn count(&self) -> usize {
        self.columns() * self.rows()
    }

    /// Pixel columns `[start, end)` of tile column `column`.
    pub fn span_x(&self, column: usize) -> (usize, usize) {
        (column * self.tile.0, ((column + 1) * self.tile.0).min(self.size.0))
    }

    /// Pixel rows `[start, end)` of tile row `row`.
    pub fn span_y(&self, row: usize) -> (usize, usize) {
        (row * self.tile.1, ((row + 1) * self.tile.1).min(self.size.1))
    }
}

/// Result of a continuous test.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Touch {
    /// True if alpha reaches the minimum somewhere in the rectangle.
    pub touches: bool,
    /// Distance of the largest exponent to the cut, log2 units.
    pub margin: f64,
}

/// Largest exponent over the rectangle [low, high] of positions, px.
pub fn largest_exponent(splat: &Splat, low: [f64; 2], high: [f64; 2]) -> f64 {
    let m = splat.mean2d;
    let nearest = [m[0].clamp(low[0], high[0]), m[1].clamp(low[1], high[1])];
    if nearest == m {
        return exponent(splat, m);
    }
    // The form is concave: unless its centre is inside, the maximum is on an edge, at that edge's own best point.
    let [a, b, c] = splat.conic;
    let on_vertical = |x: f64| [x, (m[1] + b * (m[0] - x) / c).clamp(low[1], high[1])];
    let on_horizontal = |y: f64| [(m[0] + b * (m[1] - y) / a).clamp(low[0], high[0]), y];
    [on_vertical(low[0]), on_vertical(high[0]), on_horizontal(low[1]), on_horizontal(high[1])]
        .into_iter()
        .map(|at| exponent(splat, at))
        .fold(f64::NEG_INFINITY, f64::max)
}

/// Continuous test of the pixel centres of columns `[x0, x1)` and rows `[y0, y1)`.
pub fn touch(rules: &Rules, splat: &Splat, (x0, x1): (usize, usize), (y0, y1): (usize, usize)) -> Touch {
    let low = [x0 as f64 + 0.5, y0 as f64 + 0.5];
    let high = [x1 as f64 - 0.5, y1 as f64 - 0.5];
    let above = largest_exponent(splat, low, high) - rules.exponent_min();
    Touch { touches: above >= 0.0, margin: above.abs() }
}

/// Tests if the splat counts anywhere between the outermost pixel centres of the image.
pub fn cull(rules: &Rules, splat: &Splat, size: (usize, usize)) -> Touch {
    touch(rules, splat, (0, size.0), (0, size.1))
}

/// Tiles that pass the continuous test, in row-major order, and the smallest margin of all tiles.
pub fn touched_tiles(rules: &Rules, splat: &Splat, grid: &TileGrid) -> (Vec<u32>, f64) {
    let mut tiles = Vec::new();
    let mut margin = f64::INFINITY;
    for (tile, (columns, rows)) in (0..).zip(grid.spans()) {
        let touch = touch(rules, splat, columns, rows);
        margin = margin.min(touch.margin);
        if touch.touches {
            tiles.push(tile);
        }
    }
    (tiles, margin)
}

/// Columns of tiles `[start, end)` with a column of pixel centres that the splat's ellipse reaches within a row of
/// tiles, between its first and last row of pixel centres; in closed form.
pub fn row_interval(rules: &Rules, splat: &Splat, grid: &TileGrid, row: usize) -> (usize, usize) {
    // A dx^2 + 2 B dx dy + C dy^2 <= size is A (dx + B dy / A)^2 + (C - B^2 / A) dy^2 <= size.
    let [a, b, c] = splat.conic;
    let size = 2.0 * std::f64::consts::LN_2 * (splat.opacity.log2() - rules.exponent_min());
    let rest = (a * c - b * b) / a;
    let (top, bottom) = grid.span_y(row);
    let height = (size / rest).sqrt();
    let from = (top as f64 + 0.5 - splat.mean2d[1]).max(-height);
    let to = (bottom as f64 - 0.5 - splat.mean2d[1]).min(height);
    if size < 0.0 || from > to {
        return (0, 0);
    }
    // The rightmost point of the ellipse is where the normal has no dy: B dx + C dy = 0.
    let tip = -b / c * (size / (a - b * b / c)).sqrt();
    let ends = [-1.0, 1.0].map(|side| {
        let dy = (side * tip).clamp(from, to);
        splat.mean2d[0] - b / a * dy + side * ((size - rest * dy * dy).max(0.0) / a).sqrt()
    });
    let first = (ends[0] - 0.5).ceil().max(0.0);
    let last = (ends[1] - 0.5).floor().min(grid.size.0 as f64 - 1.0);
    if first > last { (0, 0) } else { (first as usize / grid.tile.0, last as usize / grid.tile.0 + 1) }
}

/// Tiles whose largest exponent is at most `slack` (log2 units) below the cut. An engine that may add tiles lists at
/// least those of slack 0 and at most those of its own slack.
pub fn tiles_within(rules: &Rules, splat: &Splat, grid: &TileGrid, slack: f64) -> Vec<u32> {
    let lower = Rules { alpha_min: rules.alpha_min * (-slack).exp2(), ..rules.clone() };
    touched_tiles(&lower, splat, grid).0
}

/// Tiles in which at least one pixel counts, by testing each pixel; always a subset of `touched_tiles`.
pub fn counted_tiles(rules: &Rules, splat: &Splat, grid: &TileGrid) -> Vec<u32> {
    let counts = |x: usize, y: usize| exponent(splat, [x as f64 + 0.5, y as f64 + 0.5]) >= rules.exponent_min();
    let tiles = (0..).zip(grid.spans());
    let counted = tiles.filter(|&(_, ((x0, x1), (y0, y1)))| (y0..y1).any(|y| (x0..x1).any(|x| counts(x, y))));
    counted.map(|(tile, _)| tile).collect()
}

/// A splat in a tile of a layer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Instance {
    /// layer * tiles + tile; layer 0 is the scene, layer 1 + j the object slot j.
    pub key: u32,
    /// Index in the depth-ordered list of splats.
    pub splat: u32,
}

/// Instances of all splats: for each splat, first the scene's tiles, then the same tiles in its object layer.
/// `slot_of(gaussian)` is the object slot of a labelled Gaussian in this step.
pub fn emit_instances(
    rules: &Rules,
    splats: &[Splat],
    grid: &TileGrid,
    slot_of: impl Fn(usize) -> Option<usize>,
) -> Vec<Instance> {
    let mut instances = Vec::new();
    for (index, splat) in splats.iter().enumerate() {
        let (tiles, _) = touched_tiles(rules, splat, grid);
        let layers = std::iter::once(0).chain(slot_of(splat.gaussian).map(|slot| slot + 1));
        for layer in layers {
            let key = |tile: &u32| (layer * grid.count()) as u32 + tile;
            instances.extend(tiles.iter().map(|tile| Instance { key: key(tile), splat: index as u32 }));
        }
    }
    instances
}

/// Length of the longest list, and for each key whether its list has entries.
pub fn tile_lengths(ranges: &[[u32; 2]]) -> (u32, Vec<bool>) {
    let lengths = ranges.iter().map(|[start, end]| end - start);
    (lengths.clone().max().unwrap_or(0), lengths.map(|length| length > 0).collect())
}

/// `[start, end)` of each key in a sorted list of keys; a missing key gets the empty range at its place.
pub fn tile_ranges(sorted_keys: &[u32], keys: usize) -> Vec<[u32; 2]> {
    let before = |key: usize| sorted_keys.iter().filter(|&&found| (found as usize) < key).count() as u32;
    (0..keys).map(|key| [before(key), before(key + 1)]).collect()
}
