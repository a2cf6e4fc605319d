//! Domains (what buffers count) and capacities (how many there may be).

/// What the elements of a buffer are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Domain {
    /// A single element.
    One,
    /// Rows of the model; visible splats are at most as many.
    Gaussians,
    /// Rows with optimiser state: the same as Gaussians, or 0 where nothing is trained.
    Trained,
    /// Rows with labels: the same as Gaussians, or 0 in a scene without masks.
    Labelled,
    /// Pairs of splat and tile.
    Instances,
    /// Pairs with a gradient record: the same as Instances, or 0 where nothing is trained.
    TrainedInstances,
    /// Tiles of all layers: the scene and each sampled object.
    VirtualTiles,
    /// Tiles of object layers that hold a splat.
    LayerTiles,
    /// Pixels of those tiles.
    LayerPixels,
    /// Pixels of one image.
    Pixels,
    /// Pixels with labels: the same as Pixels, or 0 in a scene without masks.
    LabelledPixels,
    /// Label ids, 0 included.
    Labels,
    /// Labels that a sweep of votes counts at once.
    VoteColumns,
    /// Gaussians times these.
    VoteCells,
    /// Layers, the scene included.
    Layers,
    /// Words of occluder bits of all layers.
    OccluderWords,
    /// Cells of the histogram of the sort.
    SortCells,
    /// Lanes of the scan.
    ScanLanes,
    /// Partial sums of the loss.
    LossPartials,
    /// Pixels of all jobs of the blend passes, or 0 while no tile's list is too long for one dispatch.
    SegmentPixels,
    /// A fixed number, whatever the capacity.
    Fixed(u32),
}

impl Domain {
    /// Plural noun for messages and tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::One => "one",
            Self::Gaussians => "gaussians",
            Self::Trained => "trained",
            Self::Labelled => "labelled",
            Self::Instances => "instances",
            Self::TrainedInstances => "trained instances",
            Self::VirtualTiles => "virtual tiles",
            Self::LayerTiles => "layer tiles",
            Self::LayerPixels => "layer pixels",
            Self::Pixels => "pixels",
            Self::LabelledPixels => "labelled pixels",
            Self::Labels => "labels",
            Self::VoteColumns => "vote columns",
            Self::VoteCells => "vote cells",
            Self::Layers => "layers",
            Self::OccluderWords => "occluder words",
            Self::SortCells => "sort cells",
            Self::ScanLanes => "scan lanes",
            Self::LossPartials => "loss partials",
            Self::SegmentPixels => "segment pixels",
            Self::Fixed(_) => "fixed",
        }
    }

    /// What the user can do when at most `fits` elements fit.
    pub fn cure(self, fits: u64) -> String {
        match self {
            Self::VoteColumns | Self::VoteCells => {
                format!("at most {fits} {} fit; lower --max-gaussians or use another device", self.name())
            }
            Self::Gaussians | Self::Trained | Self::Labelled => {
                format!("lower --max-gaussians to {fits} or use another device")
            }
            Self::Instances | Self::TrainedInstances | Self::SortCells | Self::ScanLanes => {
                format!(
                    "at most {fits} {} fit; lower --max-gaussians or --max-resolution, or use another device",
                    self.name()
                )
            }
            Self::Pixels | Self::LabelledPixels | Self::VirtualTiles | Self::LossPartials | Self::SegmentPixels => {
                format!("at most {fits} {} fit; lower --max-resolution or use another device", self.name())
            }
            Self::LayerTiles | Self::LayerPixels | Self::Labels | Self::Layers | Self::OccluderWords => {
                format!("at most {fits} {} fit; lower --label-samples or use another device", self.name())
            }
            Self::One | Self::Fixed(_) => "use another device".to_owned(),
        }
    }
}

/// The most there may be of each domain; decides the size of every buffer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Capacity {
    /// Rows of the model; visible splats are at most as many.
    pub gaussians: u64,
    /// Rows with optimiser state: the same as Gaussians, or 0 where nothing is trained.
    pub trained: u64,
    /// Rows with labels: the same as Gaussians, or 0 in a scene without masks.
    pub labelled: u64,
    /// Pairs of splat and tile.
    pub instances: u64,
    /// Pairs with a gradient record: the same as Instances, or 0 where nothing is trained.
    pub trained_instances: u64,
    /// Tiles of all layers: the scene and each sampled object.
    pub virtual_tiles: u64,
    /// Tiles of object layers that hold a splat.
    pub layer_tiles: u64,
    /// Pixels of those tiles.
    pub layer_pixels: u64,
    /// Pixels of one image.
    pub pixels: u64,
    /// Pixels with labels: the same as Pixels, or 0 in a scene without masks.
    pub labelled_pixels: u64,
    /// Label ids, 0 included.
    pub labels: u64,
    /// Labels that a sweep of votes counts at once.
    pub vote_columns: u64,
    /// Gaussians times these.
    pub vote_cells: u64,
    /// Layers, the scene included.
    pub layers: u64,
    /// Words of occluder bits of all layers.
    pub occluder_words: u64,
    /// Cells of the histogram of the sort.
    pub sort_cells: u64,
    /// Lanes of the scan.
    pub scan_lanes: u64,
    /// Partial sums of the loss.
    pub loss_partials: u64,
    /// Pixels of all jobs of the blend passes, or 0 while no tile's list is too long for one dispatch.
    pub segment_pixels: u64,
    /// Lanes of the sort; no buffer counts them.
    pub sort_lanes: u64,
    /// Dispatches that one walk of a tile's list may take; no buffer counts them.
    pub segments: u64,
}

impl Capacity {
    /// Number of elements of a domain.
    pub fn count(&self, domain: Domain) -> u64 {
        match domain {
            Domain::One => 1,
            Domain::Gaussians => self.gaussians,
            Domain::Trained => self.trained,
            Domain::Labelled => self.labelled,
            Domain::Instances => self.instances,
            Domain::TrainedInstances => self.trained_instances,
            Domain::VirtualTiles => self.virtual_tiles,
            Domain::LayerTiles => self.layer_tiles,
            Domain::LayerPixels => self.layer_pixels,
            Domain::Pixels => self.pixels,
            Domain::LabelledPixels => self.labelled_pixels,
            Domain::Labels => self.labels,
            Domain::VoteColumns => self.vote_columns,
            Domain::VoteCells => self.vote_cells,
            Domain::Layers => self.layers,
            Domain::OccluderWords => self.occluder_words,
            Domain::SortCells => self.sort_cells,
            Domain::ScanLanes => self.scan_lanes,
            Domain::LossPartials => self.loss_partials,
            Domain::SegmentPixels => self.segment_pixels,
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
