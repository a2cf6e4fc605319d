//! The columns of a 3DGS PLY: which of them are read, and which are named because they would change the picture.

use crate::ply_table::Table;
use crate::rows::Rows;
use labelgs_scene::harmonics::coefficients;
use labelgs_scene::{Error, Result};
use std::collections::BTreeMap;
use std::path::Path;

/// Columns of every 3DGS PLY, in the order of decoding. Those of degree 0 may be colours instead.
const REQUIRED: [&str; 14] = [
    "x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", "opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2",
    "rot_3",
];
const COLOURS: [&str; 3] = ["red", "green", "blue"];
/// Prefixes that CloudCompare gives to columns.
const PREFIXES: [&str; 2] = ["scalar_", "scal_"];
/// The filter of Mip-Splatting: a size that every axis of a Gaussian is blurred by.
const FILTER: &str = "filter_3D";
/// Columns that do not change the picture: normals, colours for viewers of points, ids and features of objects.
/// One that ends in `_` stands for all that begin so.
const HARMLESS: [&str; 14] = [
    "nx",
    "ny",
    "nz",
    "normal_",
    "red",
    "green",
    "blue",
    "alpha",
    "label_confidence",
    "state",
    "id",
    "object_id",
    "obj_dc_",
    "semantic_",
];
/// Columns of other models than 3DGS, whose colours or sizes come from a network, and their name.
const FOREIGN: [(&str, &str); 2] =
    [("f_anchor_feat_0", "anchors of Scaffold-GS"), ("f_offset_0", "anchors of Scaffold-GS")];
/// Most columns that a note names.
const NAMED_MAX: usize = 8;

/// What the columns of a file are.
#[derive(Clone, Debug)]
pub(super) struct Columns {
    pub(super) sh_degree: u32,
    names: Vec<String>,
    /// Discs of 2DGS: there is no third axis.
    pub(super) flat: bool,
    /// The colours are red, green, blue, and 1 is this value.
    pub(super) full_colour: Option<f64>,
    /// Places of the columns that a file may have among those that are decoded.
    pub(super) filter: Option<usize>,
    pub(super) label: Option<usize>,
    pub(super) confidence: Option<usize>,
    pub(super) state: Option<usize>,
    notes: Vec<String>,
}

/// What becomes of discs.
const FLAT: &str = "the third axis is 1e-6 thick, and discs are drawn as such Gaussians";

impl Columns {
    /// Finds them in a header.
    pub(super) fn of(path: &Path, table: &Table) -> Result<Self> {
        let bad = |problem: String| Err(Error::data(path, "header", problem));
        let mut by_name: BTreeMap<&str, &str> = BTreeMap::new();
        for stored in table.names() {
            let name = PREFIXES.iter().fold(stored, |name, prefix| name.strip_prefix(prefix).unwrap_or(name));
            // A column without a prefix wins.
            if name == stored || !by_name.contains_key(name) {
                by_name.insert(name, stored);
            }
        }
        let has = |name: &str| by_name.contains_key(name);
        let coloured = !has("f_dc_0") && COLOURS.into_iter().all(has);
        if coloured && !has("rot_0") {
            return bad(
                "holds coloured points, not Gaussians: it has `red` and no `f_dc_0`; train on them first".into()
            );
        }
        if let Some((_, what)) = FOREIGN.into_iter().find(|(name, _)| has(name) && !has("f_dc_0")) {
            return bad(format!(
                "holds {what}, not Gaussians; export the Gaussians of its network as a 3DGS PLY first"
            ));
        }
        let (stored, kept) = degrees(path, &by_name)?;
        let flat = has("scale_1") && !has("scale_2");
        let mut wanted: Vec<String> = REQUIRED.map(String::from).to_vec();
        if coloured {
            wanted[3..6].clone_from_slice(&COLOURS.map(String::from));
        }
        if flat {
            // The value is not used.
            wanted[9] = "scale_1".into();
        }
        let (all, rest) = (coefficients(stored), coefficients(kept));
        wanted.extend((0..3 * rest).map(|index| format!("f_rest_{}", index / rest * all + index % rest)));
        let mut place = |name: &str, is_used: bool| {
            (is_used && has(name)).then(|| {
                wanted.push(name.to_owned());
                wanted.len() - 1
            })
        };
        let (filter, label) = (place(FILTER, true), place("label", true));
        let (confidence, state) = (place("label_confidence", label.is_some()), place("state", label.is_none()));
        let missing: Vec<&str> = wanted.iter().map(String::as_str).filter(|name| !has(name)).collect();
        if !missing.is_empty() {
            let lacks = missing.join(" ");
            return bad(format!("`vertex` lacks the properties {lacks}; export it from its trainer as a 3DGS PLY"));
        }
        let mut notes = Vec::new();
        if filter.is_some() {
            notes.push(format!(
                "the column `{FILTER}` of Mip-Splatting was applied to sizes and opacities, as in its fused export"
            ));
        }
        if flat {
            notes.push(format!("has no `scale_2`, as 2DGS: {FLAT}"));
        }
        if stored > kept {
            notes.push("harmonics of degree 4 were left out; labelgs has 3 degrees".into());
        }
        notes.extend(unknown(by_name.keys().copied().filter(|name| !wanted.iter().any(|own| own == name))));
        let full_colour = coloured.then(|| table.integer_max(by_name["red"]).unwrap_or(1.0));
        let names = wanted.iter().map(|name| by_name[name.as_str()].to_owned()).collect();
        Ok(Self { sh_degree: kept, names, flat, full_colour, filter, label, confidence, state, notes })
    }

    /// Their names in the file, in the order of decoding.
    pub(super) fn names(&self) -> Vec<&str> {
        self.names.iter().map(String::as_str).collect()
    }

    /// What the user should know of them.
    pub(super) fn notes(&self) -> impl Iterator<Item = String> {
        self.notes.iter().cloned()
    }

    /// Returns true if rows have labels.
    pub(super) fn have_labels(&self) -> bool {
        self.label.or(self.state).is_some()
    }

    /// Returns an empty list for the rows.
    pub(super) fn rows(&self) -> Rows {
        Rows::new(self.sh_degree, self.have_labels(), self.confidence.is_some())
    }
}

/// Returns the degree for the number of `f_rest_*` columns, and the one that is kept.
fn degrees(path: &Path, by_name: &BTreeMap<&str, &str>) -> Result<(u32, u32)> {
    let count = by_name.keys().filter(|name| name.starts_with("f_rest_")).count();
    match (0..=4).find(|&degree| 3 * coefficients(degree) == count) {
        Some(degree) => Ok((degree, degree.min(3))),
        None => {
            let problem = format!(
                "{count} `f_rest_` properties; 0, 9, 24, 45 or 72 (SH degree 0 to 4) are read; export it with all \
                 coefficients of a degree, or without any"
            );
            Err(Error::data(path, "header", problem))
        }
    }
}

/// Returns a note on columns that are not read and may change the picture. Numbered ones count as one.
fn unknown<'a>(names: impl Iterator<Item = &'a str>) -> Option<String> {
    let is_harmless =
        |name: &str| HARMLESS.iter().any(|own| name == *own || own.ends_with('_') && name.starts_with(own));
    let mut kinds: Vec<String> = Vec::new();
    for name in names.filter(|name| !is_harmless(name) && !name.starts_with("f_rest_")) {
        let stem = name.trim_end_matches(|c: char| c.is_ascii_digit());
        let kind = if stem.len() < name.len() && stem.ends_with('_') { format!("{stem}*") } else { name.to_owned() };
        if !kinds.contains(&kind) {
            kinds.push(kind);
        }
    }
    let more = kinds.len().saturating_sub(NAMED_MAX);
    kinds.truncate(NAMED_MAX);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    (!kinds.is_empty()).then(|| {
        format!(
            "the columns {}{more} were not read; if its trainer draws with them, pictures differ: export a plain 3DGS PLY there",
            kinds.join(", ")
        )
    })
}
