//! Shaders and their Rust side.

mod registry; // every shader has a header, a mirror and a pass
pub mod shadergen; // the generator reports each fault of a shader
