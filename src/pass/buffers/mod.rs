//! The buffers of the engine: what each holds, what its elements stand for, and how many there are.

mod domains;
mod table;

pub use domains::Capacity;
pub use table::TABLE;
