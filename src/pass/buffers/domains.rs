//! Domains (what the elements of buffers stand for) and capacities (their maximum numbers), in one table.

use crate::scheduler::plan::{Count, Domain};

/// Advice by the cause of a domain's size, given the number that fits and the domain's name.
pub(super) mod cures {
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

    /// Advice if all buffers together do not fit.
    pub(in crate::pass::buffers) fn whole() -> String {
        format!("lower {}, use smaller images or use another device", Setting("max_gaussians"))
    }

    pub(super) fn none(_: u64, _: &str) -> String {
        "use another device".to_owned()
    }
}

/// Declares the domains, and the capacities that count them.
///
/// Each row is `DOMAIN field: "name", cure, "doc";`, ending in `optional` if plans omit it when it is empty. The rows
/// after `..` are capacities without a buffer.
macro_rules! domains {
    ($($row:ident $field:ident: $name:literal, $cure:expr, $doc:literal $(, $optional:ident)?;)*
        .. $($other:ident: $other_doc:literal;)*) => {
        #[allow(non_camel_case_types, clippy::upper_case_acronyms)]
        enum Index { $($row),* }

        impl Domain {
            $(#[doc = $doc] pub const $row: Self = Self {
                count: Count::At(Index::$row as usize),
                cure: |fits| $cure(fits, $name),
                is_optional: !stringify!($($optional)?).is_empty(),
            };)*
        }

        /// Maximum number of each domain; decides the size of every buffer.
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
        pub struct Capacity {
            $(#[doc = $doc] pub $field: u64,)*
            $(#[doc = $other_doc] pub $other: u64,)*
        }

        impl Capacity {
            /// The numbers of elements, for plans.
            pub fn counts(&self) -> Vec<u64> {
                vec![$(self.$field),*]
            }
        }
    };
}

domains! {
    GAUSSIANS gaussians: "gaussians", cures::model,
        "Rows of the model; also the maximum number of visible splats.";
    TRAINED trained: "trained", cures::model,
        "Rows with optimiser state: Gaussians without the frozen ones at the end, or 0 without training.";
    SECOND_MOMENTS second_moments: "second moments", cures::model,
        "Rows with separate second moments: equal to Trained, or 0 if packed with the first moments.", optional;
    LABELLED labelled: "labelled", cures::model,
        "Rows with labels: equal to Gaussians, or 0 in a scene without masks.";
    INSTANCES instances: "instances", cures::pairs,
        "(splat, tile) pairs.";
    KEY_WORDS key_words: "instances", cures::pairs,
        "Words of the pairs' keys: equal to Instances, or half of them with 16-bit keys.";
    TRAINED_INSTANCES trained_instances: "trained instances", cures::pairs,
        "Pairs with a gradient record: equal to Instances, or 0 without training.";
    VIRTUAL_TILES virtual_tiles: "virtual tiles", cures::image,
        "Tiles of all layers: the scene and each sampled object.";
    LAYER_TILES layer_tiles: "layer tiles", cures::layers,
        "Tiles of object layers with at least one splat.";
    LAYER_PIXELS layer_pixels: "layer pixels", cures::layers,
        "Pixels of the layer tiles.";
    PIXELS pixels: "pixels", cures::image,
        "Pixels of one image.";
    LABELLED_PIXELS labelled_pixels: "labelled pixels", cures::image,
        "Pixels with labels: equal to Pixels, or 0 in a scene without masks.";
    LABELLED_TILES labelled_tiles: "labelled tiles", cures::image,
        "Tiles of one image, or 0 in a scene without masks.";
    KNOWN_DEPTHS known_depths: "known depths", cures::image,
        "Pixels with a known depth: equal to Pixels, or 0 in a training without known depths.";
    LABEL_TABLES label_tables: "label tables", cures::image,
        "Tiles times walks for the label map, or 0 in a scene without masks.";
    LABELS labels: "labels", cures::layers,
        "Label ids, including 0.";
    VOTE_COLUMNS vote_columns: "vote columns", cures::votes,
        "Labels that one vote sweep counts.";
    VOTE_CELLS vote_cells: "vote cells", cures::votes,
        "Gaussians times vote columns.";
    LAYERS layers: "layers", cures::layers,
        "Layers, including the scene.";
    OCCLUDER_WORDS occluder_words: "occluder words", cures::layers,
        "Words of occluder bits of all layers.";
    SORT_CELLS sort_cells: "sort cells", cures::pairs,
        "Cells of the sort histogram.";
    SORT_TOTALS sort_totals: "sort totals", cures::pairs,
        "Cells of the sort totals.";
    SCAN_LANES scan_lanes: "scan lanes", cures::pairs,
        "Lanes of the scan.";
    LOOK_CELLS look_cells: "look cells", cures::pairs,
        "Words of passes that look back, or 0 without such passes.", optional;
    LOSS_PARTIALS loss_partials: "loss partials", cures::image,
        "Partial sums of the loss.";
    SEGMENT_PIXELS segment_pixels: "segment pixels", cures::image,
        "Pixels of all blend jobs, or 0 while one dispatch can process each tile's list.";
    CHUNKS chunks: "chunks", cures::pairs,
        "List chunks of the backward blend, or 0 if it processes whole tiles.", optional;
    CHUNK_PIXELS chunk_pixels: "chunk pixels", cures::pairs,
        "Pixels between two chunks of a list, or 0 if it processes whole tiles.", optional;
    CHUNK_CHANNELS chunk_channels: "chunk channels", cures::pairs,
        "Pixels of all chunks of the scene's lists, or 0 in a training without labels and known depths.", optional;
    LATE_GAUSSIANS late_gaussians: "late gaussians", cures::model,
        "Trained Gaussians that may miss updates: all, or 0 if each step updates all of them.", optional;
    MISSED_ROWS missed_rows: "missed rows", cures::none,
        "Rows of the table of missed updates.", optional;
    SHARED_ROWS shared_rows: "shared rows", cures::none,
        "Rows of four shared parameters, or 0 without shared parameters.", optional;
    .. sort_lanes: "Lanes of the sort.";
    sweep_cells: "Words of sorts that look back, or 0 without such sorts; the first of `look_cells`.";
    segments: "Maximum number of dispatches for one walk of a tile's list.";
}

impl Domain {
    /// Returns true if the domain's elements are rows of trained Gaussians.
    pub(crate) fn is_trained(&self) -> bool {
        [Self::TRAINED.count, Self::SECOND_MOMENTS.count].contains(&self.count)
    }
}

impl Capacity {
    /// Returns the tiles of the scene, without object layers.
    pub fn tiles(&self) -> u64 {
        self.virtual_tiles / self.layers.max(1)
    }

    /// Returns true if first and second moments are packed (glsl/include/moments_store.glsl).
    pub fn packs_moments(&self) -> bool {
        self.second_moments < self.trained
    }

    /// Returns the next capacity after `needed` elements did not fit into `current`: 1.5 times `current`, or twice on a
    /// GPU, where growth costs more steps. It is at least 1.1 times `needed`, so that slow growth does not overflow at
    /// every step.
    pub fn grown(current: u64, needed: u64, on_card: bool) -> u64 {
        let more = current.saturating_add(if on_card { current } else { current / 2 });
        let tenth_more = needed.saturating_add(needed.div_ceil(10));
        more.max(tenth_more)
    }
}

#[cfg(test)]
mod tests {
    use super::{Capacity, Count, Domain};

    #[test]
    fn a_domain_finds_its_number_among_the_counts() {
        let capacity = Capacity { gaussians: 7, layer_tiles: 5, shared_rows: 3, ..Capacity::default() };
        let counts = capacity.counts();
        for (domain, expected) in [(Domain::GAUSSIANS, 7), (Domain::LAYER_TILES, 5), (Domain::SHARED_ROWS, 3)] {
            assert!(matches!(domain.count, Count::At(place) if counts[place] == expected), "{domain:?} in {counts:?}");
        }
        const { assert!(Domain::SHARED_ROWS.is_optional && !Domain::GAUSSIANS.is_optional) };
        assert_eq!((Domain::LAYERS.cure)(5), "at most 5 layers fit; lower `label_samples` or use another device");
    }
}
