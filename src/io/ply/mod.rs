//! PLY files as tables, and coloured points in them; [`super::model`] reads models.
//!
//! The crate `ply-rs-bw` reads and writes headers; their length is limited. Rows are decoded here, column by column, in
//! any order and of any scalar type: a 3DGS file has 62 columns and millions of rows, and the row reader of the crate
//! asks for each value by name.

mod elements;
mod points;
mod stored;
mod table;

pub(super) use elements::Elements;
pub use points::read_points;
pub(super) use table::Table;
