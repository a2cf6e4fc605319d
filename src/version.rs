//! The version of labelgs, with the program's commit and features.

use std::sync::OnceLock;

/// The program's commit, set by `main.rs`. If it were a constant here, every commit would recompile the library.
static PROGRAM_COMMIT: OnceLock<&str> = OnceLock::new();

/// Features of the package, and whether they are enabled in this build.
const PACKAGE_FEATURES: [(&str, bool); 4] = [
    ("cli", cfg!(feature = "cli")),
    ("viewer", cfg!(feature = "viewer")),
    ("build-shaderc", cfg!(feature = "build-shaderc")),
    ("lab", cfg!(feature = "lab")),
];

/// Sets the program's commit, once.
#[cfg(feature = "cli")]
pub(crate) fn note_commit(commit: Option<&'static str>) {
    if let Some(commit) = commit {
        // A test that calls the program's main function twice sets it again.
        let _ = PROGRAM_COMMIT.set(commit);
    }
}

/// Returns version, commit and features, as in `0.2.0 (commit 0123456789ab, features cli viewer)`. In other programs,
/// the library's commit is unknown. Files that must not change with every commit contain the version only.
pub(crate) fn text() -> String {
    let features: Vec<&str> = PACKAGE_FEATURES.iter().filter(|(_, is_on)| *is_on).map(|(name, _)| *name).collect();
    let commit = PROGRAM_COMMIT.get().copied().unwrap_or("unknown");
    format!("{} (commit {commit}, features {})", env!("CARGO_PKG_VERSION"), features.join(" "))
}
