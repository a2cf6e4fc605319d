//! Writes meshes as GLB: a named node per mesh, with unlit vertex colours.

use super::GLTF_AXES;
use super::file;
use super::write::Binary;
use glam::DVec3;
use labelgs_files::atomic;
use labelgs_scene::{Error, Result};
use serde_json::{Value, json};
use std::path::Path;

/// Component type of 32-bit integers.
const INTEGER_COMPONENT: u64 = 5125;
const UNLIT_EXTENSION: &str = "KHR_materials_unlit";

/// A triangle mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Name of the mesh's node.
    pub name: String,
    /// World position of (0, 0, 0).
    pub origin: DVec3,
    /// Vertices relative to the origin, world units.
    pub positions: Vec<[f32; 3]>,
    /// Outward unit normals of the vertices.
    pub normals: Vec<[f32; 3]>,
    /// Vertex colours (r, g, b) as in photos (sRGB), 0 to 1.
    pub colours: Vec<[f32; 3]>,
    /// Vertices of each triangle, counter-clockwise from outside.
    pub triangles: Vec<[u32; 3]>,
}

/// Writes meshes to a GLB, atomically, with y up as for models.
///
/// # Errors
///
/// Another extension, a mesh without triangles, or more data than a GLB can hold.
pub fn write_meshes(path: &Path, meshes: &[Mesh]) -> Result<()> {
    let bytes: usize = meshes.iter().map(|mesh| 36 * mesh.positions.len() + 12 * mesh.triangles.len()).sum();
    if bytes as u64 > file::BYTES_MAX {
        let problem = format!("a GLB holds {} bytes, and these meshes take {bytes}; use larger cells", file::BYTES_MAX);
        return Err(Error::usage("GLB", problem));
    }
    if let Some(empty) = meshes.iter().find(|mesh| mesh.triangles.is_empty()) {
        return Err(Error::usage("GLB", format!("the mesh {} has no triangles", empty.name)));
    }
    let (mut binary, mut nodes, mut all) = (Binary::default(), Vec::new(), Vec::new());
    for (index, mesh) in meshes.iter().enumerate() {
        let sign = DVec3::from_array(GLTF_AXES.0.map(f64::from));
        nodes.push(json!({ "name": mesh.name, "mesh": index, "translation": (sign * mesh.origin).to_array() }));
        all.push(json!({ "name": mesh.name, "primitives": [primitive(mesh, &mut binary)] }));
    }
    binary.bytes.resize(binary.bytes.len().next_multiple_of(8), 0);
    let root = json!({
        "asset": { "version": "2.0", "generator": concat!("labelgs ", env!("CARGO_PKG_VERSION")) },
        "extensionsUsed": [UNLIT_EXTENSION],
        "scene": 0,
        "scenes": [{ "nodes": (0..nodes.len()).collect::<Vec<_>>() }],
        "nodes": nodes,
        "materials": [{
            "name": "colours",
            "pbrMetallicRoughness": { "metallicFactor": 0.0, "roughnessFactor": 1.0 },
            "extensions": { UNLIT_EXTENSION: {} },
        }],
        "meshes": all,
        "accessors": binary.accessors,
        "bufferViews": binary.views,
        "buffers": [{ "byteLength": binary.bytes.len() }],
    });
    atomic::write(path, |out| file::write(&root, &binary.bytes, out))
}

fn primitive(mesh: &Mesh, to: &mut Binary) -> Value {
    let turned = |all: &[[f32; 3]]| all.iter().map(|&at| GLTF_AXES.position(at)).collect::<Vec<_>>();
    let positions = to.attribute(true, turned(&mesh.positions).into_iter());
    let normals = to.attribute(false, turned(&mesh.normals).into_iter());
    let colours = to.attribute(false, mesh.colours.iter().map(|colour| colour.map(linear)));
    let corners = mesh.triangles.as_flattened();
    let view = to.view(|bytes| corners.iter().for_each(|corner| bytes.extend(corner.to_le_bytes())));
    to.views[view]["target"] = json!(34963);
    to.accessors.push(json!({
        "bufferView": view, "componentType": INTEGER_COMPONENT, "count": corners.len(), "type": "SCALAR",
    }));
    json!({
        "mode": 4,
        "material": 0,
        "attributes": { "POSITION": positions, "NORMAL": normals, "COLOR_0": colours },
        "indices": to.accessors.len() - 1,
    })
}

/// Converts an sRGB value, 0 to 1, to linear light: vertex colours are linear in glTF.
fn linear(value: f32) -> f32 {
    let value = value.clamp(0.0, 1.0);
    if value <= 0.040_45 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
}
