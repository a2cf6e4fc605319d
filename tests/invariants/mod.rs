//! What must not change a result: kernel shapes, memory, barriers, threads, overflows. And scenes at the edge.

mod edges;
mod images;
mod processes;
mod resume;
mod shapes;
pub mod training;
