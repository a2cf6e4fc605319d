//! Compiles the shaders and generates their Rust side, see `tools/shadergen`; embeds the guide's pictures.
#![allow(clippy::disallowed_methods, reason = "the rules of files are those of the library")]

#[path = "tools/shadergen/mod.rs"]
mod shadergen;

use base64::{Engine, prelude::BASE64_STANDARD};
use std::fmt::Write;
use std::path::{Path, PathBuf};

const PICTURES_FOLDER: &str = "src/guide/pictures";

fn main() {
    for watched in ["build.rs", "glsl", "tools/shadergen", PICTURES_FOLDER] {
        println!("cargo::rerun-if-changed={watched}");
    }
    let folder = |variable| std::env::var_os(variable).map(PathBuf::from).expect("cargo sets it");
    let (root, out) = (folder("CARGO_MANIFEST_DIR"), folder("OUT_DIR"));
    std::fs::write(out.join("pictures.md"), pictures(&root.join(PICTURES_FOLDER))).expect("cargo's folder is writable");
    if let Err(findings) = shadergen::run(&root.join("glsl"), &out) {
        for finding in findings {
            for line in finding.to_string().lines() {
                println!("cargo::error={line}");
            }
        }
    }
}

/// Returns the guide's pictures as Markdown link definitions with embedded bytes, because rustdoc copies no files:
/// `[photo]: data:image/png;base64,...`.
fn pictures(folder: &Path) -> String {
    let files = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let mut files: Vec<PathBuf> = files.collect();
    files.sort();
    files.iter().fold("\n".to_owned(), |mut text, file| {
        let name = file.file_stem().unwrap_or_default().to_string_lossy();
        let kind = if file.extension().is_some_and(|extension| extension == "png") { "png" } else { "jpeg" };
        let bytes = std::fs::read(file).expect("a picture of the guide");
        let _ = writeln!(text, "[{name}]: data:image/{kind};base64,{}", BASE64_STANDARD.encode(bytes));
        text
    })
}
