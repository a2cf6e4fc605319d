//! Writes GLB.

use super::{
    ANTIALIASED_KEY, CONFIDENCE_ATTRIBUTE, EYE_KEY, FEATURE_ATTRIBUTE, FEATURES_EXTENSION, FLOAT_COMPONENT, GLTF_AXES,
    METADATA_EXTENSION, OPACITY_ATTRIBUTE, ROTATION_ATTRIBUTE, SCALE_ATTRIBUTE, SPLATS_EXTENSION, UP_KEY, file,
    harmonic, harmonics,
};
use crate::format::{Export, FirstView, ModelWriter};
use crate::values::{losses as losses_of_values, sigmoid, unit};
use labelgs_files::label_table::LabelTable;
use labelgs_scene::harmonics::value_of;
use labelgs_scene::{Error, Result, UNLABELLED};
use serde_json::{Map, Value, json};
use std::collections::BTreeSet;
use std::io::{self, Write};

pub(super) const MODEL_WRITER: ModelWriter = ModelWriter { losses, write, checksum: None };

fn losses(export: &Export) -> Result<Vec<String>> {
    let bytes = file::bytes_per_row(export) * export.rows.len() as u64;
    if export.rows.is_empty() || bytes > file::BYTES_MAX {
        let problem =
            format!("a GLB holds at least 1 Gaussian and at most {} bytes; this model takes {bytes}", file::BYTES_MAX);
        return Err(Error::usage("GLB", format!("{problem}; leave out some Gaussians or write another format")));
    }
    Ok(losses_of_values(export))
}

/// The binary chunk and its accessors.
#[derive(Default)]
pub(super) struct Binary {
    pub(super) bytes: Vec<u8>,
    pub(super) views: Vec<Value>,
    pub(super) accessors: Vec<Value>,
}

impl Binary {
    /// Adds a view of the bytes that `fill` appends, aligned to 8 bytes as tables require.
    pub(super) fn view(&mut self, fill: impl FnOnce(&mut Vec<u8>)) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(8), 0);
        let start = self.bytes.len();
        fill(&mut self.bytes);
        self.views.push(json!({ "buffer": 0, "byteOffset": start, "byteLength": self.bytes.len() - start }));
        self.views.len() - 1
    }

    /// Adds a float attribute. Position attributes need bounds.
    pub(super) fn attribute<const N: usize>(&mut self, bounds: bool, rows: impl Iterator<Item = [f32; N]>) -> usize {
        let (mut least, mut most, mut count) = ([f32::MAX; N], [f32::MIN; N], 0);
        let view = self.view(|bytes| {
            for row in rows {
                count += 1;
                for (axis, value) in row.into_iter().enumerate() {
                    least[axis] = least[axis].min(value);
                    most[axis] = most[axis].max(value);
                    bytes.extend(value.to_le_bytes());
                }
            }
        });
        self.views[view]["target"] = json!(34962);
        let kind = ["SCALAR", "VEC2", "VEC3", "VEC4"][N - 1];
        let mut accessor =
            json!({ "bufferView": view, "componentType": FLOAT_COMPONENT, "count": count, "type": kind });
        if bounds {
            accessor["min"] = json!(least.as_slice());
            accessor["max"] = json!(most.as_slice());
        }
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }
}

fn write(export: &Export, out: &mut dyn Write) -> io::Result<()> {
    let mut binary = Binary::default();
    let mut primitive = json!({
        "mode": 0,
        "attributes": attributes(export, &mut binary),
        "extensions": { SPLATS_EXTENSION: { "kernel": "ellipse", "colorSpace": "srgb_rec709_display" } },
    });
    if export.model.antialiased {
        primitive["extras"][ANTIALIASED_KEY] = true.into();
    }
    if let Some(FirstView { up, eye }) = export.options.first_view {
        primitive["extras"][UP_KEY] = json!(up.to_array());
        primitive["extras"][EYE_KEY] = json!(eye.to_array());
    }
    let mut used = vec![SPLATS_EXTENSION];
    let mut root = json!({
        "asset": { "version": "2.0", "generator": concat!("labelgs ", env!("CARGO_PKG_VERSION")) },
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0, "name": "gaussians" }],
    });
    if let Some(labels) = export.labels() {
        let ids: BTreeSet<u32> = export.rows.iter().map(|&row| labels[row]).filter(|&id| id != UNLABELLED).collect();
        let ids: Vec<u32> = [UNLABELLED].into_iter().chain(ids).collect();
        let row_of = |row: usize| ids.binary_search(&labels[row]).unwrap_or_default() as f32;
        let feature = binary.attribute(false, export.rows.iter().map(|&row| [row_of(row)]));
        primitive["attributes"][FEATURE_ATTRIBUTE] = json!(feature);
        if let Some(shares) = export.label_confidence() {
            let share = binary.attribute(false, export.rows.iter().map(|&row| [shares[row]]));
            primitive["attributes"][CONFIDENCE_ATTRIBUTE] = json!(share);
        }
        primitive["extensions"][FEATURES_EXTENSION] = json!({ "featureIds": [{
            "featureCount": ids.len(), "attribute": 0, "nullFeatureId": 0, "label": "object", "propertyTable": 0,
        }]});
        root["extensions"] = json!({ METADATA_EXTENSION: table(&ids, export.names, &mut binary) });
        used.extend([FEATURES_EXTENSION, METADATA_EXTENSION]);
    }
    binary.bytes.resize(binary.bytes.len().next_multiple_of(8), 0);
    root["extensionsUsed"] = json!(used);
    root["meshes"] = json!([{ "primitives": [primitive] }]);
    root["accessors"] = Value::Array(binary.accessors);
    root["bufferViews"] = Value::Array(binary.views);
    root["buffers"] = json!([{ "byteLength": binary.bytes.len() }]);
    file::write(&root, &binary.bytes, out)
}

fn attributes(export: &Export, to: &mut Binary) -> Value {
    let g = export.model;
    let rows = || export.rows.iter().copied();
    let rotation = |row: usize| {
        let [w, x, y, z] = unit(GLTF_AXES.quat(g.quats[row]));
        [x, y, z, w]
    };
    let mut all = Map::new();
    let mut add = |name: String, accessor: usize| drop(all.insert(name, json!(accessor)));
    add("POSITION".into(), to.attribute(true, rows().map(|row| GLTF_AXES.position(export.position(row)))));
    // Fallback colours for viewers that draw points.
    let shown = |row: usize| {
        let [r, g, b] = export.model.sh0[row].map(|sh0| value_of(sh0).clamp(0.0, 1.0) as f32);
        [r, g, b, sigmoid(export.model.opacities[row])]
    };
    add("COLOR_0".into(), to.attribute(false, rows().map(shown)));
    add(ROTATION_ATTRIBUTE.into(), to.attribute(false, rows().map(rotation)));
    add(SCALE_ATTRIBUTE.into(), to.attribute(false, rows().map(|row| g.scales[row].map(f32::exp))));
    add(OPACITY_ATTRIBUTE.into(), to.attribute(false, rows().map(|row| [sigmoid(g.opacities[row])])));
    add(harmonic(0, 0), to.attribute(false, rows().map(|row| g.sh0[row])));
    for ((index, name), sign) in harmonics(g.sh_degree).enumerate().zip(GLTF_AXES.signs()) {
        let value = |row: usize| export.model.rest(row)[index].map(|value| sign * value);
        add(name, to.attribute(false, rows().map(value)));
    }
    Value::Object(all)
}

/// Writes the label table: a row for each id, with its name.
fn table(ids: &[u32], names: Option<&LabelTable>, to: &mut Binary) -> Value {
    let name = |&id: &u32| names.and_then(|names| names.name(id)).unwrap_or_default();
    let texts: Vec<&str> = ids.iter().map(name).collect();
    // A view must not be empty.
    let text = texts.concat() + if texts.iter().all(|text| text.is_empty()) { " " } else { "" };
    let values = to.view(|bytes| bytes.extend(text.as_bytes()));
    let offsets = to.view(|bytes| {
        let ends = texts.iter().scan(0_u32, |end, text| {
            *end += text.len() as u32;
            Some(*end)
        });
        [0].into_iter().chain(ends).for_each(|end| bytes.extend(end.to_le_bytes()));
    });
    let own = to.view(|bytes| ids.iter().for_each(|id| bytes.extend(id.to_le_bytes())));
    json!({
        "schema": { "id": "labelgs", "classes": { "object": { "properties": {
            "name": { "type": "STRING" },
            "id": { "type": "SCALAR", "componentType": "UINT32" },
        }}}},
        "propertyTables": [{ "name": "objects", "class": "object", "count": ids.len(), "properties": {
            "name": { "values": values, "stringOffsets": offsets },
            "id": { "values": own },
        }}],
    })
}
