//! Options of COLMAP's commands. Versions name some of them differently, so the help of the installed one decides.

use labelgs_scene::{Error, Result};
use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::path::PathBuf;
use std::process::Command;

/// The groups of an option, the newest name first: COLMAP 3.12 moved what all kinds of features have in common.
pub(super) const READER_GROUPS: &[&str] = &["ImageReader"];
pub(super) const EXTRACTION_GROUPS: &[&str] = &["FeatureExtraction", "SiftExtraction"];
pub(super) const MATCHING_GROUPS: &[&str] = &["FeatureMatching", "SiftMatching"];
pub(super) const MAPPER_GROUPS: &[&str] = &["Mapper"];

/// Adds an option that all versions have.
pub(super) fn give(command: &mut Command, name: &str, value: impl AsRef<OsStr>) {
    command.arg(format!("--{name}")).arg(value);
}

/// A name without its group, and a value.
pub(super) type Choice = (&'static str, &'static str);

/// The options that a command has.
pub(super) struct Options {
    known: BTreeSet<String>,
    /// False for a COLMAP that was built without CUDA.
    pub(super) has_cuda: bool,
}

impl Options {
    /// Asks a command, such as `colmap mapper`, for its options.
    pub(super) fn of(mut command: Command) -> Result<Self> {
        let program = PathBuf::from(command.get_program());
        let failed = |problem: &str| Error::data(&program, "", format!("cannot be used: {problem}"));
        let output = command.arg("-h").output().map_err(|error| failed(&error.to_string()))?;
        let text = [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).join("\n");
        if !output.status.success() {
            return Err(failed(text.trim()));
        }
        Ok(Self::read(&text))
    }

    fn read(help: &str) -> Self {
        let known = help.split_whitespace().filter(|word| word.starts_with("--")).map(str::to_owned).collect();
        Self { known, has_cuda: !help.contains("without CUDA") }
    }

    /// Adds an option by the name that this version has for it. One that it lacks is left out.
    pub(super) fn set(&self, command: &mut Command, groups: &[&str], (name, value): (&str, &str)) {
        let names = groups.iter().map(|group| format!("--{group}.{name}"));
        if let Some(name) = names.into_iter().find(|name| self.known.contains(name)) {
            command.args([&name, value]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{EXTRACTION_GROUPS, Options};
    use std::process::Command;

    fn words(help: &str, choice: (&str, &str)) -> Vec<String> {
        let mut command = Command::new("colmap");
        Options::read(help).set(&mut command, EXTRACTION_GROUPS, choice);
        command.get_args().map(|word| word.to_string_lossy().into_owned()).collect()
    }

    #[test]
    fn an_option_has_the_name_of_the_installed_version() {
        let old = "COLMAP 3.8 (Commit Unknown on Unknown without CUDA)\n  -h [ --help ]\n  --SiftExtraction.use_gpu arg (=1)\n";
        let new = "COLMAP 4.0 (Commit 1 on 2026-01-01 with CUDA)\n  --FeatureExtraction.use_gpu arg (=1)\n  \
                   --SiftExtraction.peak_threshold arg (=0.0067)\n";
        assert_eq!(words(old, ("use_gpu", "0")), ["--SiftExtraction.use_gpu", "0"]);
        assert_eq!(words(new, ("use_gpu", "0")), ["--FeatureExtraction.use_gpu", "0"]);
        assert_eq!(words(new, ("peak_threshold", "0.0003")), ["--SiftExtraction.peak_threshold", "0.0003"]);
        assert_eq!(words(old, ("peak_threshold", "0.0003")), Vec::<String>::new());
        assert_eq!([old, new].map(|help| Options::read(help).has_cuda), [false, true]);
    }
}
