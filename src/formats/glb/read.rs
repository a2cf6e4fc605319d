//! Reads GLB.

use super::nodes::{self, PlacedPrimitive};
use super::{
    ANTIALIASED_KEY, CONFIDENCE_ATTRIBUTE, EYE_KEY, FEATURE_ATTRIBUTE, FEATURE_MAX, FEATURES_EXTENSION,
    FLOAT_COMPONENT, GLTF_AXES, METADATA_EXTENSION, OPACITY_ATTRIBUTE, ROTATION_ATTRIBUTE, SCALE_ATTRIBUTE,
    SPLATS_EXTENSION, UP_KEY, file, harmonic, harmonics,
};
use crate::format::{FirstView, ReadModel};
use crate::ply::joined;
use crate::rows::{Row, Rows};
use crate::transform::Transform;
use crate::values::{log_scale, logit};
use glam::DVec3;
use labelgs_files::label_table::{LabelEntry, LabelTable};
use labelgs_files::read as bytes_of;
use labelgs_scene::MODEL_LABEL_MAX;
use labelgs_scene::{Error, Result};
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

struct Glb<'a> {
    path: &'a Path,
    root: Value,
    binary: &'a [u8],
}

/// The values of an accessor, row by row.
struct Column {
    values: Vec<f32>,
    width: usize,
}

impl Column {
    fn row<const N: usize>(&self, index: usize) -> [f32; N] {
        std::array::from_fn(|at| self.values[index * self.width + at])
    }
}

/// Reads all primitives with Gaussians and applies the transforms of their nodes.
pub(super) fn read(path: &Path) -> Result<ReadModel> {
    let bytes = bytes_of::bytes(path)?;
    let (root, binary) = file::split(path, &bytes)?;
    let glb = Glb { path, root, binary };
    let placed = nodes::place_primitives(&glb.root).map_err(|node| {
        let problem = "mirrors, shears or scales the axes by different factors, which is not supported; apply its \
                       transform in the program that wrote the file, and export it again";
        glb.bad(&format!("node {node}"), problem)
    })?;
    if placed.is_empty() {
        return Err(
            glb.bad("meshes", format!("no primitive has the extension {SPLATS_EXTENSION}; this file has no Gaussians"))
        );
    }
    let (mut read, mut parts) = (ReadModel::default(), Vec::new());
    let mut names: BTreeMap<u32, LabelEntry> = BTreeMap::new();
    for PlacedPrimitive { primitive, place } in &placed {
        let splats = &primitive["extensions"][SPLATS_EXTENSION];
        if let Some(packed) = splats["extensions"].as_object().and_then(|inner| inner.keys().next()) {
            let problem =
                format!("the Gaussians are compressed by {packed}, which is not supported; export again without");
            return Err(glb.bad("meshes", problem));
        }
        let part = glb.gaussians(primitive)?;
        let is_moved = *place != Transform::default();
        let view = part.first_view.map(|view| if is_moved { view.moved(place) } else { view });
        read.first_view = read.first_view.or(view);
        parts.push(if is_moved { place.apply(&part.gaussians)? } else { part.gaussians });
        for entry in part.names.into_iter().flat_map(|table| table.labels) {
            names.entry(entry.id).or_insert(entry);
        }
        read.dropped += part.dropped;
        read.notes.extend(part.notes);
        read.notes.extend(unread(splats));
    }
    read.notes.extend(glb.unread());
    read.notes.dedup();
    read.names = (!names.is_empty()).then(|| LabelTable::new(names.into_values().collect()));
    read.gaussians = joined(parts)?;
    Ok(read)
}

/// Lists unsupported features that change how a primitive looks.
fn unread(splats: &Value) -> Vec<String> {
    let mut notes = Vec::new();
    if splats["colorSpace"] == "lin_rec709_display" {
        notes.push("its colours are linear but were read as sRGB: renders are too dark".into());
    }
    for (key, usual) in [("kernel", "ellipse"), ("projection", "perspective")] {
        if let Some(other) = splats[key].as_str().filter(|&other| other != usual) {
            notes.push(format!("its {key} is {other}, but it is drawn as {usual}"));
        }
    }
    notes
}

impl Glb<'_> {
    /// Lists unsupported features that change how the whole file looks.
    fn unread(&self) -> Vec<String> {
        let some = |key: &str| self.root[key].as_array().is_some_and(|all| !all.is_empty());
        let instanced = |node: &Value| node["extensions"]["EXT_mesh_gpu_instancing"].is_object();
        let primitives = |mesh: &Value| mesh["primitives"].as_array().cloned().unwrap_or_default();
        let all = self.root["meshes"].as_array().into_iter().flatten().flat_map(primitives);
        let others = all.filter(|primitive| !primitive["extensions"][SPLATS_EXTENSION].is_object()).count();
        let meshes = format!("{others} meshes without Gaussians");
        let left_out = [
            (others > 0, meshes.as_str()),
            (some("animations"), "animations"),
            (
                self.root["nodes"].as_array().is_some_and(|nodes| nodes.iter().any(instanced)),
                "copies of instanced nodes",
            ),
        ];
        left_out.iter().filter(|(there, _)| *there).map(|(_, what)| format!("its {what} were omitted")).collect()
    }

    fn bad(&self, place: &str, problem: impl Into<String>) -> Error {
        Error::data(self.path, place, problem)
    }

    fn gaussians(&self, primitive: &Value) -> Result<ReadModel> {
        let attribute = |name: &str, width: usize| self.attribute(primitive, name, width);
        let needed = |name: &str, width: usize| {
            let problem = || self.bad("attributes", format!("lacks {name}, which {SPLATS_EXTENSION} requires"));
            attribute(name, width)?.ok_or_else(problem)
        };
        let (means, quats) = (needed("POSITION", 3)?, needed(ROTATION_ATTRIBUTE, 4)?);
        let (scales, opacities, sh0) =
            (needed(SCALE_ATTRIBUTE, 3)?, needed(OPACITY_ATTRIBUTE, 1)?, needed(&harmonic(0, 0), 3)?);
        let has = |degree: u32| harmonics(degree).all(|name| primitive["attributes"].get(name).is_some());
        let degree = (0..=3).rev().find(|&degree| has(degree)).unwrap_or_default();
        let rest = harmonics(degree).map(|name| needed(&name, 3)).collect::<Result<Vec<_>>>()?;
        let count = means.values.len() / 3;
        let labels = self.labels(primitive, count)?;
        let shares = attribute(CONFIDENCE_ATTRIBUTE, 1)?.filter(|_| labels.is_some());
        let columns = [&quats, &scales, &opacities, &sh0].into_iter().chain(&rest).chain(&shares);
        if columns.into_iter().any(|column| column.values.len() != count * column.width) {
            return Err(self.bad("attributes", format!("differ in length; expected {count} of each, as of POSITION")));
        }
        let odd = shares.iter().flat_map(|column| &column.values).position(|share| !(0.0..=1.0).contains(share));
        if let Some(index) = odd {
            return Err(self.bad(
                &format!("{CONFIDENCE_ATTRIBUTE} {index}"),
                "is not from 0 to 1; correct it or leave out the attribute",
            ));
        }
        let mut rows = Rows::new(degree, labels.is_some(), shares.is_some());
        let mut triples = vec![[0.0; 3]; rest.len()];
        for index in 0..count {
            triples.iter_mut().zip(&rest).for_each(|(triple, column)| *triple = column.row(index));
            GLTF_AXES.rest(&mut triples);
            let [x, y, z, w] = quats.row(index);
            let [opacity] = opacities.row(index);
            rows.push(&Row {
                position: GLTF_AXES.position(means.row(index)).map(f64::from),
                quat: GLTF_AXES.quat([w, x, y, z]).map(f64::from),
                scale: scales.row(index).map(log_scale),
                opacity: logit(opacity),
                sh0: sh0.row(index),
                rest: &triples,
                label: labels.as_ref().map(|found| found.0[index]),
                confidence: shares.as_ref().map(|column| column.values[index]),
            });
        }
        let mut read = rows.finish(self.path, None)?;
        read.gaussians.antialiased = primitive["extras"][ANTIALIASED_KEY] == true;
        let extra = |key: &str| {
            let numbers = primitive["extras"][key].as_array()?.iter().map(Value::as_f64).collect::<Option<Vec<f64>>>();
            numbers?.try_into().ok().map(DVec3::from_array)
        };
        let first_view = extra(UP_KEY).zip(extra(EYE_KEY)).and_then(|(up, eye)| FirstView::checked(up, eye));
        Ok(ReadModel { names: labels.and_then(|found| found.1), first_view, ..read })
    }

    /// Returns an attribute as floats, if the primitive has it.
    fn attribute(&self, primitive: &Value, name: &str, width: usize) -> Result<Option<Column>> {
        let Some(at) = primitive["attributes"].get(name) else { return Ok(None) };
        let index = at.as_u64().unwrap_or(u64::MAX);
        let place = format!("accessor {index} of {name}");
        let accessor = usize::try_from(index).ok().and_then(|at| self.root["accessors"].get(at));
        let Some(accessor) = accessor else { return Err(self.bad(&place, "is missing; export the file again")) };
        let kind = ["SCALAR", "VEC2", "VEC3", "VEC4"][width - 1];
        if accessor["type"] != kind || accessor.get("sparse").is_some() {
            return Err(self.bad(&place, format!("is {} or sparse; expected a plain {kind}", accessor["type"])));
        }
        // Bytes per value, the decoder, and for normalised integers the value that means 1.
        let (size, number, full): (u64, fn(&[u8]) -> f32, f32) = match accessor["componentType"].as_u64() {
            Some(FLOAT_COMPONENT) => (4, |b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]), 1.0),
            Some(5120) => (1, |b| f32::from(b[0] as i8), 127.0),
            Some(5121) => (1, |b| f32::from(b[0]), 255.0),
            Some(5122) => (2, |b| f32::from(i16::from_le_bytes([b[0], b[1]])), 32_767.0),
            Some(5123) => (2, |b| f32::from(u16::from_le_bytes([b[0], b[1]])), 65_535.0),
            _ => return Err(self.bad(&place, "has an unsupported type; expected float, or integers of 8 or 16 bits")),
        };
        let is_share = size < 4 && accessor["normalized"].as_bool().unwrap_or(false);
        let count = accessor["count"].as_u64().unwrap_or(0);
        let (view, stride) = self.view(&place, &accessor["bufferView"])?;
        let start = accessor["byteOffset"].as_u64().unwrap_or(0);
        let stride = stride.unwrap_or(width as u64 * size);
        let bytes =
            count.checked_sub(1).map_or(Some(0), |last| last.checked_mul(stride)?.checked_add(width as u64 * size));
        let end = bytes.and_then(|bytes| bytes.checked_add(start)).filter(|&end| end <= view.len() as u64);
        if end.is_none() || stride < width as u64 * size {
            let problem =
                format!("has {count} elements of {stride} bytes from byte {start}; its view has {} bytes", view.len());
            return Err(self.bad(&place, format!("{problem}; the file was cut short or changed")));
        }
        let at = |row: u64, column: usize| (start + row * stride + column as u64 * size) as usize;
        let number = |bytes: &[u8]| if is_share { (number(bytes) / full).max(-1.0) } else { number(bytes) };
        let value = |row: u64| (0..width).map(move |column| number(&view[at(row, column)..]));
        Ok(Some(Column { values: (0..count).flat_map(value).collect(), width }))
    }

    /// Returns the bytes and the stride of a buffer view.
    fn view(&self, place: &str, index: &Value) -> Result<(&[u8], Option<u64>)> {
        let view = index.as_u64().and_then(|at| self.root["bufferViews"].get(usize::try_from(at).ok()?));
        let range = view.filter(|view| view["buffer"] == 0).and_then(|view| {
            let start = usize::try_from(view["byteOffset"].as_u64().unwrap_or(0)).ok()?;
            let length = usize::try_from(view["byteLength"].as_u64()?).ok()?;
            self.binary.get(start..start.checked_add(length)?)
        });
        let problem =
            || self.bad(place, format!("its buffer view {index} is not in the binary chunk; export the file again"));
        let stride = view.and_then(|view| view["byteStride"].as_u64());
        range.map(|range| (range, stride)).ok_or_else(problem)
    }

    /// Returns the label of each Gaussian, and the label names.
    fn labels(&self, primitive: &Value, count: usize) -> Result<Option<(Vec<u32>, Option<LabelTable>)>> {
        let sets = &primitive["extensions"][FEATURES_EXTENSION]["featureIds"];
        let own = sets.as_array().into_iter().flatten().find(|set| set["attribute"] == 0);
        let Some(column) = self.attribute(primitive, FEATURE_ATTRIBUTE, 1)? else { return Ok(None) };
        if column.values.len() != count {
            return Err(self.bad(FEATURE_ATTRIBUTE, format!("has {} ids; expected {count}", column.values.len())));
        }
        let table = own.and_then(|set| set["propertyTable"].as_u64());
        let rows = table.map(|table| self.table(table)).transpose()?;
        let nothing = own.and_then(|set| set["nullFeatureId"].as_u64());
        let mut labels = Vec::with_capacity(count);
        for (index, &feature) in column.values.iter().enumerate() {
            let place = format!("{FEATURE_ATTRIBUTE} {index}");
            if feature.fract() != 0.0 || !(0.0..=FEATURE_MAX).contains(&feature) {
                return Err(self.bad(
                    &place,
                    format!("is {feature}; expected a whole number from 0 to {FEATURE_MAX}; renumber the labels"),
                ));
            }
            let id = match &rows {
                _ if nothing == Some(feature as u64) => 0,
                None => feature as u32,
                Some(rows) => {
                    let row = rows.get(feature as usize).ok_or_else(|| {
                        self.bad(
                            &place,
                            format!("is {feature}, but its table has {} rows; export the file again", rows.len()),
                        )
                    })?;
                    row.0
                }
            };
            labels.push(id);
        }
        let names = rows.map(|rows| {
            let named = rows.into_iter().filter(|row| row.0 != 0);
            LabelTable::new(named.map(|(id, name)| LabelEntry { name, ..LabelEntry::new(id) }).collect())
        });
        Ok(Some((labels, names.filter(|names| names.labels.iter().any(|entry| entry.name.is_some())))))
    }

    /// Returns the id and name of each row of a property table. Without a column `id`, the row number is the id.
    fn table(&self, index: u64) -> Result<Vec<(u32, Option<String>)>> {
        let place = format!("property table {index}");
        let bad = |problem: String| self.bad(&place, format!("{problem}; export the file again"));
        let table = &self.root["extensions"][METADATA_EXTENSION]["propertyTables"]
            [usize::try_from(index).unwrap_or(usize::MAX)];
        let count = table["count"].as_u64().and_then(|count| usize::try_from(count).ok()).unwrap_or(0);
        if count == 0 || count > FEATURE_MAX as usize {
            return Err(bad(format!("has {count} rows; expected 1 to {FEATURE_MAX}")));
        }
        let words = |view: &Value, count: usize| -> Result<Vec<u32>> {
            let (bytes, _) = self.view(&place, view)?;
            let words: Vec<u32> =
                bytes.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).take(count).collect();
            if words.len() == count { Ok(words) } else { Err(bad(format!("a column has fewer than {count} values"))) }
        };
        let properties = &table["properties"];
        let ids = match properties["id"].get("values") {
            Some(values) => words(values, count)?,
            None => (0..count as u32).collect(),
        };
        let mut names = vec![None; count];
        if let Some(values) = properties["name"].get("values") {
            let (text, _) = self.view(&place, values)?;
            let offsets = words(&properties["name"]["stringOffsets"], count + 1)?;
            for (name, ends) in names.iter_mut().zip(offsets.windows(2)) {
                let part = text.get(ends[0] as usize..ends[1] as usize).and_then(|part| str::from_utf8(part).ok());
                let part = part.ok_or_else(|| bad("a name lies outside its text".into()))?;
                *name = (!part.is_empty()).then(|| part.to_owned());
            }
        }
        let (mut seen, mut known) = (BTreeSet::new(), BTreeSet::new());
        for (&id, name) in ids.iter().zip(&names) {
            if id > MODEL_LABEL_MAX || !seen.insert(id) || name.as_ref().is_some_and(|name| !known.insert(name)) {
                return Err(bad(format!("the id {id} or its name occurs twice, or the id is above {MODEL_LABEL_MAX}")));
            }
        }
        Ok(ids.into_iter().zip(names).collect())
    }
}
