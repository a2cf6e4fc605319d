//! Counts of a step, and sectors of memory that follow from them.

use serde::Serialize;

/// Bytes of the smallest piece of memory that cards move.
pub const SECTOR: f64 = 32.0;

/// Counts of a step.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Counts {
    /// Gaussians.
    pub gaussians: f64,
    /// Gaussians in the view.
    pub visible: f64,
    /// (splat, tile) pairs of all layers.
    pub instances: f64,
    /// Of these, pairs that tiles walk before all their pixels stop.
    pub walked: f64,
    /// Pairs up to the last that has a weight at a pixel of its tile: the backward pass walks these.
    pub weighted: f64,
    /// Pairs of the splat with the most tiles.
    pub largest_splat: f64,
    /// Mean over groups of 32 neighbouring splats of the most tiles of one, by the mean number of tiles of a splat.
    pub divergence: f64,
    /// Pairs in the longest list of a tile.
    pub longest_list: f64,
    /// Width of the picture, px.
    pub width: f64,
    /// Height of the picture, px.
    pub height: f64,
    /// Tiles of the picture.
    pub tiles: f64,
    /// Pixels of a tile.
    pub tile_pixels: f64,
    /// Layers of objects.
    pub layers: f64,
    /// Tiles of these layers with a splat.
    pub layer_tiles: f64,
    /// Tiles of the picture with a splat of at least one layer.
    pub object_tiles: f64,
    /// Gaussians in the view that belong to one of the layers.
    pub layer_visible: f64,
}

impl Counts {
    /// Pixels of the picture.
    pub fn pixels(&self) -> f64 {
        self.width * self.height
    }

    /// Tiles of the picture and of all layers, whether they have splats or not.
    pub fn virtual_tiles(&self) -> f64 {
        self.tiles * (self.layers + 1.0)
    }

    /// Workgroups of the blend passes.
    pub fn jobs(&self) -> f64 {
        self.tiles + self.layer_tiles
    }

    /// Tiles of a splat, over all layers.
    pub fn tiles_of_splat(&self) -> f64 {
        self.instances / self.visible.max(1.0)
    }

    /// Share of the pairs that tiles walk.
    pub fn walked_share(&self) -> f64 {
        self.walked / self.instances.max(1.0)
    }
}

/// Bytes of the sectors of all of `rows` rows of `bytes` bytes.
pub fn all(rows: f64, bytes: f64) -> f64 {
    (rows * bytes / SECTOR).ceil() * SECTOR
}

/// Bytes of the sectors that are touched if `chosen` of `rows` rows are, at random.
pub fn some(rows: f64, chosen: f64, bytes: u32) -> f64 {
    if rows <= 0.0 {
        return 0.0;
    }
    let missed = 1.0 - (chosen / rows).min(1.0);
    let sector = SECTOR as u32;
    // Rows and sectors begin together once in this many bytes.
    let period = (1..).map(|k| k * bytes).find(|p| p.is_multiple_of(sector)).unwrap_or(bytes);
    let touched: f64 = (0..period / sector)
        .map(|index| {
            let (first, last) = (index * sector / bytes, ((index + 1) * sector - 1) / bytes);
            1.0 - missed.powi((last - first + 1) as i32)
        })
        .sum();
    touched * SECTOR * rows * f64::from(bytes) / f64::from(period)
}

/// Bytes of the sectors that are touched if `chosen` of `rows` rows are, and the chance of a row falls evenly with its
/// number. So do pairs in the order of depth: tiles stop walking at different depths.
pub fn front(rows: f64, chosen: f64, bytes: f64) -> f64 {
    if rows <= 0.0 {
        return 0.0;
    }
    let (share, together) = ((chosen / rows).min(1.0), (SECTOR / bytes).max(1.0));
    // Rows beyond `reach` are never chosen; the chance falls from 1 to `1 - fall` there.
    let (reach, fall) = if share < 0.5 { (2.0 * share, 1.0) } else { (1.0, 2.0 - 2.0 * share) };
    rows * bytes * reach * (1.0 - fall.powf(together) / (together + 1.0))
}
