//! HTML pages that open from disk: style and script are inside, and nothing is asked from the network. All text goes
//! through `maud`, which escapes it.

pub mod axis;
pub mod chart;
pub mod figure;
pub mod page;
pub mod panels;
pub mod series;
pub mod text;

pub use chart::{Chart, Mark};
pub use figure::{Figure, Panel};
pub use page::{page, section};
pub use series::Series;
