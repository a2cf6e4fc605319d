//! Declarations of a shader: bindings, specialisation constants and the structs in them.

use std::collections::BTreeMap;

/// Access of a shader to a binding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// `readonly`, and every texel buffer.
    Read,
    /// `writeonly`.
    Write,
    /// Neither qualifier.
    ReadWrite,
}

/// How a buffer is bound.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// `buffer` block.
    Storage,
    /// `textureBuffer`.
    Texel,
}

/// One binding.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Binding {
    /// Name of the only member of the block, or of the texel buffer.
    pub name: String,
    /// Descriptor set.
    pub set: u32,
    /// Binding number.
    pub binding: u32,
    /// Storage or texel buffer.
    pub kind: Kind,
    /// Read, written or both.
    pub access: Access,
    /// Bytes of an element of the runtime array, or of the struct; 0 for texel buffers.
    pub element_bytes: u32,
}

/// A GLSL type as Rust writes it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Type {
    /// Rust text, such as `[f32; 3]` or `super::structs::Counters`.
    pub rust: String,
    /// Bytes without padding.
    pub bytes: u32,
    /// Alignment in std430.
    pub align: u32,
}

/// One member of a struct.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Field {
    /// GLSL name.
    pub name: String,
    /// Its type.
    pub ty: Type,
    /// Byte offset.
    pub offset: u32,
}

/// A struct type in a block.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Struct {
    /// GLSL name.
    pub name: String,
    /// Members in order.
    pub fields: Vec<Field>,
    /// Bytes; there is no padding.
    pub bytes: u32,
}

/// A constant of a pass: a specialisation constant, or a word pushed before the dispatch.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SpecConstant {
    /// GLSL name, or `LOCAL_SIZE_X` and so on.
    pub name: String,
    /// constant_id, or the index of the pushed word.
    pub id: u32,
    /// Whether it is pushed.
    pub is_pushed: bool,
    /// `u32`, `i32`, `f32` or `bool`.
    pub rust: &'static str,
    /// Bits of the default.
    pub default: u32,
}

/// Invocations on one axis of a workgroup.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LocalSize {
    /// A number.
    Fixed(u32),
    /// The specialisation constant of this id.
    Constant(u32),
}

impl Default for LocalSize {
    fn default() -> Self {
        Self::Fixed(1)
    }
}

/// Something that reflection cannot represent or that breaks a rule: a name to look for in the source, and the rule.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// A name to look for in the source.
    pub name: String,
    /// The rule's text.
    pub rule: String,
}

/// The interface of a module.
#[derive(Clone, Debug, Default)]
pub struct Interface {
    /// In the order of binding numbers.
    pub bindings: Vec<Binding>,
    /// Specialisation constants in the order of ids, then pushed words that are used.
    pub spec: Vec<SpecConstant>,
    /// Words of the block of pushed words.
    pub pushed_words: u32,
    /// Struct types used in blocks, by name.
    pub structs: BTreeMap<String, Struct>,
    /// Invocations on each axis of a workgroup.
    pub local_size: [LocalSize; 3],
    /// Whether subgroup operations are used.
    pub uses_subgroups: bool,
    /// Problems of the module.
    pub problems: Vec<Problem>,
}
