//! Blocks, branches and phis of the entry point.

use super::arithmetic::Words;
use super::constants::Globals;
use super::memory::Pointer;
use super::types::{Id, Type};
use super::{Result, id, literal};
use crate::program::{BindingUse, Exchange, Instruction, Program, Register, Source, Space};
use rspirv::dr;
use rspirv::spirv::{Op, StorageClass};
use std::collections::HashMap;

/// What a function becomes, while it is read.
pub struct Lowering<'a> {
    pub(super) globals: &'a Globals,
    pub(super) program: Program,
    values: HashMap<Id, Words>,
    types: HashMap<Id, Id>,
    pub(super) pointers: HashMap<Id, Pointer>,
    /// Texel buffers that were loaded.
    images: HashMap<Id, u16>,
    /// Places of constants.
    pool: HashMap<u32, Source>,
    next_register: Register,
    /// Phis of each block: the result's registers, and the source by the block before.
    phis: HashMap<Id, Vec<(Words, HashMap<Id, Id>)>>,
    /// Where blocks and moves between blocks start. Targets are labels until the end.
    starts: HashMap<Id, u32>,
    next_label: Id,
    origin: u32,
}

/// Lowers the function.
pub fn lower(globals: &Globals, function: &dr::Function) -> Result<Program> {
    let mut lowering = Lowering::new(globals)?;
    for instruction in function.blocks.iter().flat_map(|block| &block.instructions) {
        if instruction.class.opcode == Op::Variable {
            lowering.local(instruction)?;
        }
    }
    lowering.phis(function)?;
    for block in &function.blocks {
        let label = block.label.as_ref().and_then(|label| label.result_id).ok_or("a block without a label")?;
        lowering.starts.insert(label, lowering.program.code.len() as u32);
        lowering.count("Label");
        for instruction in &block.instructions {
            lowering.count(instruction.class.opname);
            lowering.instruction(label, instruction).map_err(|what| format!("not supported: {what}"))?;
        }
    }
    lowering.finish()
}

impl<'a> Lowering<'a> {
    fn new(globals: &'a Globals) -> Result<Self> {
        let mut new = Self {
            globals,
            program: Program { granule: 4, ..Program::default() },
            values: HashMap::new(),
            types: HashMap::new(),
            pointers: HashMap::new(),
            images: HashMap::new(),
            pool: HashMap::new(),
            next_register: 0,
            phis: HashMap::new(),
            starts: HashMap::new(),
            next_label: 1 << 30,
            origin: 0,
        };
        for variable in &globals.variables {
            let space = match (variable.class, variable.binding, variable.builtin) {
                (StorageClass::Input, _, Some(builtin)) => {
                    let words = globals.types.words(variable.of)?;
                    new.program.builtins.push((builtin, new.next_register));
                    new.region(words)
                }
                (
                    StorageClass::StorageBuffer | StorageClass::Uniform | StorageClass::UniformConstant,
                    Some(number),
                    _,
                ) => {
                    let (is_written, is_coherent) = (false, variable.is_coherent);
                    new.program.bindings.push(BindingUse { number, is_written, is_coherent });
                    Space::Buffer(new.program.bindings.len() as u16 - 1)
                }
                (StorageClass::PushConstant, ..) => Space::Push,
                (StorageClass::Private, ..) => new.region(globals.types.words(variable.of)?),
                (StorageClass::Workgroup, ..) => {
                    let first = new.program.shared_words;
                    new.program.shared_words += globals.types.words(variable.of)?;
                    let mut pointer = Pointer::new(Space::Shared, variable.of);
                    pointer.place.plus = first;
                    new.pointers.insert(variable.id, pointer);
                    continue;
                }
                other => return Err(format!("variables of {other:?}")),
            };
            new.pointers.insert(variable.id, Pointer::new(space, variable.of));
        }
        Ok(new)
    }

    /// Reserves registers for a variable.
    fn region(&mut self, words: u32) -> Space {
        let first = self.next_register;
        self.next_register += words;
        self.program.registers = self.next_register;
        Space::Local(first)
    }

    fn local(&mut self, from: &dr::Instruction) -> Result<()> {
        let Type::Pointer(_, of) = *self.globals.types.get(from.result_type.unwrap_or_default())? else {
            return Err("a variable that is no pointer".to_owned());
        };
        let space = self.region(self.globals.types.words(of)?);
        self.pointers.insert(from.result_id.unwrap_or_default(), Pointer::new(space, of));
        Ok(())
    }

    fn count(&mut self, opcode: &'static str) {
        self.origin = self.program.opcodes.len() as u32;
        self.program.opcodes.push(opcode);
    }

    pub(super) fn emit(&mut self, instruction: Instruction) {
        self.program.code.push(instruction);
        self.program.origins.push(self.origin);
    }

    fn register(&mut self) -> Register {
        self.next_register += 1;
        self.next_register - 1
    }

    pub(super) fn new_word(&mut self, make: impl FnOnce(Register) -> Instruction) -> Source {
        let to = self.register();
        self.emit(make(to));
        Source(to)
    }

    pub(super) fn constant(&mut self, value: u32) -> Source {
        let constants = &mut self.program.constants;
        *self.pool.entry(value).or_insert_with(|| {
            constants.push(value);
            Source::constant(constants.len() - 1)
        })
    }

    /// Value of a word that is a constant.
    pub(super) fn known(&self, word: Source) -> Option<u32> {
        word.place().ok().map(|place| self.program.constants[place])
    }

    pub(super) fn type_of(&self, id: Id) -> Result<Id> {
        self.types.get(&id).copied().ok_or_else(|| format!("the type of %{id}"))
    }

    pub(super) fn value(&self, operands: &[dr::Operand], at: usize) -> Result<Words> {
        let id = id(operands, at)?;
        self.values.get(&id).cloned().ok_or_else(|| format!("%{id} as a value"))
    }

    /// Gives registers to the results of all phis, and values to constants.
    fn phis(&mut self, function: &dr::Function) -> Result<()> {
        for (id, words) in &self.globals.constants {
            let words = words.iter().map(|word| self.constant(*word)).collect();
            self.values.insert(*id, words);
        }
        for block in &function.blocks {
            let label = block.label.as_ref().and_then(|label| label.result_id).unwrap_or_default();
            for phi in block.instructions.iter().filter(|instruction| instruction.class.opcode == Op::Phi) {
                let (of, operands) = (phi.result_type.unwrap_or_default(), &phi.operands);
                let words: Words = (0..self.globals.types.words(of)?).map(|_| Source(self.register())).collect();
                let pair = |at: usize| Ok((id(operands, 2 * at + 1)?, id(operands, 2 * at)?));
                let sources = (0..operands.len() / 2).map(pair).collect::<Result<HashMap<_, _>>>()?;
                self.values.insert(phi.result_id.unwrap_or_default(), words.clone());
                self.types.insert(phi.result_id.unwrap_or_default(), of);
                self.phis.entry(label).or_default().push((words, sources));
            }
        }
        Ok(())
    }

    fn instruction(&mut self, block: Id, from: &dr::Instruction) -> Result<()> {
        let operands = &from.operands;
        let words = match from.class.opcode {
            Op::Phi | Op::SelectionMerge | Op::LoopMerge | Op::Line | Op::NoLine => return Ok(()),
            Op::Variable => {
                let Some(initial) = operands.get(1).and(self.value(operands, 1).ok()) else { return Ok(()) };
                let to = self.pointers[&from.result_id.unwrap_or_default()];
                return self.store(&to, &initial);
            }
            Op::Store => {
                let (to, words) = (self.pointer(operands, 0)?, self.value(operands, 1)?);
                return self.store(&to, &words);
            }
            Op::AccessChain | Op::InBoundsAccessChain => {
                let pointer = self.access_chain(operands)?;
                self.pointers.insert(from.result_id.unwrap_or_default(), pointer);
                return Ok(());
            }
            Op::MemoryBarrier => {
                let semantics = self.semantics(operands, 0)?;
                self.emit(Instruction::Fence { semantics, is_part: false });
                return Ok(());
            }
            Op::ControlBarrier => return self.barrier(operands),
            Op::Branch | Op::BranchConditional | Op::Switch | Op::Return | Op::Unreachable => {
                return self.terminator(block, from);
            }
            Op::Load => {
                let pointer = self.pointer(operands, 0)?;
                match (self.globals.types.get(pointer.of)?, pointer.place.space) {
                    (Type::Other, Space::Buffer(binding)) => {
                        self.images.insert(from.result_id.unwrap_or_default(), binding);
                        return Ok(());
                    }
                    _ => self.load(&pointer)?,
                }
            }
            Op::ArrayLength => self.length(operands)?,
            Op::ImageFetch => {
                let binding = *self.images.get(&id(operands, 0)?).ok_or("an image that was not loaded")?;
                let index = self.value(operands, 1)?[0];
                let fetch = |component| self.new_word(|to| Instruction::Fetch { to, binding, index, component });
                (0..4).map(fetch).collect()
            }
            _ => match self.exchange(from)? {
                Some(words) => words,
                None => match self.atomic(from)? {
                    Some(words) => words,
                    None => self.arithmetic(from)?.ok_or_else(|| format!("Op{}", from.class.opname))?,
                },
            },
        };
        if let (Some(id), Some(of)) = (from.result_id, from.result_type) {
            self.values.insert(id, words);
            self.types.insert(id, of);
        }
        Ok(())
    }

    /// Elements of a runtime array.
    fn length(&mut self, operands: &[dr::Operand]) -> Result<Words> {
        let pointer = self.pointer(operands, 0)?;
        let (Space::Buffer(binding), Type::Struct(members)) =
            (pointer.place.space, self.globals.types.get(pointer.of)?)
        else {
            return Err("the length of what is no buffer".to_owned());
        };
        let member = literal(operands, 1)?;
        let (plus, _) = self.globals.types.member(pointer.of, member)?;
        let stride = self.globals.types.stride(members[member as usize], None)?;
        Ok(vec![self.new_word(|to| Instruction::Length { to, binding, plus, stride })])
    }

    fn barrier(&mut self, operands: &[dr::Operand]) -> Result<()> {
        let execution = self.known(self.value(operands, 0)?[0]).ok_or("a computed scope")?;
        let semantics = self.semantics(operands, 1)?;
        match execution {
            2 => self.emit(Instruction::Barrier(semantics)),
            3 => {
                let nothing = self.constant(0);
                self.new_word(|to| Instruction::Exchange { op: Exchange::Barrier, to, a: nothing, b: nothing });
            }
            other => return Err(format!("barriers of scope {other}")),
        }
        Ok(())
    }

    fn terminator(&mut self, block: Id, from: &dr::Instruction) -> Result<()> {
        let operands = &from.operands;
        match from.class.opcode {
            Op::Branch => {
                let to = id(operands, 0)?;
                self.moves(block, to)?;
                self.emit(Instruction::Jump(to));
            }
            Op::BranchConditional => {
                let condition = self.value(operands, 0)?[0];
                let [yes, no] = [id(operands, 1)?, id(operands, 2)?];
                let [first, second] = [self.edge(yes), self.edge(no)];
                self.emit(Instruction::Branch { condition, yes: first, no: second });
                self.edge_moves(block, &[(first, yes), (second, no)])?;
            }
            Op::Switch => {
                let value = self.value(operands, 0)?[0];
                let default = id(operands, 1)?;
                let pair = |at: usize| Ok((literal(operands, at)?, id(operands, at + 1)?));
                let targets = (2..operands.len()).step_by(2).map(pair).collect::<Result<Vec<_>>>()?;
                let first = self.edge(default);
                let cases = targets.iter().map(|&(case, to)| (case, self.edge(to))).collect::<Vec<_>>();
                self.emit(Instruction::Switch { value, default: first, cases: cases.clone() });
                let edges = cases.iter().zip(&targets).map(|(&(_, edge), &(_, to))| (edge, to));
                self.edge_moves(block, &edges.chain([(first, default)]).collect::<Vec<_>>())?;
            }
            _ => self.emit(Instruction::Return),
        }
        Ok(())
    }

    /// Label that a branch goes to: the block, or moves before it.
    fn edge(&mut self, to: Id) -> Id {
        if !self.phis.contains_key(&to) {
            return to;
        }
        self.next_label += 1;
        self.next_label
    }

    fn edge_moves(&mut self, block: Id, edges: &[(Id, Id)]) -> Result<()> {
        for &(label, to) in edges.iter().filter(|(label, to)| label != to) {
            self.starts.insert(label, self.program.code.len() as u32);
            self.moves(block, to)?;
            self.emit(Instruction::Jump(to));
        }
        Ok(())
    }

    /// Moves the sources of phis to their results, all at once.
    fn moves(&mut self, block: Id, to: Id) -> Result<()> {
        let mut pairs = Vec::new();
        for (results, sources) in self.phis.get(&to).into_iter().flatten() {
            let source = sources.get(&block).ok_or("a phi without this block")?;
            let words = self.values.get(source).ok_or_else(|| format!("%{source} in a phi"))?;
            pairs.extend(results.iter().copied().zip(words.iter().copied()).filter(|(to, from)| to != from));
        }
        if pairs.iter().any(|(to, _)| pairs.iter().any(|(_, from)| from == to)) {
            for (_, from) in &mut pairs {
                let source = *from;
                *from = self.new_word(|to| Instruction::Move { to, from: source });
            }
        }
        for (to, from) in pairs {
            self.emit(Instruction::Move { to: to.0, from });
        }
        Ok(())
    }

    /// Replaces labels by places in the code.
    fn finish(mut self) -> Result<Program> {
        for instruction in &mut self.program.code {
            for label in instruction.targets() {
                *label = *self.starts.get(label).ok_or_else(|| format!("block %{label}"))?;
            }
            if matches!(instruction, Instruction::Load { width: 2, .. } | Instruction::Store { width: 2, .. }) {
                self.program.granule = 2;
            }
        }
        if self.program.code.len() >= 1 << 30 {
            return Err("a function this long".to_owned());
        }
        Ok(self.program)
    }
}
