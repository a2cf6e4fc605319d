//! PLY files: the standard 3DGS layout with an optional `label` column, and plain coloured points.
//!
//! Headers are read and written by the `ply-rs-bw` crate, behind a cap on their length. Rows are decoded here: a splat
//! file has 62 columns and millions of rows, and the crate's own row reader asks for each value by name and
//! returns a value per row only; a scene is wanted column by column, in any order and any scalar type.

mod gaussians;
mod points;
mod table;

pub use gaussians::{ReadPly, read_gaussians, write_gaussians};
pub use points::read_points;
