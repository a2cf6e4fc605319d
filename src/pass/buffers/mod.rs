//! The buffers of the engine: contents, domains and capacities.

mod domains;
mod table;

pub use domains::Capacity;
pub use table::TABLE;
