//! PLY files as tables, and the plain coloured points in some; models are read by [`super::model`].
//!
//! Headers are read and written by the `ply-rs-bw` crate, behind a cap on their length. Rows are decoded here: a splat
//! file has 62 columns and millions of rows, and the crate's own row reader asks for each value by name and
//! returns a value per row only; a scene is wanted column by column, in any order and any scalar type.

mod points;
mod table;

pub use points::read_points;
pub(super) use table::Table;
