//! `labelgs eval`: the scores of a model against the photos and masks of its scene.

mod args;
mod score;
mod table;

pub(crate) use args::EvalArgs;
pub(crate) use score::{run, score};
