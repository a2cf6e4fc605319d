//! Domains (what buffers count) and capacities (how many there may be).

/// What the elements of a buffer are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Domain {
    /// A single element.
    One,
    /// Rows of the model.
    Gaussians,
    /// Visible Gaussians of one view.
    Splats,
    /// Pairs of splat and tile.
    Instances,
    /// Tiles of all layers: the full image and each sampled object.
    VirtualTiles,
    /// Tiles of one layer.
    LayerTiles,
    /// Pixels of one image.
    Pixels,
    /// Pixels of all layers.
    LayerPixels,
    /// Counters of the radix sort: digits times workgroups.
    SortLanes,
    /// Partial sums of the scan.
    ScanLanes,
    /// Label ids.
    Labels,
    /// A fixed number, whatever the capacity.
    Fixed(u32),
}

impl Domain {
    /// Plural noun for messages and tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::One => "one",
            Self::Gaussians => "gaussians",
            Self::Splats => "splats",
            Self::Instances => "instances",
            Self::VirtualTiles => "virtual tiles",
            Self::LayerTiles => "tiles",
            Self::Pixels => "pixels",
            Self::LayerPixels => "layer pixels",
            Self::SortLanes => "sort lanes",
            Self::ScanLanes => "scan lanes",
            Self::Labels => "labels",
            Self::Fixed(_) => "fixed",
        }
    }

    /// What the user can do when at most `fits` elements fit.
    pub fn cure(self, fits: u64) -> String {
        match self {
            Self::Gaussians | Self::Splats => {
                format!("lower --max-gaussians to {fits} or use another device")
            }
            Self::Instances | Self::SortLanes | Self::ScanLanes => {
                format!(
                    "at most {fits} {} fit; lower --max-gaussians or the image size, or use another device",
                    self.name()
                )
            }
            Self::VirtualTiles | Self::LayerTiles | Self::Pixels | Self::LayerPixels => {
                format!("at most {fits} {} fit; use smaller images or another device", self.name())
            }
            Self::Labels => format!("at most {fits} labels fit; use fewer labels or another device"),
            Self::One | Self::Fixed(_) => "use another device".to_owned(),
        }
    }
}

/// The most there may be of each domain; decides the size of every buffer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Capacity {
    /// Rows of the model.
    pub gaussians: u64,
    /// Visible Gaussians of one view.
    pub splats: u64,
    /// Pairs of splat and tile.
    pub instances: u64,
    /// Tiles of all layers.
    pub virtual_tiles: u64,
    /// Tiles of one layer.
    pub layer_tiles: u64,
    /// Pixels of one image.
    pub pixels: u64,
    /// Pixels of all layers.
    pub layer_pixels: u64,
    /// Counters of the radix sort.
    pub sort_lanes: u64,
    /// Partial sums of the scan.
    pub scan_lanes: u64,
    /// Label ids.
    pub labels: u64,
}

impl Capacity {
    /// Number of elements of a domain.
    pub fn count(&self, domain: Domain) -> u64 {
        match domain {
            Domain::One => 1,
            Domain::Gaussians => self.gaussians,
            Domain::Splats => self.splats,
            Domain::Instances => self.instances,
            Domain::VirtualTiles => self.virtual_tiles,
            Domain::LayerTiles => self.layer_tiles,
            Domain::Pixels => self.pixels,
            Domain::LayerPixels => self.layer_pixels,
            Domain::SortLanes => self.sort_lanes,
            Domain::ScanLanes => self.scan_lanes,
            Domain::Labels => self.labels,
            Domain::Fixed(count) => u64::from(count),
        }
    }

    /// The next capacity when `needed` elements did not fit into `current`: half as much again, and at least a tenth
    /// more than what was needed, so that a slowly growing need does not overflow at each step.
    pub fn grown(current: u64, needed: u64) -> u64 {
        let half_again = current.saturating_add(current / 2);
        let tenth_more = needed.saturating_add(needed.div_ceil(10));
        half_again.max(tenth_more)
    }
}
