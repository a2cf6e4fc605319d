//! Domains (what buffers count) and capacities (how many there may be): one table, a row for each domain.

/// What the user can do, by what decides a domain: `{fits}` and `{name}` stand for the number that fits, and of what.
mod cures {
    pub(super) const MODEL: &str = "lower `max_gaussians` to {fits} or use another device";
    pub(super) const VOTES: &str = "at most {fits} {name} fit; lower `max_gaussians` or use another device";
    pub(super) const PAIRS: &str =
        "at most {fits} {name} fit; lower `max_gaussians` or `max_resolution`, or use another device";
    pub(super) const IMAGE: &str = "at most {fits} {name} fit; lower `max_resolution` or use another device";
    pub(super) const LAYERS: &str = "at most {fits} {name} fit; lower `label_samples` or use another device";
    pub(super) const NONE: &str = "use another device";
}

/// Declares a table of domains and the capacities that count them.
///
/// Each row is `Variant field: "name", cure, "doc";`. Behind `..` stand capacities that no buffer counts.
macro_rules! domains {
    ($domain:ident, $capacity:ident;
        $($row:ident $field:ident: $name:literal, $cure:expr, $doc:literal;)*
        .. $($other:ident: $other_doc:literal;)*) => {
        /// What the elements of a buffer are.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum $domain {
            /// A single element.
            One,
            $(#[doc = $doc] $row,)*
            /// A fixed number, whatever the capacity.
            Fixed(u32),
        }

        impl $domain {
            /// Plural noun for messages and tables.
            pub fn name(self) -> &'static str {
                match self {
                    Self::One => "one",
                    $(Self::$row => $name,)*
                    Self::Fixed(_) => "fixed",
                }
            }

            /// What the user can do when at most `fits` elements fit.
            pub fn cure(self, fits: u64) -> String {
                let cure = match self {
                    Self::One | Self::Fixed(_) => cures::NONE,
                    $(Self::$row => $cure,)*
                };
                cure.replace("{fits}", &fits.to_string()).replace("{name}", self.name())
            }
        }

        /// The most there may be of each domain; decides the size of every buffer.
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
        pub struct $capacity {
            $(#[doc = $doc] pub $field: u64,)*
            $(#[doc = $other_doc] pub $other: u64,)*
        }

        impl $capacity {
            /// Number of elements of a domain.
            pub fn count(&self, domain: $domain) -> u64 {
                match domain {
                    $domain::One => 1,
                    $($domain::$row => self.$field,)*
                    $domain::Fixed(count) => u64::from(count),
                }
            }
        }
    };
}

domains! { Domain, Capacity;
    Gaussians gaussians: "gaussians", cures::MODEL,
        "Rows of the model; visible splats are at most as many.";
    Trained trained: "trained", cures::MODEL,
        "Rows with optimiser state: the same as Gaussians, or 0 where nothing is trained.";
    Labelled labelled: "labelled", cures::MODEL,
        "Rows with labels: the same as Gaussians, or 0 in a scene without masks.";
    Instances instances: "instances", cures::PAIRS,
        "Pairs of splat and tile.";
    TrainedInstances trained_instances: "trained instances", cures::PAIRS,
        "Pairs with a gradient record: the same as Instances, or 0 where nothing is trained.";
    VirtualTiles virtual_tiles: "virtual tiles", cures::IMAGE,
        "Tiles of all layers: the scene and each sampled object.";
    LayerTiles layer_tiles: "layer tiles", cures::LAYERS,
        "Tiles of object layers that hold a splat.";
    LayerPixels layer_pixels: "layer pixels", cures::LAYERS,
        "Pixels of those tiles.";
    Pixels pixels: "pixels", cures::IMAGE,
        "Pixels of one image.";
    LabelledPixels labelled_pixels: "labelled pixels", cures::IMAGE,
        "Pixels with labels: the same as Pixels, or 0 in a scene without masks.";
    Labels labels: "labels", cures::LAYERS,
        "Label ids, 0 included.";
    VoteColumns vote_columns: "vote columns", cures::VOTES,
        "Labels that a sweep of votes counts at once.";
    VoteCells vote_cells: "vote cells", cures::VOTES,
        "Gaussians times these.";
    Layers layers: "layers", cures::LAYERS,
        "Layers, the scene included.";
    OccluderWords occluder_words: "occluder words", cures::LAYERS,
        "Words of occluder bits of all layers.";
    SortCells sort_cells: "sort cells", cures::PAIRS,
        "Cells of the histogram of the sort.";
    ScanLanes scan_lanes: "scan lanes", cures::PAIRS,
        "Lanes of the scan.";
    LossPartials loss_partials: "loss partials", cures::IMAGE,
        "Partial sums of the loss.";
    SegmentPixels segment_pixels: "segment pixels", cures::IMAGE,
        "Pixels of all jobs of the blend passes, or 0 while no tile's list is too long for one dispatch.";
    SharedRows shared_rows: "shared rows", cures::NONE,
        "Rows of four parameters that are no Gaussian's, or 0 in a training without any.";
    .. sort_lanes: "Lanes of the sort.";
    segments: "Dispatches that one walk of a tile's list may take.";
}

impl Capacity {
    /// The next capacity when `needed` elements did not fit into `current`: half as much again, and at least a tenth
    /// more than what was needed, so that a slowly growing need does not overflow at each step.
    pub fn grown(current: u64, needed: u64) -> u64 {
        let half_again = current.saturating_add(current / 2);
        let tenth_more = needed.saturating_add(needed.div_ceil(10));
        half_again.max(tenth_more)
    }
}

#[cfg(test)]
mod tests {
    /// A domain of another table: what a row says is all that there is to say.
    #[allow(unreachable_pub, reason = "the macro makes a public table")]
    mod shelves {
        use super::super::cures;

        domains! { Shelved, Shelves;
            Books books: "books", "sell all but {fits} {name}", "Books on all shelves.";
            .. ladders: "Nothing is sized by them.";
        }
    }
    use shelves::{Shelved, Shelves};

    #[test]
    fn a_domain_is_a_row_of_a_table() {
        let shelves = Shelves { books: 7, ladders: 2 };
        assert_eq!([Shelved::One, Shelved::Books, Shelved::Fixed(3)].map(|row| shelves.count(row)), [1, 7, 3]);
        assert_eq!(Shelved::Books.cure(5), "sell all but 5 books");
        assert_eq!(Shelved::Fixed(3).cure(5), "use another device");
        assert_eq!((Shelved::Books.name(), shelves.ladders), ("books", 2));
    }
}
