//! `labelgs transform`.

use crate::Result;
use crate::cli::support::parsers::{direction, factor, place};
use crate::cli::support::{Context, EditArgs, EditResult};
use crate::edit::Transform;
use clap::Args;
use glam::{DQuat, DVec3};
use serde_json::json;

/// `labelgs transform`.
#[derive(Args, Clone, Debug)]
#[command(group(clap::ArgGroup::new("change").required(true).multiple(true).args(["up", "scale", "origin"])))]
pub struct TransformArgs {
    #[command(flatten)]
    pub edit: EditArgs,
    /// Up direction of the model: x, -x, y, -y, z, -z or X,Y,Z. The model is rotated so that it becomes -y, which
    /// viewers of 3DGS files show as up. View-dependent colours are rotated too.
    #[arg(long, value_name = "DIRECTION", value_parser = direction, allow_hyphen_values = true)]
    pub up: Option<DVec3>,
    /// Multiply all lengths by this factor.
    #[arg(long, value_name = "FACTOR", value_parser = factor)]
    pub scale: Option<f64>,
    /// Point to move to 0,0,0, before rotation and scaling.
    #[arg(long, value_name = "X,Y,Z", value_parser = place, allow_hyphen_values = true)]
    pub origin: Option<DVec3>,
}

/// Writes the model at another place.
pub(crate) fn run(args: &TransformArgs, context: &Context) -> Result<()> {
    let (model, known) = args.edit.open()?;
    let turn = args.up.map_or(Ok(DQuat::IDENTITY), Transform::upright)?;
    let change = Transform { origin: args.origin.unwrap_or_default(), turn, scale: args.scale.unwrap_or(1.0) };
    let moved = change.apply(&model)?;
    let turn = [turn.w, turn.x, turn.y, turn.z];
    let more = json!({ "origin": change.origin.to_array(), "turn_wxyz": turn, "scale": change.scale });
    let edited = EditResult { moved: Some(change), ..EditResult::with_labels_of(&moved, known, model.len()) };
    args.edit.finish(context, &edited, more)
}
