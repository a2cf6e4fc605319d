//! Results do not depend on kernel shapes, memory, barriers, threads or overflows. Also: edge cases of scenes.

mod edges;
mod images;
mod processes;
mod resume;
mod shapes;
pub mod training;
