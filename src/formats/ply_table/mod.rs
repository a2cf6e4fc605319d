//! An element of a PLY file as a table; `super::ply` reads models from the elements of a file.
//!
//! The crate `ply-rs-bw` reads and writes headers; their length is limited. Rows are decoded here, column by column, in
//! any order and of any scalar type: a 3DGS file has 62 columns and millions of rows, and the row reader of the crate
//! asks for each value by name.

mod header;
mod stored;
mod table;

pub use table::Table;
