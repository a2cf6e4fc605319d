//! Compiles the shaders and generates their Rust side; see `tools/shadergen`.
#![allow(clippy::disallowed_methods, reason = "the rules of files are those of the library")]

#[path = "tools/shadergen/mod.rs"]
mod shadergen;

use std::path::PathBuf;

fn main() {
    for watched in ["build.rs", "glsl", "tools/shadergen"] {
        println!("cargo::rerun-if-changed={watched}");
    }
    let folder = |variable| std::env::var_os(variable).map(PathBuf::from).expect("cargo sets it");
    let (root, out) = (folder("CARGO_MANIFEST_DIR"), folder("OUT_DIR"));
    let lab = std::env::var_os("CARGO_FEATURE_LAB").is_some();
    if let Err(findings) = shadergen::run(&root.join("glsl"), &out, lab) {
        for finding in findings {
            for line in finding.to_string().lines() {
                println!("cargo::error={line}");
            }
        }
    }
}
