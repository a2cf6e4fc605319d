//! HTML pages of a training or of scores, in the frame of `web`.

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
