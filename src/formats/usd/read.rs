//! Reads USD.

use super::layer::{self, SplatPrim, is_true};
use super::text::{Scanner, Span};
use super::{
    CONFIDENCE_ATTRIBUTE, DEGREE_ATTRIBUTE, HARMONICS_ATTRIBUTE, OPACITIES_ATTRIBUTE, ORIENTATIONS_ATTRIBUTE,
    OWN_ANTIALIASED, OWN_DEGREE, OWN_EYE, OWN_LABEL, OWN_UP, POSITIONS_ATTRIBUTE, SCALES_ATTRIBUTE, SPLATS_SCHEMA,
    USD_AXES,
};
use crate::archive::Archive;
use crate::format::{FirstView, ReadModel};
use crate::ply::joined;
use crate::rows::{Row, Rows};
use crate::transform::Transform;
use crate::values::{log_scale, logit};
use glam::{DMat4, DVec3};
use labelgs_files::content::identify;
use labelgs_files::label_table::{LabelEntry, LabelTable, unique_name};
use labelgs_files::read as file;
use labelgs_scene::harmonics::coefficients;
use labelgs_scene::{Error, MODEL_LABEL_MAX, Result, UNLABELLED};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Default degree of a prim with harmonics.
const USUAL_DEGREE: u32 = 3;
/// Largest supported SH degree.
const DEGREE_MAX: u32 = 3;

/// Reads a text layer.
pub(super) fn read(path: &Path) -> Result<ReadModel> {
    model(path, None, &file::text(path)?)
}

/// Reads the first layer of a package.
pub(super) fn read_package(path: &Path) -> Result<ReadModel> {
    let bytes = file::bytes(path)?;
    let mut archive = Archive::open(path, &bytes, "USDZ")?;
    let is_layer =
        |name: &&str| [".usda", ".usd", ".usdc"].iter().any(|extension| name.to_lowercase().ends_with(extension));
    let Some(name) = archive.names().find(is_layer).map(str::to_owned) else {
        return Err(Error::data(path, "archive", "has no layer (.usda, .usd, .usdc); this is not a USDZ file"));
    };
    let mut layer = archive.file(&name)?;
    file::strip_byte_order_mark(path, &mut layer)?;
    let known = identify(&layer).filter(|content| !super::TEXT_FORMAT.contents.contains(&content.what));
    if let Some(content) = known {
        return Err(Error::data(path, &name, content.mismatch("a text layer")));
    }
    let text = String::from_utf8(layer)
        .map_err(|_| Error::data(path, &name, "is not UTF-8 text; save it as text first, for example with usdcat"))?;
    model(path, Some(&name), &text)
}

/// Reads the Gaussians in a layer.
fn model(path: &Path, entry: Option<&str>, text: &str) -> Result<ReadModel> {
    let mut scanner = Scanner::new(path, entry, text);
    let layer = layer::read(&mut scanner)?;
    let reader = Reader { path, scanner };
    if layer.parts.is_empty() {
        let notes: String = layer.notes.iter().map(|note| format!("; {note}")).collect();
        return Err(Error::data(path, entry.unwrap_or_default(), format!("no prim is a {SPLATS_SCHEMA}{notes}")));
    }
    let labels = reader.labels(&layer.parts)?;
    let (mut read, mut parts) = (ReadModel::default(), Vec::new());
    let mut names: BTreeMap<u32, String> = BTreeMap::new();
    for (part, label) in layer.parts.iter().zip(labels) {
        let found = reader.gaussians(part, label)?;
        parts.push(found.gaussians);
        read.dropped += found.dropped;
        read.notes.extend(found.notes);
        let title = if part.own.contains_key(OWN_LABEL) { part.title } else { part.semantic };
        let title = title.and_then(|title| reader.scanner.first_string(title)).filter(|title| !title.is_empty());
        if let (Some(label), Some(title)) = (label.filter(|&label| label != UNLABELLED), title) {
            names.entry(label).or_insert(title);
        }
    }
    let triple = |key: &str| reader.triple(*layer.own.get(key)?);
    read.first_view = triple(OWN_UP).zip(triple(OWN_EYE)).and_then(|(up, eye)| FirstView::checked(up, eye));
    read.notes.extend(layer.notes);
    read.notes.dedup();
    let mut taken = BTreeSet::new();
    let entry =
        |(id, name): (u32, String)| LabelEntry { name: Some(unique_name(name, &mut taken)), ..LabelEntry::new(id) };
    read.names = (!names.is_empty()).then(|| LabelTable::new(names.into_iter().map(entry).collect()));
    // A single mark applies to all prims.
    let antialiased = parts.iter().any(|part| part.antialiased);
    parts.iter_mut().for_each(|part| part.antialiased = antialiased);
    read.gaussians = joined(parts)?;
    Ok(read)
}

struct Reader<'a> {
    path: &'a Path,
    scanner: Scanner<'a>,
}

impl Reader<'_> {
    /// Returns three numbers in parentheses, or `None` for anything else.
    fn triple(&self, value: Span) -> Option<DVec3> {
        let inside = self.scanner.part(value).strip_prefix('(')?.strip_suffix(')')?;
        let numbers: Vec<f64> = inside.split(',').map(|word| word.trim().parse().ok()).collect::<Option<_>>()?;
        Some(DVec3::from_array(numbers.try_into().ok()?))
    }

    /// Returns the label of each prim: the stored id, or for other programs' files the next free id for each semantic
    /// label.
    fn labels(&self, parts: &[SplatPrim]) -> Result<Vec<Option<u32>>> {
        let own = |part: &SplatPrim| -> Result<Option<u32>> {
            let Some(&value) = part.own.get(OWN_LABEL) else { return Ok(None) };
            let label = self.scanner.part(value).parse().ok().filter(|&label| label <= MODEL_LABEL_MAX);
            label.map(Some).ok_or_else(|| {
                let problem = format!("the label is not a whole number from 0 to {MODEL_LABEL_MAX}; correct it");
                self.scanner.bad(value.start, problem)
            })
        };
        let mut labels = parts.iter().map(own).collect::<Result<Vec<_>>>()?;
        let known: BTreeSet<u32> = labels.iter().flatten().copied().collect();
        let mut free = (1..=MODEL_LABEL_MAX).filter(|label| !known.contains(label));
        let mut shown: BTreeMap<String, Option<u32>> = BTreeMap::new();
        for (label, part) in labels.iter_mut().zip(parts).filter(|(label, _)| label.is_none()) {
            let what = part.semantic.and_then(|value| self.scanner.first_string(value));
            *label = what.and_then(|what| *shown.entry(what).or_insert_with(|| free.next()));
        }
        Ok(labels)
    }

    /// Returns the numbers of an attribute, cut to `count` values of a width, or `None` if the prim does not have it.
    fn column(&self, part: &SplatPrim, name: &str, width: usize, count: usize) -> Result<Option<Vec<f32>>> {
        let Some(value) = attribute(part, name) else { return Ok(None) };
        let mut numbers: Vec<f32> = self.scanner.numbers(value)?;
        let wanted = width.saturating_mul(count);
        if numbers.len() < wanted {
            let problem = format!("{name} has {} numbers; {count} positions need {wanted}", numbers.len());
            return Err(self.scanner.bad(value.start, format!("{problem}; export the file again")));
        }
        numbers.truncate(wanted);
        Ok(Some(numbers))
    }

    /// Returns the degree of a prim's harmonics.
    fn degree(&self, part: &SplatPrim) -> Result<u32> {
        if attribute(part, HARMONICS_ATTRIBUTE).is_none() {
            return Ok(0);
        }
        let Some(&value) = part.attributes.get(DEGREE_ATTRIBUTE) else { return Ok(USUAL_DEGREE) };
        let degree = self.scanner.part(value).parse().ok().filter(|degree| (0..=DEGREE_MAX).contains(degree));
        degree.ok_or_else(|| {
            let problem =
                format!("has harmonics of degree {}; up to {DEGREE_MAX} is supported", self.scanner.part(value));
            self.scanner.bad(value.start, format!("{problem}; omit the higher degrees"))
        })
    }

    /// Returns the transformed Gaussians of a prim, with its label.
    fn gaussians(&self, part: &SplatPrim, label: Option<u32>) -> Result<ReadModel> {
        let Some(positions) = attribute(part, POSITIONS_ATTRIBUTE) else {
            let problem =
                format!("this {SPLATS_SCHEMA} has no static {POSITIONS_ATTRIBUTE}; export it without animation");
            return Err(self.scanner.bad(part.at, problem));
        };
        let means: Vec<f32> = self.scanner.numbers(positions)?;
        let (means, others) = means.as_chunks::<3>();
        if !others.is_empty() {
            return Err(self
                .scanner
                .bad(positions.start, format!("{POSITIONS_ATTRIBUTE} are not triples; export the file again")));
        }
        let count = means.len();
        let stored = self.degree(part)?;
        let of_all = 1 + coefficients(stored);
        let quats = self.column(part, ORIENTATIONS_ATTRIBUTE, 4, count)?;
        let scales = self.column(part, SCALES_ATTRIBUTE, 3, count)?;
        let opacities = self.column(part, OPACITIES_ATTRIBUTE, 1, count)?;
        let harmonics = self.column(part, HARMONICS_ATTRIBUTE, 3 * of_all, count)?;
        let shares = self.column(part, CONFIDENCE_ATTRIBUTE, 1, count)?.filter(|_| label.is_some());
        if let Some(share) = shares.iter().flatten().find(|share| !(0.0..=1.0).contains(*share)) {
            return Err(self
                .scanner
                .bad(part.at, format!("{CONFIDENCE_ATTRIBUTE} {share} is not from 0 to 1; correct it")));
        }
        // Drop the zeros that the writer added.
        let own = part.own.get(OWN_DEGREE).and_then(|&degree| self.scanner.part(degree).parse().ok());
        let degree = own.filter(|&own: &u32| own < stored).unwrap_or(stored);
        let mut rows = Rows::new(degree, label.is_some(), shares.is_some());
        for (index, &mean) in means.iter().enumerate() {
            let triples = harmonics.as_ref().map_or(&[][..], |all| all.as_chunks::<3>().0);
            let triples = triples.get(index * of_all..(index + 1) * of_all).unwrap_or_default();
            let mut rest: Vec<[f32; 3]> = triples.iter().skip(1).take(coefficients(degree)).copied().collect();
            USD_AXES.rest(&mut rest);
            let quat = quats.as_ref().map_or([1.0, 0.0, 0.0, 0.0], |all| [0, 1, 2, 3].map(|at| all[4 * index + at]));
            rows.push(&Row {
                position: USD_AXES.position(mean).map(f64::from),
                quat: USD_AXES.quat(quat).map(f64::from),
                scale: scales.as_ref().map_or([0.0; 3], |all| [0, 1, 2].map(|axis| log_scale(all[3 * index + axis]))),
                opacity: logit(opacities.as_ref().map_or(1.0, |all| all[index])),
                // Without a colour, the prim is grey.
                sh0: triples.first().copied().unwrap_or_default(),
                rest: &rest,
                label,
                confidence: shares.as_ref().map(|all| all[index]),
            });
        }
        self.placed(part, rows)
    }

    /// Applies a prim's transform to its rows.
    fn placed(&self, part: &SplatPrim, rows: Rows) -> Result<ReadModel> {
        let moved = part.matrix.w_axis.truncate();
        let is_only_moved = part.matrix == DMat4::from_translation(moved) && moved.as_vec3().is_finite();
        let origin = if is_only_moved { DVec3::from_array(USD_AXES.0.map(f64::from)) * moved } else { DVec3::ZERO };
        let mut read = rows.finish(self.path, Some(origin))?;
        if !is_only_moved {
            let place = Transform::from_matrix(part.matrix, USD_AXES).ok_or_else(|| {
                let problem = "is mirrored, sheared or scaled by different factors per axis, which is not supported; apply its \
                               transform in the program that wrote the file, and export it again";
                self.scanner.bad(part.at, problem)
            })?;
            read.gaussians = place.apply(&read.gaussians)?;
        }
        read.gaussians.antialiased =
            part.own.get(OWN_ANTIALIASED).is_some_and(|&mark| is_true(self.scanner.part(mark)));
        Ok(read)
    }
}

/// Returns an attribute of 32-bit floats, or the 16-bit one that replaces it.
fn attribute(part: &SplatPrim, name: &str) -> Option<Span> {
    part.attributes.get(name).or_else(|| part.attributes.get(format!("{name}h").as_str())).copied()
}
