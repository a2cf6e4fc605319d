//! Parser of `glsl/variants.txt`: which shaders are compiled more than once, and with which macros.
//!
//! `stem + suffix: DEFINE OTHER=4` compiles `stem.comp` again as `stem_suffix`, with the same interface. `call* +
//! suffix: DEFINE` does so for every shader that calls a function with this prefix, and for its variants so far.
//! `sibling = stem: DEFINE` makes a separate shader with its own interface from the same file. Every stem has its base
//! variant without macros, which needs no line. Lines apply in order: a `*` includes the siblings above it. `#` starts
//! a comment.

use super::compile::Define;
use super::{Finding, is_snake_case};
use std::collections::BTreeSet;

/// One line of the file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct VariantLine {
    /// Stem of the shader file, or a prefix of functions and `*`.
    pub stem: String,
    /// Suffix of the variant after the stem; for a sibling its own stem.
    pub suffix: String,
    /// Whether the line makes a sibling.
    pub sibling: bool,
    /// Macros that it is compiled with.
    pub defines: Vec<Define>,
    /// Line number from 1.
    pub line: usize,
}

impl VariantLine {
    /// Whether the line adds a variant to this shader.
    pub fn applies_to(&self, shader: &super::Shader) -> bool {
        let calls = |prefix| calls(&shader.source, prefix);
        !self.sibling && self.prefix().map_or(self.stem == shader.stem, calls)
    }

    /// The prefix of the functions whose callers get the variant.
    pub fn prefix(&self) -> Option<&str> {
        self.stem.strip_suffix('*')
    }
}

/// All lines of the text; Messages call the file `name`.
pub fn parse(name: &str, text: &str) -> Result<Vec<VariantLine>, Vec<Finding>> {
    let mut lines = Vec::new();
    let mut findings = Vec::new();
    let mut seen = BTreeSet::new();
    for (index, raw) in text.lines().enumerate() {
        let content = content(raw);
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
                format!("`{content}` is no variant; write `stem + suffix: DEFINE OTHER=4` or `sibling = stem: DEFINE`; `base` is no suffix"),
            )),
        }
    }
    if findings.is_empty() { Ok(lines) } else { Err(findings) }
}

/// Returns whether a text calls a function whose name starts with `prefix`.
fn calls(source: &str, prefix: &str) -> bool {
    let is_name = |c: char| c.is_ascii_alphanumeric() || c == '_';
    source
        .match_indices(prefix)
        .any(|(at, _)| !source[..at].ends_with(is_name) && source[at..].trim_start_matches(is_name).starts_with('('))
}

fn content(raw: &str) -> &str {
    raw.split('#').next().unwrap_or("").trim()
}

fn parse_line(content: &str, line: usize) -> Option<VariantLine> {
    let (name, macros) = content.split_once(':')?;
    let (sibling, stem, suffix) = match name.split_once('=') {
        Some((suffix, stem)) => (true, stem, suffix),
        None => name.split_once('+').map(|(stem, suffix)| (false, stem, suffix))?,
    };
    let (stem, suffix) = (stem.trim().to_owned(), suffix.trim().to_owned());
    let defines: Vec<Define> = macros
        .split_whitespace()
        .map(|text| match text.split_once('=') {
            Some((define, value)) => (define.to_owned(), Some(value.to_owned())),
            None => (text.to_owned(), None),
        })
        .collect();
    let named = is_snake_case(&stem) || (!sibling && stem.strip_suffix('*').is_some_and(is_snake_case));
    let good = named && is_snake_case(&suffix) && suffix != "base" && !defines.is_empty();
    good.then_some(VariantLine { stem, suffix, sibling, defines, line })
}
