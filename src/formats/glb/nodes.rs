//! Where the nodes of a scene place the primitives with Gaussians.

use super::{AXES, SPLATS};
use crate::transform::Transform;
use glam::{DMat4, DQuat, DVec3};
use serde_json::Value;

/// A primitive with Gaussians at its place.
pub(super) struct Placed<'a> {
    pub(super) primitive: &'a Value,
    pub(super) place: Transform,
}

/// Returns the primitives with Gaussians at the places of the nodes that show them; without such nodes, as they are. `Err`
/// has the number of a node by whose matrix Gaussians cannot be moved.
pub(super) fn placed(root: &Value) -> Result<Vec<Placed<'_>>, usize> {
    let list = |value: &Value| -> Vec<usize> {
        value.as_array().into_iter().flatten().filter_map(|at| usize::try_from(at.as_u64()?).ok()).collect()
    };
    let splats = |mesh: &'_ Value| -> Vec<usize> {
        let all = mesh["primitives"].as_array().into_iter().flatten().enumerate();
        all.filter(|(_, primitive)| primitive["extensions"][SPLATS].is_object()).map(|(at, _)| at).collect()
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
        // A node has one parent; a file that says otherwise would go in circles.
        let Some(node) = nodes.get(at).filter(|_| !std::mem::replace(&mut seen[at], true)) else { continue };
        let matrix = parent * matrix_of(node);
        open.extend(list(&node["children"]).into_iter().rev().map(|child| (child, matrix)));
        let Some(mesh) = node["mesh"].as_u64().map(|mesh| &root["meshes"][mesh as usize]) else { continue };
        for primitive in splats(mesh) {
            let place = Transform::of_matrix(matrix, AXES).ok_or(at)?;
            found.push(Placed { primitive: &mesh["primitives"][primitive], place });
        }
    }
    if found.is_empty() {
        for mesh in root["meshes"].as_array().into_iter().flatten() {
            let here = |at: usize| Placed { primitive: &mesh["primitives"][at], place: Transform::default() };
            found.extend(splats(mesh).into_iter().map(here));
        }
    }
    Ok(found)
}

/// The matrix of a node relative to its parent.
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
