//! The rules for all shaders. Each breach is a [`Finding`] that stops the build.

use super::interface::{Interface, Kind};
use super::source::{line_of, without_comments};
use super::{Finding, Shader, Variant, constants, is_snake_case};
use std::collections::BTreeMap;

/// Rust keywords, and names with another meaning in the generated modules.
const RESERVED_WORDS: &str = "as async await box crate do dyn enum extern fn gen impl let loop macro match mod move mut priv pub \
    ref self static super trait try type unsafe use where yield structs constants";

/// Breaches in one shader: its text and all its variants.
pub fn shader(shader: &Shader) -> Vec<Finding> {
    let mut findings = text(&shader.path, &shader.source);
    findings.extend(header(shader));
    for variant in &shader.variants {
        findings.extend(interface(shader, variant));
    }
    if let Some((base, others)) = shader.variants.split_first() {
        findings.extend(others.iter().filter_map(|other| agreement(shader, base, other)));
    }
    findings
}

/// Breaches in the text of any GLSL file: literals that repeat the algorithm's constants.
pub fn text(path: &str, source: &str) -> Vec<Finding> {
    if path.ends_with(constants::FILE_NAME) {
        return Vec::new();
    }
    let code = without_comments(source);
    let mut findings = Vec::new();
    for (index, line) in code.lines().enumerate() {
        for literal in known_literals(line) {
            findings.push(Finding::new(
                format!("{path}:{}", index + 1),
                format!("literal {literal}; use the constant of glsl/include/{}", constants::FILE_NAME),
            ));
        }
    }
    findings
}

/// Structs with the same name must be equal in all shaders.
pub fn shared_structs(shaders: &[Shader]) -> Vec<Finding> {
    let mut known = BTreeMap::new();
    let mut findings = Vec::new();
    for shader in shaders {
        for (name, body) in shader.variants.iter().flat_map(|variant| &variant.interface.structs) {
            let (first, known_body) = known.entry(name).or_insert((&shader.path, body));
            if *known_body != body {
                findings.push(Finding::new(
                    format!("{}:{}", shader.path, line_of(&shader.source, name)),
                    format!("struct `{name}` differs from the one of {first}; write it once, in glsl/include"),
                ));
            }
        }
    }
    findings
}

/// Siblings share the Rust side of their specialisation constants, so a name must be the same constant everywhere.
pub fn siblings(shaders: &[Shader]) -> Vec<Finding> {
    let mut known = BTreeMap::new();
    let mut findings = Vec::new();
    for shader in shaders {
        for constant in &shader.variants[0].interface.spec {
            let (first, other) = known.entry((&shader.file_stem, &constant.name)).or_insert((&shader.stem, constant));
            if *other != constant {
                let (name, stem) = (&constant.name, &shader.stem);
                findings.push(Finding::new(at(shader, name), format!("`{name}` differs between {first} and {stem}")));
            }
        }
    }
    findings
}

fn at(shader: &Shader, name: &str) -> String {
    format!("{}:{}", shader.path, line_of(&shader.source, name))
}

fn header(shader: &Shader) -> Option<Finding> {
    let title = shader.summary().is_some();
    let work = shader.source.lines().any(|line| line.trim_start().starts_with("// Work:"));
    let rule = format!(
        "no header comment; write `// {} — what it does.` and `// Work: which invocation does what.`",
        shader.stem
    );
    (!(title && work)).then(|| Finding::new(format!("{}:1", shader.path), rule))
}

fn interface(shader: &Shader, variant: &Variant) -> Vec<Finding> {
    let Interface { bindings, spec, problems, .. } = &variant.interface;
    let mut findings: Vec<Finding> =
        problems.iter().map(|problem| Finding::new(at(shader, &problem.name), problem.rule.clone())).collect();
    let mut breach = |name: &str, rule: String| findings.push(Finding::new(at(shader, name), rule));
    for (index, binding) in bindings.iter().enumerate() {
        let name = &binding.name;
        if binding.set != 0 {
            breach(name, format!("`{name}` is in set {}; only set 0 is used", binding.set));
        }
        // Variants share one interface, so a binding that one variant needs is declared in all of them.
        if !shader.variants.iter().any(|variant| variant.used.contains(&binding.binding)) {
            let rule =
                format!("binding {} `{name}` is used by no variant of {}; remove it", binding.binding, shader.stem);
            breach(name, rule);
        }
        if bindings[..index].iter().any(|other| other.binding == binding.binding) {
            breach(name, format!("binding {} is declared twice", binding.binding));
        }
    }
    let names = bindings.iter().map(|binding| binding.name.clone());
    for name in names.chain(spec.iter().map(|spec| spec.name.to_lowercase())) {
        if RESERVED_WORDS.split(' ').any(|word| word == name) || !is_snake_case(&name) {
            breach(&name, format!("`{name}` cannot be the name of a Rust field; use another name in snake_case"));
        }
    }
    findings
}

/// Variants of one shader share their Rust types, so their interfaces must be equal except for the kind of a binding.
fn agreement(shader: &Shader, base: &Variant, other: &Variant) -> Option<Finding> {
    let shape = |interface: &Interface| -> Vec<_> {
        interface.bindings.iter().map(|b| (b.name.clone(), b.binding, b.access)).collect()
    };
    let (a, b) = (&base.interface, &other.interface);
    let sizes_differ = a
        .bindings
        .iter()
        .zip(&b.bindings)
        .any(|(a, b)| a.kind == Kind::Storage && b.kind == Kind::Storage && a.element_bytes != b.element_bytes);
    let what = if shape(a) != shape(b) || sizes_differ {
        "bindings"
    } else if a.spec != b.spec {
        "specialisation constants"
    } else {
        return None;
    };
    let rule = format!("{} and {} have different {what}; variants share one interface", base.name, other.name);
    Some(Finding::new(format!("{}:1", shader.path), rule))
}

/// Returns which of 1/255, 0.99 and 1e-4 occur in a line of code.
fn known_literals(line: &str) -> Vec<&'static str> {
    let tokens = tokens(line);
    let value = |index: usize| tokens.get(index).and_then(|token| number(token));
    let mut found = Vec::new();
    for index in 0..tokens.len() {
        match value(index) {
            Some(0.99) => found.push("0.99"),
            Some(1e-4) => found.push("1e-4"),
            Some(1.0) if tokens.get(index + 1) == Some(&"/") && value(index + 2) == Some(255.0) => found.push("1/255"),
            _ => {}
        }
    }
    found
}

fn number(token: &str) -> Option<f64> {
    token.starts_with(|c: char| c.is_ascii_digit() || c == '.').then_some(())?;
    token.trim_end_matches(['f', 'F', 'u', 'U']).parse().ok()
}

/// Splits a line into words, numbers (with exponents) and single other characters.
fn tokens(line: &str) -> Vec<&str> {
    let mut tokens = Vec::new();
    let mut rest = line.trim_start();
    while let Some(first) = rest.chars().next() {
        let number = first.is_ascii_digit() || first == '.';
        let mut before = ' ';
        let end = rest.find(|c: char| {
            let exponent_sign = number && matches!(c, '+' | '-') && matches!(before, 'e' | 'E');
            let inside = c.is_alphanumeric() || c == '_' || (number && c == '.') || exponent_sign;
            before = c;
            !inside
        });
        let end = end.unwrap_or(rest.len()).max(first.len_utf8());
        tokens.push(&rest[..end]);
        rest = rest[end..].trim_start();
    }
    tokens
}
