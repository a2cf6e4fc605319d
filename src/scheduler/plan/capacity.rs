//! Domains (the things that buffers count) and capacities (their maximum numbers): one table, with a row per domain.

/// Cures by the cause of a domain's size, given the number that fits and the domain's name.
mod cures {
    use crate::error::Setting;

    fn at_most(fits: u64, name: &str, settings: &[&'static str]) -> String {
        let settings: Vec<String> = settings.iter().map(|&field| Setting(field).to_string()).collect();
        let others = if settings.len() > 1 { "," } else { "" };
        format!("at most {fits} {name} fit; lower {}{others} or use another device", settings.join(" or "))
    }

    pub(super) fn model(fits: u64, _: &str) -> String {
        format!("lower {} to {fits} or use another device", Setting("max_gaussians"))
    }

    pub(super) fn votes(fits: u64, name: &str) -> String {
        at_most(fits, name, &["max_gaussians"])
    }

    pub(super) fn pairs(fits: u64, name: &str) -> String {
        at_most(fits, name, &["max_gaussians", "max_resolution"])
    }

    pub(super) fn image(fits: u64, name: &str) -> String {
        at_most(fits, name, &["max_resolution"])
    }

    pub(super) fn layers(fits: u64, name: &str) -> String {
        at_most(fits, name, &["label_samples"])
    }

    pub(super) fn none(_: u64, _: &str) -> String {
        "use another device".to_owned()
    }
}

/// Declares a table of domains and the capacities that count them.
///
/// Each row is `Variant field: "name", cure, "doc";`. The rows after `..` are capacities without a buffer.
macro_rules! domains {
    ($domain:ident, $capacity:ident;
        $($row:ident $field:ident: $name:literal, $cure:expr, $doc:literal;)*
        .. $($other:ident: $other_doc:literal;)*) => {
        /// Things that the elements of a buffer stand for.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum $domain {
            /// A single element.
            One,
            $(#[doc = $doc] $row,)*
            /// A fixed number, independent of the capacity.
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

            /// Advice to the user if at most `fits` elements fit.
            pub fn cure(self, fits: u64) -> String {
                match self {
                    Self::One | Self::Fixed(_) => cures::none(fits, self.name()),
                    $(Self::$row => $cure(fits, self.name()),)*
                }
            }
        }

        /// Maximum number of each domain; decides the size of every buffer.
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
    Gaussians gaussians: "gaussians", cures::model,
        "Rows of the model; also the maximum number of visible splats.";
    Trained trained: "trained", cures::model,
        "Rows with optimiser state: Gaussians without the frozen ones at the end, or 0 without training.";
    Labelled labelled: "labelled", cures::model,
        "Rows with labels: equal to Gaussians, or 0 in a scene without masks.";
    Instances instances: "instances", cures::pairs,
        "(splat, tile) pairs.";
    TrainedInstances trained_instances: "trained instances", cures::pairs,
        "Pairs with a gradient record: equal to Instances, or 0 without training.";
    VirtualTiles virtual_tiles: "virtual tiles", cures::image,
        "Tiles of all layers: the scene and each sampled object.";
    LayerTiles layer_tiles: "layer tiles", cures::layers,
        "Tiles of object layers with at least one splat.";
    LayerPixels layer_pixels: "layer pixels", cures::layers,
        "Pixels of the layer tiles.";
    Pixels pixels: "pixels", cures::image,
        "Pixels of one image.";
    LabelledPixels labelled_pixels: "labelled pixels", cures::image,
        "Pixels with labels: equal to Pixels, or 0 in a scene without masks.";
    LabelledTiles labelled_tiles: "labelled tiles", cures::image,
        "Tiles of one image, or 0 in a scene without masks.";
    KnownDepths known_depths: "known depths", cures::image,
        "Pixels with room for a known depth: equal to Pixels, or 0 in a training without them.";
    LabelTables label_tables: "label tables", cures::image,
        "Tiles times walks for the label map, or 0 in a scene without masks.";
    Labels labels: "labels", cures::layers,
        "Label ids, including 0.";
    VoteColumns vote_columns: "vote columns", cures::votes,
        "Labels that a sweep of votes counts at once.";
    VoteCells vote_cells: "vote cells", cures::votes,
        "Gaussians times vote columns.";
    Layers layers: "layers", cures::layers,
        "Layers, including the scene.";
    OccluderWords occluder_words: "occluder words", cures::layers,
        "Words of occluder bits of all layers.";
    SortCells sort_cells: "sort cells", cures::pairs,
        "Cells of the histogram of the sort.";
    SortTotals sort_totals: "sort totals", cures::pairs,
        "Cells of the totals of the sort.";
    ScanLanes scan_lanes: "scan lanes", cures::pairs,
        "Lanes of the scan.";
    LossPartials loss_partials: "loss partials", cures::image,
        "Partial sums of the loss.";
    SegmentPixels segment_pixels: "segment pixels", cures::image,
        "Pixels of all jobs of the blend passes, or 0 while one dispatch can walk each tile's list.";
    SharedRows shared_rows: "shared rows", cures::none,
        "Rows of four shared parameters, or 0 without any.";
    .. sort_lanes: "Lanes of the sort.";
    segments: "Maximum number of dispatches for one walk of a tile's list.";
}

impl Capacity {
    /// Returns the next capacity after `needed` elements did not fit into `current`: 1.5 times `current`, and at least
    /// 1.1 times `needed`, so that slow growth does not overflow at every step.
    pub fn grown(current: u64, needed: u64) -> u64 {
        let half_again = current.saturating_add(current / 2);
        let tenth_more = needed.saturating_add(needed.div_ceil(10));
        half_again.max(tenth_more)
    }
}

#[cfg(test)]
mod tests {
    /// A domain of another table, to show that a row is complete.
    #[allow(unreachable_pub, reason = "the macro makes a public table")]
    mod shelves {
        use super::super::cures;

        domains! { Shelved, Shelves;
            Books books: "books", |fits, name| format!("sell all but {fits} {name}"), "Books on all shelves.";
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
