//! Kernels that count their accesses: every load, store and atomic of a storage buffer also sets a bit for each sector
//! of memory that it touches. The offsets come from the SPIR-V alone.

use super::scene::SECTOR;
use labelgs::internals::shaders::{Access, BindingDesc, BindingKind, ShaderDesc};
use labelgs::{Error, Result};
use rspirv::binary::Assemble;
use rspirv::dr::{Builder, Instruction, Module, Operand, load_bytes};
use rspirv::spirv::{Decoration, Op, StorageClass, Word};
use std::collections::HashMap;

/// Number of the binding of the bits; no kernel has so many.
const BINDING: u32 = 60;

/// Scope of a device, in SPIR-V.
const DEVICE: u32 = 1;

/// The same kernel with a further binding, `sectors`: for the binding at place `i`, `words` words of bits for sectors
/// read, from word `2 i words`, then as many for sectors written.
pub fn counting(shader: &ShaderDesc, words: u32) -> Result<&'static ShaderDesc> {
    let bad = |what: String| Error::Check(format!("{}: {what}", shader.name));
    let module = load_bytes(shader.spirv).map_err(|error| bad(error.to_string()))?;
    let spirv = Instrument::new(module, shader, words).map_err(bad)?.run().map_err(bad)?;
    let own = BindingDesc {
        name: "sectors",
        binding: BINDING,
        kind: BindingKind::Storage,
        access: Access::ReadWrite,
        element_bytes: 4,
    };
    let bindings: Vec<BindingDesc> = shader.bindings.iter().copied().chain([own]).collect();
    let bytes: Vec<u8> = spirv.iter().flat_map(|word| word.to_le_bytes()).collect();
    Ok(Box::leak(Box::new(ShaderDesc {
        stem: shader.stem,
        name: shader.name,
        macros: shader.macros,
        spirv: bytes.leak(),
        bindings: bindings.leak(),
        spec: shader.spec,
        local_size: shader.local_size,
        uses_subgroups: shader.uses_subgroups,
    })))
}

/// Part of a buffer that a pointer points to.
#[derive(Clone)]
struct Place {
    /// Position of the binding among the shader's.
    slot: u32,
    /// Byte offset: a number, and indices with their strides.
    offset: u32,
    terms: Vec<(Word, u32)>,
    /// Type of the value.
    kind: Word,
}

/// A module in work.
struct Instrument {
    module: Module,
    types: HashMap<Word, Instruction>,
    places: HashMap<Word, Place>,
    words: u32,
    uint: Word,
    pointer: Word,
    bits: Word,
    constants: HashMap<u32, Word>,
}

type Outcome<T> = std::result::Result<T, String>;

impl Instrument {
    fn new(module: Module, shader: &ShaderDesc, words: u32) -> Outcome<Self> {
        let mut builder = Builder::new_from_module(module);
        let uint = builder.type_int(32, 0);
        // A type of its own: the kernel's may already have a stride.
        let id = builder.id();
        let array = builder.type_runtime_array_id(Some(id), uint);
        builder.decorate(array, Decoration::ArrayStride, [Operand::LiteralBit32(4)]);
        let block = builder.type_struct([array]);
        builder.decorate(block, Decoration::Block, []);
        builder.member_decorate(block, 0, Decoration::Offset, [Operand::LiteralBit32(0)]);
        let of_block = builder.type_pointer(None, StorageClass::StorageBuffer, block);
        let pointer = builder.type_pointer(None, StorageClass::StorageBuffer, uint);
        let bits = builder.variable(of_block, None, StorageClass::StorageBuffer, None);
        builder.decorate(bits, Decoration::DescriptorSet, [Operand::LiteralBit32(0)]);
        builder.decorate(bits, Decoration::Binding, [Operand::LiteralBit32(BINDING)]);
        let mut module = builder.module();
        for entry in &mut module.entry_points {
            entry.operands.push(Operand::IdRef(bits));
        }
        let values = module.types_global_values.iter();
        let types = values.filter_map(|value| value.result_id.map(|id| (id, value.clone()))).collect();
        let mut made =
            Self { module, types, places: HashMap::new(), words, uint, pointer, bits, constants: HashMap::new() };
        made.variables(shader)?;
        Ok(made)
    }

    /// Places of the variables of the shader's bindings.
    fn variables(&mut self, shader: &ShaderDesc) -> Outcome<()> {
        let variables: Vec<Instruction> =
            self.types.values().filter(|value| value.class.opcode == Op::Variable).cloned().collect();
        for variable in variables {
            let id = variable.result_id.unwrap_or(0);
            if id == self.bits || variable.operands.first() != Some(&Operand::StorageClass(StorageClass::StorageBuffer))
            {
                continue;
            }
            let binding = self.decoration(id, Decoration::Binding).ok_or("a buffer without a binding")?;
            let slot = shader.bindings.iter().position(|found| found.binding == binding);
            let slot = slot.ok_or_else(|| format!("binding {binding} is not in the interface"))? as u32;
            let kind = reference(&self.types[&variable.result_type.unwrap_or(0)], 1)?;
            self.places.insert(id, Place { slot, offset: 0, terms: Vec::new(), kind });
        }
        Ok(())
    }

    fn run(mut self) -> Outcome<Vec<u32>> {
        let mut functions = std::mem::take(&mut self.module.functions);
        for block in functions.iter_mut().flat_map(|function| &mut function.blocks) {
            let mut out = Vec::new();
            for instruction in std::mem::take(&mut block.instructions) {
                self.instruction(&instruction, &mut out)?;
                out.push(instruction);
            }
            block.instructions = out;
        }
        self.module.functions = functions;
        Ok(self.module.assemble())
    }

    fn instruction(&mut self, instruction: &Instruction, out: &mut Vec<Instruction>) -> Outcome<()> {
        let op = instruction.class.opcode;
        let name = format!("{op:?}");
        let atomic = name.starts_with("Atomic");
        match op {
            Op::AccessChain | Op::InBoundsAccessChain => {
                if let Some(base) = self.places.get(&reference(instruction, 0)?).cloned() {
                    let place = self.walk(base, &instruction.operands[1..])?;
                    self.places.insert(instruction.result_id.unwrap_or(0), place);
                }
                Ok(())
            }
            Op::Load | Op::Store => self.access(reference(instruction, 0)?, op == Op::Load, op == Op::Store, out),
            _ if atomic => self.access(reference(instruction, 0)?, true, true, out),
            // Anything else that takes a pointer to a buffer would go uncounted.
            _ => {
                let mut ids = instruction.operands.iter().filter_map(Operand::id_ref_any);
                match ids.find(|id| self.places.contains_key(id)) {
                    Some(_) => Err(format!("{name} uses a pointer to a buffer")),
                    None => Ok(()),
                }
            }
        }
    }

    /// Follows the indices of an access chain.
    fn walk(&self, mut place: Place, indices: &[Operand]) -> Outcome<Place> {
        for index in indices {
            let index = index.id_ref_any().ok_or("an index that is no id")?;
            let kind = self.types.get(&place.kind).cloned().ok_or("a type that is not declared")?;
            match kind.class.opcode {
                Op::TypeStruct => {
                    let member = self.constant(index).ok_or("a member that is no constant")?;
                    let offset = self.member_decoration(place.kind, member, Decoration::Offset);
                    place.offset += offset.ok_or("a member without an offset")?;
                    place.kind = reference(&kind, member as usize)?;
                }
                Op::TypeArray | Op::TypeRuntimeArray => {
                    let stride =
                        self.decoration(place.kind, Decoration::ArrayStride).ok_or("an array without stride")?;
                    self.step(&mut place, index, stride);
                    place.kind = reference(&kind, 0)?;
                }
                Op::TypeVector => {
                    self.step(&mut place, index, 4);
                    place.kind = reference(&kind, 0)?;
                }
                other => return Err(format!("an index into {other:?}")),
            }
        }
        Ok(place)
    }

    fn step(&self, place: &mut Place, index: Word, stride: u32) {
        match self.constant(index) {
            Some(number) => place.offset += number * stride,
            None => place.terms.push((index, stride)),
        }
    }

    /// Bytes of a value of a type.
    fn size(&self, kind: Word) -> Outcome<u32> {
        let found = self.types.get(&kind).ok_or("a type that is not declared")?;
        match found.class.opcode {
            Op::TypeInt | Op::TypeFloat => Ok(4),
            Op::TypeVector => match found.operands.get(1) {
                Some(Operand::LiteralBit32(count)) => Ok(4 * count),
                _ => Err("a vector without a length".to_owned()),
            },
            Op::TypeStruct => {
                let mut end = 0;
                for member in 0..found.operands.len() as u32 {
                    let offset = self.member_decoration(kind, member, Decoration::Offset).ok_or("no offset")?;
                    end = end.max(offset + self.size(reference(found, member as usize)?)?);
                }
                Ok(end)
            }
            other => Err(format!("a whole {other:?} is read or written")),
        }
    }

    /// Marks the sectors of an access.
    fn access(&mut self, pointer: Word, read: bool, written: bool, out: &mut Vec<Instruction>) -> Outcome<()> {
        let Some(place) = self.places.get(&pointer).cloned() else { return Ok(()) };
        let size = self.size(place.kind)?;
        let sector = SECTOR as u32;
        let mut steps: Vec<u32> = (0..size).step_by(sector as usize).collect();
        let aligned = |bytes: u32| size.is_power_of_two() && size <= sector && bytes.is_multiple_of(size);
        if !(aligned(place.offset) && place.terms.iter().all(|(_, stride)| aligned(*stride))) {
            steps.push(size - 4);
        }
        let mut base = None;
        for &(index, stride) in &place.terms {
            let stride = self.number(stride);
            let product = self.emit(Op::IMul, &[index, stride], out);
            base = Some(base.map_or(product, |sum| self.emit(Op::IAdd, &[sum, product], out)));
        }
        for step in steps {
            let number = self.number(place.offset + step);
            let offset = base.map_or(number, |sum| self.emit(Op::IAdd, &[sum, number], out));
            if read {
                self.mark(offset, 2 * place.slot * self.words, out);
            }
            if written {
                self.mark(offset, (2 * place.slot + 1) * self.words, out);
            }
        }
        Ok(())
    }

    /// Sets the bit of the sector at a byte offset.
    fn mark(&mut self, offset: Word, first: u32, out: &mut Vec<Instruction>) {
        let [bits, five, low, one, first, zero, scope] =
            [SECTOR.log2() as u32, 5, 31, 1, first, 0, DEVICE].map(|n| self.number(n));
        let sector = self.emit(Op::ShiftRightLogical, &[offset, bits], out);
        let word = self.emit(Op::ShiftRightLogical, &[sector, five], out);
        let word = self.emit(Op::IAdd, &[word, first], out);
        let place = self.emit(Op::BitwiseAnd, &[sector, low], out);
        let bit = self.emit(Op::ShiftLeftLogical, &[one, place], out);
        let cell = self.fresh();
        let operands = [self.bits, zero, word].map(Operand::IdRef).to_vec();
        out.push(Instruction::new(Op::AccessChain, Some(self.pointer), Some(cell), operands));
        let operands =
            vec![Operand::IdRef(cell), Operand::IdScope(scope), Operand::IdMemorySemantics(zero), Operand::IdRef(bit)];
        let result = self.fresh();
        out.push(Instruction::new(Op::AtomicOr, Some(self.uint), Some(result), operands));
    }

    fn emit(&mut self, op: Op, operands: &[Word], out: &mut Vec<Instruction>) -> Word {
        let result = self.fresh();
        let operands = operands.iter().map(|&id| Operand::IdRef(id)).collect();
        out.push(Instruction::new(op, Some(self.uint), Some(result), operands));
        result
    }

    fn fresh(&mut self) -> Word {
        let Some(header) = &mut self.module.header else { return 0 };
        header.bound += 1;
        header.bound - 1
    }

    /// Id of a constant.
    fn number(&mut self, value: u32) -> Word {
        if let Some(&id) = self.constants.get(&value) {
            return id;
        }
        let id = self.fresh();
        let constant = Instruction::new(Op::Constant, Some(self.uint), Some(id), vec![Operand::LiteralBit32(value)]);
        self.module.types_global_values.push(constant);
        self.constants.insert(value, id);
        id
    }

    /// Value of an id that is a plain constant.
    fn constant(&self, id: Word) -> Option<u32> {
        let found = self.types.get(&id).filter(|value| value.class.opcode == Op::Constant)?;
        match found.operands.first() {
            Some(Operand::LiteralBit32(value)) => Some(*value),
            _ => None,
        }
    }

    fn decoration(&self, id: Word, wanted: Decoration) -> Option<u32> {
        self.module.annotations.iter().find_map(|note| match note.operands.as_slice() {
            [Operand::IdRef(target), Operand::Decoration(found), Operand::LiteralBit32(value)]
                if note.class.opcode == Op::Decorate && *target == id && *found == wanted =>
            {
                Some(*value)
            }
            _ => None,
        })
    }

    fn member_decoration(&self, id: Word, member: u32, wanted: Decoration) -> Option<u32> {
        self.module.annotations.iter().find_map(|note| match note.operands.as_slice() {
            [
                Operand::IdRef(target),
                Operand::LiteralBit32(index),
                Operand::Decoration(found),
                Operand::LiteralBit32(value),
            ] if *target == id && *index == member && *found == wanted => Some(*value),
            _ => None,
        })
    }
}

/// An operand that is an id.
fn reference(instruction: &Instruction, index: usize) -> Outcome<Word> {
    let found = instruction.operands.get(index).and_then(Operand::id_ref_any);
    found.ok_or_else(|| format!("{:?} without an id", instruction.class.opcode))
}
