//! The origin of a faraway scene, for example in UTM coordinates. Files store 32-bit positions relative to it, so that
//! no precision is lost. The origin itself is in `FILE.origin.json` beside the file, and in the file if its format
//! supports it.

use glam::DVec3;
use labelgs_files::{atomic, read};
use labelgs_scene::{Error, Result};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

const SCHEMA_VERSION: u32 = 1;
/// Extension of the origin file, appended to the full name of the model.
const ORIGIN_EXTENSION: &str = ".origin.json";

#[derive(Serialize, Deserialize)]
struct File {
    schema_version: u32,
    /// World position of the file's (0, 0, 0): world = file + origin.
    world_origin: [f64; 3],
    /// Number of Gaussians, to detect the file of another model.
    gaussians: u64,
}

/// Returns the path of the origin file beside a model.
pub(super) fn beside(model: &Path) -> PathBuf {
    let mut name = model.file_name().unwrap_or_default().to_owned();
    name.push(ORIGIN_EXTENSION);
    model.with_file_name(name)
}

/// Reads the origin beside a model of `count` Gaussians; 0 without a file. A file with another count belongs to another
/// model and is ignored, with a note.
pub(super) fn read(model: &Path, count: u64, notes: &mut Vec<String>) -> Result<DVec3> {
    let path = beside(model);
    if !path.is_file() {
        return Ok(DVec3::ZERO);
    }
    let expected = r#"expected {"schema_version": 1, "world_origin": [x, y, z], "gaussians": N}; correct or delete it"#;
    let file: File = read::json(&path, expected)?;
    read::require_version(&path, file.schema_version, SCHEMA_VERSION)?;
    let origin = DVec3::from_array(file.world_origin);
    if !origin.as_vec3().is_finite() {
        return Err(Error::data(&path, "world_origin", format!("is beyond the range of 32-bit floats; {expected}")));
    }
    if file.gaussians != count {
        let name = path.display();
        notes.push(format!(
            "{name} belongs to a model of {} Gaussians, but this one has {count}; it was ignored",
            file.gaussians
        ));
        return Ok(DVec3::ZERO);
    }
    Ok(origin)
}

/// Writes the origin file beside a model, or removes it if the origin is 0.
pub(super) fn write(model: &Path, origin: DVec3, gaussians: u64) -> Result<()> {
    let path = beside(model);
    if origin != DVec3::ZERO {
        let file = File { schema_version: SCHEMA_VERSION, world_origin: origin.to_array(), gaussians };
        return atomic::write_json(&path, &file);
    }
    atomic::remove(&path)
}
