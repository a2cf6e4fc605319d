//! The size of a shader's workgroup, read from its SPIR-V.

use crate::shaders::ShaderDesc;
use std::collections::HashMap;

const OP_EXECUTION_MODE: u32 = 16;
const OP_CONSTANT: u32 = 43;
const OP_SPEC_CONSTANT: u32 = 50;
const OP_CONSTANT_COMPOSITE: u32 = 44;
const OP_SPEC_CONSTANT_COMPOSITE: u32 = 51;
const OP_DECORATE: u32 = 71;
const OP_EXECUTION_MODE_ID: u32 = 331;
const MODE_LOCAL_SIZE: u32 = 17;
const MODE_LOCAL_SIZE_ID: u32 = 38;
const DECORATION_SPEC_ID: u32 = 1;
const DECORATION_BUILT_IN: u32 = 11;
const BUILT_IN_WORKGROUP_SIZE: u32 = 25;

/// Invocations per axis with these specialisation constants (in the order of the shader's), if the SPIR-V tells.
pub(super) fn local_size(shader: &ShaderDesc, spec: &[u32]) -> Option<[u32; 3]> {
    let words = shader.spirv.chunks_exact(4).map(|word| u32::from_le_bytes([word[0], word[1], word[2], word[3]]));
    let words = words.collect::<Vec<_>>();
    let mut values = HashMap::new();
    let mut spec_ids = HashMap::new();
    let mut composites = HashMap::new();
    let (mut literal, mut by_id, mut built_in) = (None, None, None);
    let mut rest = words.get(5..)?;
    while let Some(&head) = rest.first() {
        let (length, operation) = ((head >> 16) as usize, head & 0xffff);
        let operands = rest.get(1..length.max(1))?;
        match (operation, operands) {
            (OP_EXECUTION_MODE, [_, MODE_LOCAL_SIZE, x, y, z]) => literal = Some([*x, *y, *z]),
            (OP_EXECUTION_MODE_ID, [_, MODE_LOCAL_SIZE_ID, x, y, z]) => by_id = Some([*x, *y, *z]),
            (OP_DECORATE, [target, DECORATION_BUILT_IN, BUILT_IN_WORKGROUP_SIZE]) => built_in = Some(*target),
            (OP_DECORATE, [target, DECORATION_SPEC_ID, id]) => {
                spec_ids.insert(*target, *id);
            }
            (OP_CONSTANT | OP_SPEC_CONSTANT, [_, result, value]) => {
                values.insert(*result, *value);
            }
            (OP_CONSTANT_COMPOSITE | OP_SPEC_CONSTANT_COMPOSITE, [_, result, x, y, z]) => {
                composites.insert(*result, [*x, *y, *z]);
            }
            _ => {}
        }
        rest = rest.get(length.max(1)..)?;
    }
    let value = |id: &u32| {
        let given = spec_ids.get(id).and_then(|spec_id| {
            let position = shader.spec.iter().position(|constant| constant.id == *spec_id)?;
            spec.get(position).copied()
        });
        given.or_else(|| values.get(id).copied())
    };
    // The built-in wins over the execution mode, says the SPIR-V specification.
    let ids = built_in.and_then(|id| composites.get(&id).copied()).or(by_id);
    match ids {
        Some([x, y, z]) => Some([value(&x)?, value(&y)?, value(&z)?]),
        None => literal,
    }
}
