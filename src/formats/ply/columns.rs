//! The columns of a 3DGS PLY: which ones are read, and which ones get a note because they would change renders.

use crate::ply_table::Table;
use crate::rows::Rows;
use labelgs_scene::harmonics::coefficients;
use labelgs_scene::{Error, Result};
use std::collections::BTreeMap;
use std::path::Path;

/// Columns of every 3DGS PLY in decoding order. The degree-0 coefficients may be colours instead.
const REQUIRED_COLUMNS: [&str; 14] = [
    "x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", "opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2",
    "rot_3",
];
const COLOUR_COLUMNS: [&str; 3] = ["red", "green", "blue"];
/// Prefixes that CloudCompare adds to columns.
const CLOUDCOMPARE_PREFIXES: [&str; 2] = ["scalar_", "scal_"];
/// The filter of Mip-Splatting: a size that blurs every axis of a Gaussian.
const FILTER_COLUMN: &str = "filter_3D";
/// Columns that do not change renders: normals, point colours for viewers, object ids and features. A name that ends in
/// `_` stands for all names that start with it.
const HARMLESS_COLUMNS: [&str; 14] = [
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
/// Columns of models other than 3DGS, whose colours or sizes come from a network, with the model's name.
const FOREIGN_COLUMNS: [(&str, &str); 2] =
    [("f_anchor_feat_0", "anchors of Scaffold-GS"), ("f_offset_0", "anchors of Scaffold-GS")];
/// Most columns listed in a note.
const LISTED_MAX: usize = 8;

/// The columns of a file.
#[derive(Clone, Debug)]
pub(super) struct Columns {
    pub(super) sh_degree: u32,
    names: Vec<String>,
    /// 2DGS discs: the third axis is missing.
    pub(super) flat: bool,
    /// Colours are stored as red, green, blue; this value means 1.
    pub(super) full_colour: Option<f64>,
    /// Indices of optional columns among the decoded ones.
    pub(super) filter: Option<usize>,
    pub(super) label: Option<usize>,
    pub(super) confidence: Option<usize>,
    pub(super) state: Option<usize>,
    notes: Vec<String>,
}

/// How discs are read.
const DISC_NOTE: &str = "the third axis is 1e-6 thick, and discs are drawn as such Gaussians";

impl Columns {
    /// Finds the columns in a header.
    pub(super) fn find(path: &Path, table: &Table) -> Result<Self> {
        let bad = |problem: String| Err(Error::data(path, "header", problem));
        let mut by_name: BTreeMap<&str, &str> = BTreeMap::new();
        for stored in table.names() {
            let name =
                CLOUDCOMPARE_PREFIXES.iter().fold(stored, |name, prefix| name.strip_prefix(prefix).unwrap_or(name));
            // A column without a prefix takes precedence.
            if name == stored || !by_name.contains_key(name) {
                by_name.insert(name, stored);
            }
        }
        let has = |name: &str| by_name.contains_key(name);
        let coloured = !has("f_dc_0") && COLOUR_COLUMNS.into_iter().all(has);
        if coloured && !has("rot_0") {
            return bad(
                "holds coloured points, not Gaussians: it has `red` and no `f_dc_0`; train on them first".into()
            );
        }
        if let Some((_, what)) = FOREIGN_COLUMNS.into_iter().find(|(name, _)| has(name) && !has("f_dc_0")) {
            return bad(format!(
                "holds {what}, not Gaussians; export the Gaussians of its network as a 3DGS PLY first"
            ));
        }
        let (stored, kept) = degrees(path, &by_name)?;
        let flat = has("scale_1") && !has("scale_2");
        let mut wanted: Vec<String> = REQUIRED_COLUMNS.map(String::from).to_vec();
        if coloured {
            wanted[3..6].clone_from_slice(&COLOUR_COLUMNS.map(String::from));
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
        let (filter, label) = (place(FILTER_COLUMN, true), place("label", true));
        let (confidence, state) = (place("label_confidence", label.is_some()), place("state", label.is_none()));
        let missing: Vec<&str> = wanted.iter().map(String::as_str).filter(|name| !has(name)).collect();
        if !missing.is_empty() {
            let lacks = missing.join(" ");
            return bad(format!("`vertex` lacks the properties {lacks}; export it from its trainer as a 3DGS PLY"));
        }
        let mut notes = Vec::new();
        if filter.is_some() {
            let applied = "was applied to sizes and opacities, as in its fused export";
            notes.push(format!("the column `{FILTER_COLUMN}` of Mip-Splatting {applied}"));
        }
        if flat {
            notes.push(format!("has no `scale_2`, as 2DGS: {DISC_NOTE}"));
        }
        if stored > kept {
            notes.push("harmonics of degree 4 were omitted; labelgs supports up to degree 3".into());
        }
        notes.extend(unknown(by_name.keys().copied().filter(|name| !wanted.iter().any(|own| own == name))));
        let full_colour = coloured.then(|| table.integer_max(by_name["red"]).unwrap_or(1.0));
        let names = wanted.iter().map(|name| by_name[name.as_str()].to_owned()).collect();
        Ok(Self { sh_degree: kept, names, flat, full_colour, filter, label, confidence, state, notes })
    }

    /// Returns the names of the columns in the file, in decoding order.
    pub(super) fn names(&self) -> Vec<&str> {
        self.names.iter().map(String::as_str).collect()
    }

    /// Returns notes for the user about the columns.
    pub(super) fn notes(&self) -> impl Iterator<Item = String> {
        self.notes.iter().cloned()
    }

    /// Returns true if rows have labels.
    pub(super) fn have_labels(&self) -> bool {
        self.label.or(self.state).is_some()
    }

    /// Creates an empty list for the rows.
    pub(super) fn rows(&self) -> Rows {
        Rows::new(self.sh_degree, self.have_labels(), self.confidence.is_some())
    }
}

/// Returns the SH degree for the number of `f_rest_*` columns, and the degree that is kept.
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

/// Returns a note on unread columns that may change renders. Numbered columns count as one.
fn unknown<'a>(names: impl Iterator<Item = &'a str>) -> Option<String> {
    let is_harmless =
        |name: &str| HARMLESS_COLUMNS.iter().any(|own| name == *own || own.ends_with('_') && name.starts_with(own));
    let mut kinds: Vec<String> = Vec::new();
    for name in names.filter(|name| !is_harmless(name) && !name.starts_with("f_rest_")) {
        let stem = name.trim_end_matches(|c: char| c.is_ascii_digit());
        let kind = if stem.len() < name.len() && stem.ends_with('_') { format!("{stem}*") } else { name.to_owned() };
        if !kinds.contains(&kind) {
            kinds.push(kind);
        }
    }
    let more = kinds.len().saturating_sub(LISTED_MAX);
    kinds.truncate(LISTED_MAX);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    (!kinds.is_empty()).then(|| {
        format!(
            "the columns {}{more} were not read; if the trainer renders with them, export a plain 3DGS PLY from it",
            kinds.join(", ")
        )
    })
}
