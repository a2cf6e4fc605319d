//! Applies the node transforms of a scene to its primitives with Gaussians.

use super::{GLTF_AXES, SPLATS_EXTENSION};
use crate::transform::Transform;
use glam::{DMat4, DQuat, DVec3};
use serde_json::Value;

/// A primitive with Gaussians and its transform.
pub(super) struct PlacedPrimitive<'a> {
    pub(super) primitive: &'a Value,
    pub(super) place: Transform,
}

/// Returns the primitives with Gaussians and the transforms of the nodes that show them. Without such nodes, returns
/// the primitives untransformed. `Err` has the number of a node whose matrix cannot be applied to Gaussians.
pub(super) fn place_primitives(root: &Value) -> Result<Vec<PlacedPrimitive<'_>>, usize> {
    let list = |value: &Value| -> Vec<usize> {
        value.as_array().into_iter().flatten().filter_map(|at| usize::try_from(at.as_u64()?).ok()).collect()
    };
    let splats = |mesh: &'_ Value| -> Vec<usize> {
        let all = mesh["primitives"].as_array().into_iter().flatten().enumerate();
        all.filter(|(_, primitive)| primitive["extensions"][SPLATS_EXTENSION].is_object()).map(|(at, _)| at).collect()
    };
    let nodes: &[Value] = root["nodes"].as_array().map_or(&[], Vec::as_slice);
    let scene = &root["scenes"][root["scene"].as_u64().unwrap_or(0) as usize];
    let mut open: Vec<(usize, DMat4)> = match scene["nodes"].is_array() {
        true => list(&scene["nodes"]),
        false => {
            let children: Vec<usize> = nodes.iter().flat_map(|node| list(&node["children"])).collect();
            (0..nodes.len()).filter(|at| !children.contains(at)).collect()
        }
    }
    .into_iter()
    .map(|at| (at, DMat4::IDENTITY))
    .collect();
    open.reverse();
    let (mut found, mut seen) = (Vec::new(), vec![false; nodes.len()]);
    while let Some((at, parent)) = open.pop() {
        // A node has one parent; a file with several could contain a cycle.
        let Some(node) = nodes.get(at).filter(|_| !std::mem::replace(&mut seen[at], true)) else { continue };
        let matrix = parent * matrix_of(node);
        open.extend(list(&node["children"]).into_iter().rev().map(|child| (child, matrix)));
        let Some(mesh) = node["mesh"].as_u64().map(|mesh| &root["meshes"][mesh as usize]) else { continue };
        for primitive in splats(mesh) {
            let place = Transform::from_matrix(matrix, GLTF_AXES).ok_or(at)?;
            found.push(PlacedPrimitive { primitive: &mesh["primitives"][primitive], place });
        }
    }
    if found.is_empty() {
        for mesh in root["meshes"].as_array().into_iter().flatten() {
            let here = |at: usize| PlacedPrimitive { primitive: &mesh["primitives"][at], place: Transform::default() };
            found.extend(splats(mesh).into_iter().map(here));
        }
    }
    Ok(found)
}

/// Returns the matrix of a node relative to its parent.
fn matrix_of(node: &Value) -> DMat4 {
    let numbers =
        |key: &str| -> Vec<f64> { node[key].as_array().into_iter().flatten().filter_map(Value::as_f64).collect() };
    if let Ok(matrix) = numbers("matrix").try_into() {
        return DMat4::from_cols_array(&matrix);
    }
    let triple = |key: &str, usual: DVec3| numbers(key).try_into().map_or(usual, DVec3::from_array);
    let turn = numbers("rotation").try_into().map_or(DQuat::IDENTITY, DQuat::from_array);
    DMat4::from_scale_rotation_translation(
        triple("scale", DVec3::ONE),
        turn.normalize(),
        triple("translation", DVec3::ZERO),
    )
}
