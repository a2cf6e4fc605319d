//! An element of a PLY file as a table. `super::ply` builds models from the elements of a file.
//!
//! The crate `ply-rs-bw` reads and writes headers, whose length is limited here. Rows are decoded here, column by
//! column, in any order and of any scalar type. A 3DGS file has 62 columns and millions of rows, and the crate's row
//! reader looks up every value by name.

mod header;
mod stored;
mod table;

pub use table::Table;
