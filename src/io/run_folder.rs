//! The folder of a training run, found from its model.

use std::path::{Path, PathBuf};

/// Configuration of the run, in TOML.
pub const CONFIG: &str = "config.toml";

/// The folder of the run that a model is in: `RUN` for `RUN` itself and for
/// `RUN/point_cloud/iteration_N/point_cloud.ply`; none for a PLY elsewhere.
pub fn of_model(model: &Path) -> Option<PathBuf> {
    if model.is_dir() {
        return Some(model.to_owned());
    }
    // A relative path may start below the run.
    let model = std::path::absolute(model).ok()?;
    let step = model.parent()?;
    let models = step.parent()?;
    let is_step = step.file_name()?.to_str()?.starts_with("iteration_");
    (is_step && models.file_name()? == "point_cloud").then(|| models.parent().map(Path::to_owned)).flatten()
}
