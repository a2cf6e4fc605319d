//! HTML pages that open from disk: style and script are inside, and nothing is asked from the network. All text goes
//! through `maud`, which escapes it.

pub(crate) mod axis;
pub(crate) mod chart;
pub(crate) mod figure;
pub(crate) mod page;
pub(crate) mod panels;
pub(crate) mod series;
pub(crate) mod text;

pub(crate) use chart::{Chart, Mark};
pub(crate) use figure::{Figure, Panel};
pub(crate) use page::{page, section};
pub(crate) use series::Series;
