//! HTML pages of a training or of scores, in the frame of `labelgs_web`.

pub mod axis;
pub mod chart;
pub mod figure;
pub mod page;
pub mod panels;
pub mod series;
pub mod sheet;
pub mod text;

pub use axis::Scale;
pub use chart::{Chart, Digits, Mark};
pub use figure::{Figure, Panel};
pub use page::{page, section};
pub use series::Series;
