//! Declares in a module that subgroups reconverge where control flow is uniform for them
//! (VK_KHR_shader_subgroup_uniform_control_flow). Without the declaration, Vulkan promises that for whole workgroups
//! only. Modules ship without it, because devices without the extension refuse it.

const FLOW_EXTENSION: &[u8; 40] = b"SPV_KHR_subgroup_uniform_control_flow\0\0\0";
const HEADER_WORDS: usize = 5;
const OP_EXTENSION: u32 = 10;
const OP_ENTRY_POINT: u32 = 15;
const OP_EXECUTION_MODE: u32 = 16;
const OP_CAPABILITY: u32 = 17;
const SUBGROUP_UNIFORM_CONTROL_FLOW: u32 = 4421;

/// Adds the extension after the capabilities, and the execution mode after the entry point.
pub(super) fn declare(words: &mut Vec<u32>) {
    let (mut at, mut capabilities, mut entry) = (HEADER_WORDS, HEADER_WORDS, None);
    while let Some(&word) = words.get(at).filter(|&&word| word >> 16 > 0) {
        let next = at + (word >> 16) as usize;
        match word & 0xffff {
            OP_CAPABILITY => capabilities = next,
            OP_ENTRY_POINT => entry = words.get(at + 2).map(|&id| (next, id)),
            _ => {}
        }
        at = next;
    }
    let Some((after, id)) = entry else { return };
    words.splice(after..after, [3 << 16 | OP_EXECUTION_MODE, id, SUBGROUP_UNIFORM_CONTROL_FLOW]);
    let (name, _) = FLOW_EXTENSION.as_chunks::<4>();
    let extension = [11 << 16 | OP_EXTENSION].into_iter().chain(name.iter().map(|four| u32::from_le_bytes(*four)));
    words.splice(capabilities..capabilities, extension);
}

#[cfg(test)]
mod tests {
    use super::declare;
    use rspirv::spirv::{ExecutionMode, Op};

    #[test]
    fn every_module_stays_valid_and_has_the_declaration() {
        for shader in crate::shaders::ALL {
            let (words, _) = shader.spirv.as_chunks::<4>();
            let mut words: Vec<u32> = words.iter().map(|word| u32::from_le_bytes(*word)).collect();
            declare(&mut words);
            let module = rspirv::dr::load_words(&words).expect("a module");
            assert_eq!(module.extensions.len(), 1, "{}", shader.name);
            let modes = module.execution_modes.iter().filter(|mode| mode.class.opcode == Op::ExecutionMode);
            let found = modes.filter(|mode| {
                mode.operands[1].unwrap_execution_mode() == ExecutionMode::SubgroupUniformControlFlowKHR
            });
            assert_eq!(found.count(), 1, "{}", shader.name);
        }
    }
}
