//! Which labelgs this is: its version and, of the program, its commit and features.

use std::sync::OnceLock;

/// The commit of the program. `main.rs` tells it: were it known here, every commit would compile the library anew.
static PROGRAM_COMMIT: OnceLock<&str> = OnceLock::new();

/// Features of the package, and whether this build has them.
const PACKAGE_FEATURES: [(&str, bool); 4] = [
    ("cli", cfg!(feature = "cli")),
    ("viewer", cfg!(feature = "viewer")),
    ("build-shaderc", cfg!(feature = "build-shaderc")),
    ("lab", cfg!(feature = "lab")),
];

/// Notes the commit of the program, once.
#[cfg(feature = "cli")]
pub(crate) fn note_commit(commit: Option<&'static str>) {
    if let Some(commit) = commit {
        // A second call comes from a test that calls the program's function twice.
        let _ = PROGRAM_COMMIT.set(commit);
    }
}

/// Returns version, commit and features, as in `0.2.0 (commit 0123456789ab, features cli viewer)`. The commit of a
/// library in another program is unknown. Files that must have the same bytes after every commit hold the version
/// alone.
pub(crate) fn text() -> String {
    let features: Vec<&str> = PACKAGE_FEATURES.iter().filter(|(_, is_on)| *is_on).map(|(name, _)| *name).collect();
    let commit = PROGRAM_COMMIT.get().copied().unwrap_or("unknown");
    format!("{} (commit {commit}, features {})", env!("CARGO_PKG_VERSION"), features.join(" "))
}
