//! Generated interface of the GLSL shaders, and the types that it is made of.
//!
//! `build.rs` compiles every `glsl/**/*.comp`, reflects the SPIR-V and writes one module per shader stem with
//! `Bindings<B>` (field names are the GLSL names), `Push`, `Spec` and one [`ShaderDesc`] per variant. Layouts, bindings
//! and access are written in GLSL and nowhere else.

/// What a shader does with a binding; from the GLSL qualifiers `readonly` and `writeonly`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// `readonly`, and every texel buffer.
    Read,
    /// `writeonly`.
    Write,
    /// Neither.
    ReadWrite,
}

/// How a buffer is bound.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BindingKind {
    /// `buffer` block.
    Storage,
    /// `uniform textureBuffer` or `utextureBuffer`; the view's format is the buffer's (see `plan::buffers`).
    Texel,
}

/// One binding of a shader, set 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BindingDesc {
    /// GLSL name: the block's only member, or the texel buffer's variable.
    pub name: &'static str,
    /// Binding number.
    pub binding: u32,
    /// How it is bound.
    pub kind: BindingKind,
    /// What is done with it.
    pub access: Access,
    /// Bytes of one element of the runtime array, or of the whole struct; 0 for texel buffers.
    pub element_bytes: u32,
}

/// One specialisation constant (always 32 bits).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SpecDesc {
    /// GLSL name.
    pub name: &'static str,
    /// constant_id.
    pub id: u32,
    /// Bits of the default value.
    pub default: u32,
}

/// One compiled variant of a shader.
#[derive(Debug)]
pub struct ShaderDesc {
    /// Stem of the file, such as `blend_forward`.
    pub stem: &'static str,
    /// Name of the variant, such as `blend_forward_texel`.
    pub name: &'static str,
    /// SPIR-V bytes, length a multiple of 4.
    pub spirv: &'static [u8],
    /// Bindings in the order of the fields of `Bindings<B>`, which is the order of binding numbers.
    pub bindings: &'static [BindingDesc],
    /// Bytes of push constants.
    pub push_bytes: u32,
    /// Specialisation constants in the order of the fields of `Spec`.
    pub spec: &'static [SpecDesc],
    /// True if the shader uses subgroup operations, so that the subgroup size must be pinned.
    pub uses_subgroups: bool,
}
