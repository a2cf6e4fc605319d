//! Rewrites SPIR-V so that storage buffers share a few bindings, for devices with too few bindings.
//!
//! Every storage variable of a module moves to the binding of a window, a memory range that contains several buffers.
//! Each access adds the buffer's offset in the window, in elements. Offsets come from a uniform buffer, one word per
//! storage buffer, so that buffers can move without recompiling kernels. A block that is a single struct becomes an
//! array of structs. Modules are rewritten when pipelines are created, and only on such devices.

use crate::shaders::{BindingDesc, BindingKind};
use std::collections::BTreeMap;

/// The SPIR-V opcodes and constants used here.
mod spirv {
    pub(super) const LINE: u32 = 8;
    pub(super) const ENTRY_POINT: u32 = 15;
    pub(super) const TYPE_INT: u32 = 21;
    pub(super) const TYPE_RUNTIME_ARRAY: u32 = 29;
    pub(super) const TYPE_STRUCT: u32 = 30;
    pub(super) const TYPE_POINTER: u32 = 32;
    pub(super) const CONSTANT: u32 = 43;
    pub(super) const FUNCTION: u32 = 54;
    pub(super) const FUNCTION_CALL: u32 = 57;
    pub(super) const VARIABLE: u32 = 59;
    pub(super) const LOAD: u32 = 61;
    pub(super) const STORE: u32 = 62;
    pub(super) const COPY_MEMORY: u32 = 63;
    pub(super) const ACCESS_CHAIN: u32 = 65;
    pub(super) const IN_BOUNDS_ACCESS_CHAIN: u32 = 66;
    pub(super) const PTR_ACCESS_CHAIN: u32 = 67;
    pub(super) const ARRAY_LENGTH: u32 = 68;
    pub(super) const DECORATE: u32 = 71;
    pub(super) const MEMBER_DECORATE: u32 = 72;
    pub(super) const COPY_OBJECT: u32 = 83;
    pub(super) const ADD: u32 = 128;
    pub(super) const LABEL: u32 = 248;
    pub(super) const NO_LINE: u32 = 317;
    /// Decorations.
    pub(super) const BLOCK: u32 = 2;
    pub(super) const ARRAY_STRIDE: u32 = 6;
    pub(super) const RESTRICT: u32 = 19;
    pub(super) const ALIASED: u32 = 20;
    pub(super) const BINDING: u32 = 33;
    pub(super) const SET: u32 = 34;
    pub(super) const OFFSET: u32 = 35;
    /// Storage classes.
    pub(super) const UNIFORM: u32 = 2;
    pub(super) const STORAGE_BUFFER: u32 = 12;
    /// Header words before the first instruction, and the index of the id bound.
    pub(super) const HEADER: usize = 5;
    pub(super) const BOUND: usize = 3;
}
use spirv as op;

/// Window of each storage buffer of a shader, in binding order.
pub(super) type Windows<'a> = &'a [u8];

/// Bytes per element of a storage buffer in its window: the array's element size in GLSL, or the padded struct size.
pub(crate) fn stride(binding: &BindingDesc) -> u64 {
    u64::from(binding.element_bytes).next_power_of_two()
}

/// Number of windows.
pub(super) fn count(windows: Windows<'_>) -> u32 {
    windows.iter().map(|&window| u32::from(window) + 1).max().unwrap_or(0)
}

/// Binding of the first window; the uniform buffer follows the last window. Texel buffers keep their bindings.
pub(super) fn first_binding(bindings: &[BindingDesc]) -> u32 {
    bindings.iter().map(|binding| binding.binding + 1).max().unwrap_or(0)
}

/// A storage variable.
struct Variable {
    /// Binding of the window.
    binding: u32,
    /// Index among the shader's storage buffers.
    number: u32,
    /// True if its block is an array, not a single struct.
    is_array: bool,
    /// Ids of the index constant, and of the offset in elements, which is loaded at the start of the function.
    constant: u32,
    place: u32,
}

/// Result of scanning a module, and newly assigned ids.
struct Module {
    /// Storage variables by id.
    variables: BTreeMap<u32, Variable>,
    /// Blocks that are a single struct: ids of block and array, and bytes per element.
    singles: BTreeMap<u32, (u32, u32)>,
    /// Type `uint`, and whether the module has it.
    uint: u32,
    has_uint: bool,
    /// Ids for the offsets buffer: block, pointer to block, variable, and pointer to a word.
    uniform: [u32; 4],
    uniform_binding: u32,
    /// The next new id.
    next: u32,
}

/// Returns the module with buffers in windows. The error names what the rewrite does not support.
pub(super) fn repack(words: &[u32], bindings: &[BindingDesc], windows: Windows<'_>) -> Result<Vec<u32>, String> {
    let storage: Vec<&BindingDesc> = bindings.iter().filter(|binding| binding.kind == BindingKind::Storage).collect();
    if storage.len() != windows.len() {
        return Err(format!("{} windows for {} storage buffers", windows.len(), storage.len()));
    }
    let all = instructions(words)?;
    let mut module = Module::read(words, &all, &storage, (windows, first_binding(bindings)))?;
    let mut out = words[..op::HEADER].to_vec();
    let (mut is_decorated, mut begins) = (false, false);
    for (opcode, of) in all {
        if !is_decorated && matches!(opcode, op::DECORATE | op::MEMBER_DECORATE) {
            module.decorate(&mut out);
            is_decorated = true;
        }
        if begins && !matches!(opcode, op::LABEL | op::VARIABLE | op::LINE | op::NO_LINE) {
            module.load_places(&mut out);
            begins = false;
        }
        if opcode == op::FUNCTION {
            module.declare(&mut out);
            begins = true;
        }
        module.instruction(&mut out, opcode, of)?;
    }
    out[op::BOUND] = module.next;
    Ok(out)
}

/// Opcode and words of each instruction.
fn instructions(words: &[u32]) -> Result<Vec<(u32, &[u32])>, String> {
    let mut rest = words.get(op::HEADER..).ok_or("no header")?;
    let mut found = Vec::new();
    while let Some(&first) = rest.first() {
        let length = (first >> 16) as usize;
        let (own, after) = rest.split_at_checked(length).filter(|_| length > 0).ok_or("a broken instruction")?;
        found.push((first & 0xffff, own));
        rest = after;
    }
    Ok(found)
}

fn put(out: &mut Vec<u32>, opcode: u32, operands: &[u32]) {
    out.push(opcode | (operands.len() as u32 + 1) << 16);
    out.extend_from_slice(operands);
}

/// Types and variables of a module.
#[derive(Default)]
struct StorageTypes {
    bindings: BTreeMap<u32, u32>,
    strides: BTreeMap<u32, u32>,
    /// Element size of runtime arrays, bytes.
    arrays: BTreeMap<u32, Option<u32>>,
    /// The member of structs with a single member.
    blocks: BTreeMap<u32, u32>,
    pointers: BTreeMap<u32, u32>,
    variables: Vec<(u32, u32)>,
    uint: Option<u32>,
    functions: u32,
}

impl StorageTypes {
    fn add(&mut self, opcode: u32, of: &[u32]) {
        match (opcode, of) {
            (op::DECORATE, &[_, id, op::BINDING, number]) => drop(self.bindings.insert(id, number)),
            (op::DECORATE, &[_, id, op::ARRAY_STRIDE, bytes]) => drop(self.strides.insert(id, bytes)),
            (op::TYPE_INT, &[_, id, 32, 0]) => self.uint = Some(id),
            (op::TYPE_RUNTIME_ARRAY, &[_, id, _]) => drop(self.arrays.insert(id, self.strides.get(&id).copied())),
            (op::TYPE_STRUCT, &[_, id, member]) => drop(self.blocks.insert(id, member)),
            (op::TYPE_POINTER, &[_, id, op::STORAGE_BUFFER, to]) => drop(self.pointers.insert(id, to)),
            (op::VARIABLE, &[_, pointer, id, op::STORAGE_BUFFER, ..]) => self.variables.push((id, pointer)),
            (op::FUNCTION, _) => self.functions += 1,
            _ => {}
        }
    }
}

impl Module {
    fn read(
        words: &[u32],
        all: &[(u32, &[u32])],
        storage: &[&BindingDesc],
        (windows, first): (Windows<'_>, u32),
    ) -> Result<Self, String> {
        let mut found = StorageTypes::default();
        all.iter().for_each(|(opcode, of)| found.add(*opcode, of));
        if found.functions != 1 {
            return Err(format!("{} functions", found.functions));
        }
        let mut next = words[op::BOUND];
        let mut new = || {
            next += 1;
            next - 1
        };
        let (has_uint, uint) = (found.uint.is_some(), found.uint.unwrap_or_else(&mut new));
        let uniform = [new(), new(), new(), new()];
        let (mut variables, mut singles) = (BTreeMap::new(), BTreeMap::new());
        for (id, pointer) in found.variables {
            let number = storage.iter().position(|binding| found.bindings.get(&id) == Some(&binding.binding));
            let number = number.ok_or_else(|| format!("storage variable {id} without a known binding"))?;
            let block = *found.pointers.get(&pointer).ok_or("a storage variable of an unknown type")?;
            let member = found.blocks.get(&block).ok_or("a storage block without exactly one member")?;
            let bytes = stride(storage[number]) as u32;
            let is_array = match found.arrays.get(member) {
                Some(own) if *own != Some(bytes) => return Err(format!("an array with elements of {own:?} bytes")),
                own => own.is_some(),
            };
            if !is_array {
                singles.entry(block).or_insert_with(|| (new(), bytes));
            }
            let binding = first + u32::from(windows[number]);
            let variable = Variable { binding, number: number as u32, is_array, constant: new(), place: new() };
            variables.insert(id, variable);
        }
        let uniform_binding = first + count(windows);
        Ok(Self { variables, singles, uint, has_uint, uniform, uniform_binding, next })
    }

    /// Decorations of new types and variables. Variables that share a window are aliased.
    fn decorate(&self, out: &mut Vec<u32>) {
        let [block, _, uniform, _] = self.uniform;
        self.variables.keys().for_each(|&id| put(out, op::DECORATE, &[id, op::ALIASED]));
        self.singles.values().for_each(|&(array, bytes)| put(out, op::DECORATE, &[array, op::ARRAY_STRIDE, bytes]));
        let words = self.words();
        (0..words).for_each(|word| put(out, op::MEMBER_DECORATE, &[block, word, op::OFFSET, 4 * word]));
        put(out, op::DECORATE, &[block, op::BLOCK]);
        put(out, op::DECORATE, &[uniform, op::SET, 0]);
        put(out, op::DECORATE, &[uniform, op::BINDING, self.uniform_binding]);
    }

    /// Number of words of the offsets buffer.
    fn words(&self) -> u32 {
        self.variables.values().map(|variable| variable.number + 1).max().unwrap_or(1)
    }

    /// Declares the offsets buffer, before the function.
    fn declare(&self, out: &mut Vec<u32>) {
        let ([block, pointer, uniform, word], uint) = (self.uniform, self.uint);
        if !self.has_uint {
            put(out, op::TYPE_INT, &[uint, 32, 0]);
        }
        let members = std::iter::repeat_n(uint, self.words() as usize);
        put(out, op::TYPE_STRUCT, &std::iter::once(block).chain(members).collect::<Vec<_>>());
        put(out, op::TYPE_POINTER, &[pointer, op::UNIFORM, block]);
        put(out, op::TYPE_POINTER, &[word, op::UNIFORM, uint]);
        put(out, op::VARIABLE, &[pointer, uniform, op::UNIFORM]);
        for variable in self.variables.values() {
            put(out, op::CONSTANT, &[uint, variable.constant, variable.number]);
        }
    }

    /// Loads the offsets at the start of the function, so that all its blocks can use them.
    fn load_places(&mut self, out: &mut Vec<u32>) {
        let [_, _, uniform, word] = self.uniform;
        for variable in self.variables.values() {
            put(out, op::ACCESS_CHAIN, &[word, self.next, uniform, variable.constant]);
            put(out, op::LOAD, &[self.uint, variable.place, self.next]);
            self.next += 1;
        }
    }

    fn instruction(&mut self, out: &mut Vec<u32>, opcode: u32, of: &[u32]) -> Result<(), String> {
        let is_ours = |id: &u32| self.variables.contains_key(id);
        match (opcode, of) {
            (op::ENTRY_POINT, _) => put(out, opcode, &[&of[1..], &[self.uniform[2]]].concat()),
            (op::DECORATE, [_, id, op::RESTRICT | op::ALIASED]) if is_ours(id) => {}
            (op::DECORATE, &[_, id, op::BINDING, _]) if is_ours(&id) => {
                put(out, opcode, &[id, op::BINDING, self.variables[&id].binding]);
            }
            (op::TYPE_STRUCT, &[_, id, member]) if self.singles.contains_key(&id) => {
                let (array, _) = self.singles[&id];
                put(out, op::TYPE_RUNTIME_ARRAY, &[array, member]);
                put(out, opcode, &[id, array]);
            }
            (op::ACCESS_CHAIN | op::IN_BOUNDS_ACCESS_CHAIN, [_, _, _, base, ..]) if is_ours(base) => {
                return self.access(out, opcode, of);
            }
            // Accesses to whole blocks do not occur in kernels.
            (op::LOAD | op::ARRAY_LENGTH | op::COPY_OBJECT | op::PTR_ACCESS_CHAIN, [_, _, _, id, ..])
            | (op::STORE, [_, id, ..])
                if is_ours(id) =>
            {
                return Err(format!("opcode {opcode} on a whole storage block"));
            }
            (op::COPY_MEMORY | op::FUNCTION_CALL, [_, ids @ ..]) if ids.iter().any(is_ours) => {
                return Err(format!("opcode {opcode} on a whole storage block"));
            }
            _ => out.extend_from_slice(of),
        }
        Ok(())
    }

    /// Rewrites a pointer into a storage block: adds the buffer's offset to the element index, and indexes a single
    /// struct by it.
    fn access(&mut self, out: &mut Vec<u32>, opcode: u32, of: &[u32]) -> Result<(), String> {
        let (variable, chain) = (&self.variables[&of[3]], &of[1..]);
        let Some((before, after)) = chain.split_at_checked(4) else { return Err("a pointer to a whole block".into()) };
        if !variable.is_array {
            put(out, opcode, &[before, &[variable.place], after].concat());
            return Ok(());
        }
        let Some((&index, after)) = after.split_first() else { return Err("a pointer to a whole array".into()) };
        put(out, op::ADD, &[self.uint, self.next, index, variable.place]);
        put(out, opcode, &[before, &[self.next], after].concat());
        self.next += 1;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::{count, first_binding, instructions, op, repack, stride};
    use crate::gpu::limits::PlanLimits;
    use crate::shaders::{self, ShaderDesc};

    fn words(shader: &ShaderDesc) -> Vec<u32> {
        shader.spirv.as_chunks::<4>().0.iter().map(|word| u32::from_le_bytes(*word)).collect()
    }

    /// Assigns three windows in turn.
    fn windows(shader: &ShaderDesc) -> Vec<u8> {
        (0..shader.storage_buffers()).map(|buffer| (buffer % 3) as u8).collect()
    }

    fn operands(of: &[u32], opcode: u32, decoration: u32) -> Vec<u32> {
        let all = instructions(of).expect("instructions");
        let found = all.iter().filter(|(found, of)| *found == opcode && of.get(2) == Some(&decoration));
        let mut found: Vec<u32> = found.filter_map(|(_, of)| of.get(3).copied()).collect();
        found.sort_unstable();
        found
    }

    #[test]
    fn every_kernel_can_share_bindings() {
        for shader in shaders::ALL {
            let (old, windows) = (words(shader), windows(shader));
            let new =
                repack(&old, shader.bindings, &windows).unwrap_or_else(|error| panic!("{}: {error}", shader.name));
            let first = first_binding(shader.bindings);
            let texels = shader.bindings.iter().filter(|binding| binding.kind == shaders::BindingKind::Texel);
            let texels = texels.map(|binding| binding.binding);
            let shared = windows.iter().map(|&window| first + u32::from(window));
            let mut wanted: Vec<u32> = texels.chain(shared).chain([first + count(&windows)]).collect();
            wanted.sort_unstable();
            assert_eq!(operands(&new, op::DECORATE, op::BINDING), wanted, "{}", shader.name);
            // Each pointer into a storage array has one more addition; the rest of the code is unchanged.
            let number = |of: &[u32], opcode| {
                instructions(of).expect("instructions").iter().filter(|(found, _)| *found == opcode).count()
            };
            assert!(number(&new, op::ADD) >= number(&old, op::ADD), "{}", shader.name);
            let loads = shader.storage_buffers() as usize;
            assert_eq!(number(&new, op::LOAD), number(&old, op::LOAD) + loads, "{}", shader.name);
            assert_eq!(number(&new, op::STORE), number(&old, op::STORE), "{}", shader.name);
        }
    }

    #[test]
    fn elements_start_at_whole_elements_of_a_window() {
        let alignment = PlanLimits { max_storage_buffers: 4, ..PlanLimits::default() }.packed().alignment();
        for binding in shaders::ALL.iter().flat_map(|shader| shader.bindings) {
            assert!(alignment.is_multiple_of(stride(binding)), "{binding:?}");
        }
    }

    #[test]
    fn other_modules_are_refused() {
        let shader = shaders::ALL.iter().find(|shader| shader.storage_buffers() > 1).expect("a shader");
        let (own, windows) = (words(shader), windows(shader));
        let refused = |words: &[u32], windows: &[u8]| repack(words, shader.bindings, windows).expect_err("refused");
        assert!(refused(&own[..3], &windows).contains("no header"));
        assert!(refused(&[&own[..], &[op::LOAD | 4 << 16]].concat(), &windows).contains("a broken instruction"));
        assert!(refused(&own, &windows[1..]).contains("windows for"));
        assert!(refused(&own[..op::HEADER], &windows).contains("0 functions"));
        let mut whole = own.clone();
        let all = instructions(&own).expect("instructions");
        let variable = all.iter().find(|(found, of)| *found == op::VARIABLE && of[3] == op::STORAGE_BUFFER);
        let (_, variable) = variable.expect("a storage variable");
        whole.extend_from_slice(&[op::ARRAY_LENGTH | 5 << 16, variable[1], own[op::BOUND], variable[2], 0]);
        assert!(refused(&whole, &windows).contains("on a whole storage block"));
    }
}
