//! Reads the interface of a shader from its SPIR-V module.

use super::interface::{Access, Binding, Field, Interface, Kind, LocalSize, Problem, SpecConstant, Struct, Type};
use rspirv::dr::{Instruction, Module, Operand};
use rspirv::spirv::{BuiltIn, Decoration, Dim, ExecutionMode, Op, StorageClass, Word};
use std::collections::{BTreeMap, BTreeSet, HashMap};

/// What to do about padding, which the Rust side does not support.
const PADDING_CURE: &str = "let a scalar follow each vec3, and add scalars at the end";

/// A module with lookup tables.
struct Reflector<'a> {
    module: &'a Module,
    names: HashMap<Word, &'a str>,
    member_names: HashMap<(Word, u32), &'a str>,
    values: HashMap<Word, &'a Instruction>,
    interface: Interface,
}

/// The interface that a module compiled without optimisation declares.
pub fn interface(module: &Module) -> Interface {
    let mut reflector = Reflector::new(module);
    reflector.bindings();
    reflector.spec_constants();
    reflector.pushed_words();
    reflector.interface.local_size = reflector.local_size();
    reflector.interface.uses_subgroups = module.capabilities.iter().any(|instruction| {
        matches!(instruction.operands.first(), Some(Operand::Capability(capability))
            if format!("{capability:?}").starts_with("GroupNonUniform"))
    });
    reflector.interface
}

/// Returns the binding numbers of the variables that some function of the module uses.
pub fn used_bindings(module: &Module) -> BTreeSet<u32> {
    let touched: BTreeSet<Word> = module
        .functions
        .iter()
        .flat_map(|function| function.all_inst_iter())
        .flat_map(|instruction| &instruction.operands)
        .filter_map(Operand::id_ref_any)
        .collect();
    let reflector = Reflector::new(module);
    touched.into_iter().filter_map(|id| reflector.decoration(id, Decoration::Binding)).collect()
}

fn word(instruction: &Instruction, index: usize) -> Word {
    match instruction.operands.get(index) {
        Some(Operand::IdRef(word) | Operand::LiteralBit32(word)) => *word,
        _ => 0,
    }
}

impl<'a> Reflector<'a> {
    fn new(module: &'a Module) -> Self {
        let mut names = HashMap::new();
        let mut member_names = HashMap::new();
        for instruction in &module.debug_names {
            match (instruction.class.opcode, instruction.operands.as_slice()) {
                (Op::Name, [Operand::IdRef(id), Operand::LiteralString(name)]) => {
                    names.insert(*id, name.as_str());
                }
                (Op::MemberName, [Operand::IdRef(id), Operand::LiteralBit32(index), Operand::LiteralString(name)]) => {
                    member_names.insert((*id, *index), name.as_str());
                }
                _ => {}
            }
        }
        let values =
            module.types_global_values.iter().filter_map(|value| value.result_id.map(|id| (id, value))).collect();
        Self { module, names, member_names, values, interface: Interface::default() }
    }

    fn name(&self, id: Word) -> String {
        self.names.get(&id).copied().unwrap_or("").to_owned()
    }

    fn problem(&mut self, name: &str, rule: impl Into<String>) {
        self.interface.problems.push(Problem { name: name.to_owned(), rule: rule.into() });
    }

    /// The literal of a decoration of `id`; 0 for a decoration without one.
    fn decoration(&self, id: Word, wanted: Decoration) -> Option<u32> {
        self.module.annotations.iter().find_map(|note| match note.operands.as_slice() {
            [Operand::IdRef(target), Operand::Decoration(decoration), rest @ ..]
                if note.class.opcode == Op::Decorate && *target == id && *decoration == wanted =>
            {
                Some(literal(rest))
            }
            _ => None,
        })
    }

    fn member_decoration(&self, id: Word, member: u32, wanted: Decoration) -> Option<u32> {
        self.module.annotations.iter().find_map(|note| match note.operands.as_slice() {
            [Operand::IdRef(target), Operand::LiteralBit32(index), Operand::Decoration(decoration), rest @ ..]
                if *target == id && *index == member && *decoration == wanted =>
            {
                Some(literal(rest))
            }
            _ => None,
        })
    }

    fn bindings(&mut self) {
        let module = self.module;
        for variable in module.types_global_values.iter().filter(|value| value.class.opcode == Op::Variable) {
            let (Some(id), Some(pointer)) = (variable.result_id, variable.result_type) else { continue };
            let Some(Operand::StorageClass(class)) = variable.operands.first() else { continue };
            let pointee = self.values.get(&pointer).map_or(0, |pointer| word(pointer, 1));
            match class {
                StorageClass::StorageBuffer => self.storage(id, pointee),
                StorageClass::UniformConstant => self.texel(id, pointee),
                StorageClass::Uniform => {
                    let name = self.name(pointee);
                    let rule = "uniform blocks are not supported; use a readonly buffer (READ1)";
                    self.problem(&name, rule);
                }
                _ => {}
            }
        }
        self.interface.bindings.sort_by_key(|binding| binding.binding);
    }

    fn storage(&mut self, id: Word, block: Word) {
        let block_name = self.name(block);
        let members = match self.values.get(&block) {
            Some(ty) if ty.class.opcode == Op::TypeStruct => ty.operands.len(),
            _ => 0,
        };
        if members != 1 {
            let rule = format!("storage block `{block_name}` has {members} members; it must have exactly one");
            return self.problem(&block_name, rule);
        }
        let name = self.member_names.get(&(block, 0)).copied().unwrap_or("").to_owned();
        let member = word(self.values[&block], 0);
        let has = |decoration| {
            self.member_decoration(block, 0, decoration).is_some() || self.decoration(id, decoration).is_some()
        };
        let access = match (has(Decoration::NonWritable), has(Decoration::NonReadable)) {
            (true, false) => Access::Read,
            (false, true) => Access::Write,
            (false, false) => Access::ReadWrite,
            (true, true) => {
                return self.problem(&name, format!("`{name}` is readonly and writeonly; keep one of them"));
            }
        };
        let element_bytes = self.element_bytes(&name, member);
        self.push_binding(id, name, Kind::Storage, access, element_bytes);
    }

    /// Bytes of an element of a runtime array, or of the whole thing.
    fn element_bytes(&mut self, name: &str, ty: Word) -> u32 {
        let Some(instruction) = self.values.get(&ty).copied() else { return 0 };
        if instruction.class.opcode != Op::TypeRuntimeArray {
            return self.ty(name, ty).map_or(0, |ty| ty.bytes);
        }
        let stride = self.decoration(ty, Decoration::ArrayStride).unwrap_or(0);
        let Some(element) = self.ty(name, word(instruction, 0)) else { return stride };
        self.tight(name, stride, &element);
        stride
    }

    fn tight(&mut self, name: &str, stride: u32, element: &Type) {
        if stride != element.bytes {
            let rule = format!(
                "elements of `{name}` are {stride} bytes apart and {} bytes long; std430 pads vec3 and structs to whole \
                 vectors",
                element.bytes
            );
            self.problem(name, rule);
        }
    }

    fn texel(&mut self, id: Word, ty: Word) {
        let name = self.name(id);
        let is_buffer = self.values.get(&ty).is_some_and(|ty| {
            ty.class.opcode == Op::TypeImage && matches!(ty.operands.get(1), Some(Operand::Dim(Dim::DimBuffer)))
        });
        if is_buffer {
            self.push_binding(id, name, Kind::Texel, Access::Read, 0);
        } else {
            self.problem(&name, format!("`{name}` is neither a storage block nor a textureBuffer"));
        }
    }

    fn push_binding(&mut self, id: Word, name: String, kind: Kind, access: Access, element_bytes: u32) {
        let set = self.decoration(id, Decoration::DescriptorSet).unwrap_or(0);
        let Some(binding) = self.decoration(id, Decoration::Binding) else {
            return self.problem(&name, format!("`{name}` has no binding number"));
        };
        self.interface.bindings.push(Binding { name, set, binding, kind, access, element_bytes });
    }

    /// A struct type with its offsets, named `name`.
    fn block(&mut self, id: Word, name: &str) -> Option<Struct> {
        let instruction = self.values.get(&id).copied()?;
        let mut fields: Vec<Field> = Vec::new();
        let (mut end, mut align) = (0, 1);
        for member in 0..instruction.operands.len() as u32 {
            let field = self.member_names.get(&(id, member)).copied().unwrap_or("").to_owned();
            let ty = self.ty(&field, word(instruction, member as usize))?;
            let offset = self.member_decoration(id, member, Decoration::Offset).unwrap_or(0);
            if offset != end {
                self.problem(&field, format!("`{field}` of `{name}` is at byte {offset}, not {end}; {PADDING_CURE}"));
            }
            align = align.max(ty.align);
            end = offset + ty.bytes;
            fields.push(Field { name: field, ty, offset });
        }
        if !end.is_multiple_of(align) {
            self.problem(
                name,
                format!("`{name}` ends at byte {end}, which std430 rounds up to multiples of {align}; {PADDING_CURE}"),
            );
        }
        Some(Struct { name: name.to_owned(), fields, bytes: end })
    }

    /// The Rust type of a GLSL type; problems are reported for `name`.
    fn ty(&mut self, name: &str, id: Word) -> Option<Type> {
        let instruction = self.values.get(&id).copied()?;
        match instruction.class.opcode {
            Op::TypeFloat => scalar('f', word(instruction, 0)),
            Op::TypeInt => scalar(if word(instruction, 1) == 1 { 'i' } else { 'u' }, word(instruction, 0)),
            Op::TypeVector => {
                let (element, length) = (self.ty(name, word(instruction, 0))?, word(instruction, 1));
                Some(Type { align: element.align * length.next_power_of_two(), ..array(&element, length) })
            }
            Op::TypeMatrix => {
                let column = self.ty(name, word(instruction, 0))?;
                Some(array(&column, word(instruction, 1)))
            }
            Op::TypeArray => {
                let element = self.ty(name, word(instruction, 0))?;
                let stride = self.decoration(id, Decoration::ArrayStride).unwrap_or(element.bytes);
                self.tight(name, stride, &element);
                let length = self.values.get(&word(instruction, 1)).map_or(0, |length| word(length, 0));
                Some(array(&element, length))
            }
            Op::TypeStruct => {
                let struct_name = self.name(id);
                let block = self.block(id, &struct_name)?;
                let align = block.fields.iter().map(|field| field.ty.align).max().unwrap_or(1);
                let ty = Type { rust: format!("super::structs::{struct_name}"), bytes: block.bytes, align };
                self.interface.structs.insert(struct_name, block);
                Some(ty)
            }
            _ => None,
        }
        .or_else(|| {
            self.problem(name, format!("`{name}` has a type that the Rust side cannot mirror"));
            None
        })
    }

    fn spec_constants(&mut self) {
        let module = self.module;
        let mut found: BTreeMap<u32, SpecConstant> = BTreeMap::new();
        for value in &module.types_global_values {
            let Some(id) = value.result_id else { continue };
            let Some(spec_id) = self.decoration(id, Decoration::SpecId) else { continue };
            let (rust, default) = match value.class.opcode {
                Op::SpecConstantTrue => ("bool", 1),
                Op::SpecConstantFalse => ("bool", 0),
                _ => (self.spec_type(value.result_type), word(value, 0)),
            };
            let mut name = self.name(id);
            if name.is_empty() {
                name = self.local_size_name(id);
            }
            let entry = SpecConstant { name, id: spec_id, is_pushed: false, rust, default };
            // `layout(local_size_x_id = 0)` beside a constant of id 0 gives two values; the named one is the constant.
            match found.get(&spec_id) {
                Some(old) if !old.name.starts_with("LOCAL_SIZE_") => {}
                _ => drop(found.insert(spec_id, entry)),
            }
        }
        self.interface.spec = found.into_values().collect();
    }

    /// Members of the block of pushed words that some function reads.
    fn pushed_words(&mut self) {
        let module = self.module;
        let is_pushed = |value: &&Instruction| {
            value.class.opcode == Op::Variable
                && matches!(value.operands.first(), Some(Operand::StorageClass(StorageClass::PushConstant)))
        };
        let Some(variable) = module.types_global_values.iter().find(is_pushed) else { return };
        let pointer = variable.result_type.and_then(|pointer| self.values.get(&pointer));
        let (id, block) = (variable.result_id.unwrap_or(0), pointer.map_or(0, |pointer| word(pointer, 1)));
        self.interface.pushed_words = self.values.get(&block).map_or(0, |block| block.operands.len() as u32);
        let chains = module.functions.iter().flat_map(|function| function.all_inst_iter());
        let read: BTreeSet<u32> = chains
            .filter(|instruction| instruction.class.opcode == Op::AccessChain && word(instruction, 0) == id)
            .filter_map(|chain| Some(word(self.values.get(&word(chain, 1))?, 0)))
            .collect();
        for member in read {
            let name = self.member_names.get(&(block, member)).copied().unwrap_or("").to_owned();
            let ty = self.values.get(&block).map(|block| word(block, member as usize));
            if self.spec_type(ty) != "u32"
                || self.member_decoration(block, member, Decoration::Offset) != Some(4 * member)
            {
                self.problem(&name, format!("`{name}` is pushed; it must be a uint"));
            }
            self.interface.spec.push(SpecConstant { name, id: member, is_pushed: true, rust: "u32", default: 0 });
        }
    }

    fn spec_type(&self, ty: Option<Word>) -> &'static str {
        match ty.and_then(|ty| self.values.get(&ty)) {
            Some(ty) if ty.class.opcode == Op::TypeFloat => "f32",
            Some(ty) if word(ty, 1) == 1 => "i32",
            _ => "u32",
        }
    }

    /// The constant with the size of a workgroup, if the execution mode does not state it.
    fn workgroup_size(&self) -> Option<&'a Instruction> {
        let is_size = |value: &&Instruction| {
            value.result_id.and_then(|id| self.decoration(id, Decoration::BuiltIn))
                == Some(BuiltIn::WorkgroupSize as u32)
        };
        self.module.types_global_values.iter().find(is_size)
    }

    /// Invocations on each axis. By the SPIR-V specification, the built-in takes precedence over the execution mode.
    fn local_size(&self) -> [LocalSize; 3] {
        if let Some(size) = self.workgroup_size() {
            let constant = |id| LocalSize::Fixed(self.values.get(&id).map_or(0, |value| word(value, 0)));
            return [0, 1, 2].map(|axis| {
                let id = word(size, axis);
                self.decoration(id, Decoration::SpecId).map_or_else(|| constant(id), LocalSize::Constant)
            });
        }
        let sizes = self.module.execution_modes.iter().find_map(|mode| match mode.operands.as_slice() {
            [_, Operand::ExecutionMode(ExecutionMode::LocalSize), sizes @ ..] => Some(sizes),
            _ => None,
        });
        let size = |axis| sizes.and_then(|sizes| sizes.get(axis)).map_or(0, |size| literal(std::slice::from_ref(size)));
        [0, 1, 2].map(|axis| LocalSize::Fixed(size(axis)))
    }

    fn local_size_name(&self, id: Word) -> String {
        let axis = self.workgroup_size().and_then(|size| (0..3).find(|axis| word(size, *axis) == id)).unwrap_or(0);
        format!("LOCAL_SIZE_{}", ["X", "Y", "Z"][axis])
    }
}

fn literal(operands: &[Operand]) -> u32 {
    match operands.first() {
        Some(Operand::LiteralBit32(value)) => *value,
        Some(Operand::BuiltIn(built_in)) => *built_in as u32,
        _ => 0,
    }
}

fn scalar(letter: char, bits: u32) -> Option<Type> {
    let known = if letter == 'f' { matches!(bits, 32 | 64) } else { matches!(bits, 8 | 16 | 32 | 64) };
    known.then(|| Type { rust: format!("{letter}{bits}"), bytes: bits / 8, align: bits / 8 })
}

fn array(element: &Type, length: u32) -> Type {
    Type { rust: format!("[{}; {length}]", element.rust), bytes: element.bytes * length, align: element.align }
}
