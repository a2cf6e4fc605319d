//! Parser of `glsl/variants.txt`: which shaders are compiled more than once, and with which macros.
//!
//! `stem + suffix: DEFINE OTHER=4` compiles `stem.comp` once more as `stem_suffix`. Every stem has its base variant
//! without macros; it needs no line. `#` begins a comment.

use super::compile::Define;
use super::{Finding, is_snake_case};
use std::collections::BTreeSet;

/// One line of the file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct VariantLine {
    /// Stem of the shader file.
    pub stem: String,
    /// What the variant is called after the stem.
    pub suffix: String,
    /// Macros that it is compiled with.
    pub defines: Vec<Define>,
    /// Line number from 1.
    pub line: usize,
}

/// All lines of the text; `name` is what messages call the file.
pub fn parse(name: &str, text: &str) -> Result<Vec<VariantLine>, Vec<Finding>> {
    let mut lines = Vec::new();
    let mut findings = Vec::new();
    let mut seen = BTreeSet::new();
    for (index, raw) in text.lines().enumerate() {
        let content = raw.split('#').next().unwrap_or("").trim();
        if content.is_empty() {
            continue;
        }
        let place = format!("{name}:{}", index + 1);
        match parse_line(content, index + 1) {
            Some(line) if !seen.insert((line.stem.clone(), line.suffix.clone())) => findings
                .push(Finding::new(place, format!("variant `{} + {}` is declared twice", line.stem, line.suffix))),
            Some(line) => lines.push(line),
            None => findings.push(Finding::new(
                place,
                format!("`{content}` is no variant; write `stem + suffix: DEFINE OTHER=4`, the suffix not `base`"),
            )),
        }
    }
    if findings.is_empty() { Ok(lines) } else { Err(findings) }
}

fn parse_line(content: &str, line: usize) -> Option<VariantLine> {
    let (name, macros) = content.split_once(':')?;
    let (stem, suffix) = name.split_once('+')?;
    let (stem, suffix) = (stem.trim().to_owned(), suffix.trim().to_owned());
    let defines: Vec<Define> = macros
        .split_whitespace()
        .map(|text| match text.split_once('=') {
            Some((define, value)) => (define.to_owned(), Some(value.to_owned())),
            None => (text.to_owned(), None),
        })
        .collect();
    let good = is_snake_case(&stem) && is_snake_case(&suffix) && suffix != "base" && !defines.is_empty();
    good.then_some(VariantLine { stem, suffix, defines, line })
}
