//! Modes as changed copies of the engine's own shaders: text is replaced, the compiler of the build compiles, and the
//! passes of a list get the new module in place of the old one.

use crate::shader_compiler::{Define, GlslCompiler, Purpose};
use labelgs::scheduler::plan::{PassList, Work};
use labelgs::shaders::ShaderDesc;
use labelgs::{Error, Result};
use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};

/// One replacement. The words must stand in the file exactly once, or the shader has changed since they were written.
#[derive(Clone, Copy, Debug)]
pub struct Patch {
    /// Stem of a file below `glsl`.
    pub file: &'static str,
    /// Words of the file.
    pub find: &'static str,
    /// What stands there instead.
    pub replace: &'static str,
}

/// Shaders that stand in for those of the engine, by the name of the variant.
#[derive(Debug, Default)]
pub struct Replacements(HashMap<&'static str, &'static ShaderDesc>);

/// Compiles the variants of `list` whose stem is in `stems` from a patched copy of the sources.
pub fn compile(mode: &str, stems: &[&str], patches: &[Patch], list: &PassList) -> Result<Replacements> {
    let glsl = Path::new(env!("CARGO_MANIFEST_DIR")).join("glsl");
    let copy = tempfile::tempdir().map_err(Error::write(std::env::temp_dir()))?;
    let include = copy.path().join("include");
    fs::create_dir(&include).map_err(Error::write(&include))?;
    let mut missing: Vec<&str> = patches.iter().map(|patch| patch.file).collect();
    let mut sources = HashMap::new();
    for path in sources_of(&glsl)? {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let mut text = fs::read_to_string(&path).map_err(Error::read(&path))?;
        for patch in patches.iter().filter(|patch| patch.file == stem) {
            text = apply(mode, patch, &text)?;
            missing.retain(|file| *file != stem);
        }
        if path.extension().is_some_and(|extension| extension == "comp") {
            sources.insert(stem, text);
        } else {
            let to = include.join(format!("{stem}.glsl"));
            fs::write(&to, text).map_err(Error::write(&to))?;
        }
    }
    if let Some(file) = missing.first() {
        return Err(changed(mode, format!("there is no shader source {file}")));
    }
    let compiler = GlslCompiler::new(&include).map_err(Error::Bug)?;
    let mut made = Replacements::default();
    for work in &list.work {
        let Work::Pass(pass) = work else { continue };
        let shader = pass.shader;
        if stems.contains(&shader.stem) && !made.0.contains_key(shader.name) {
            let source = sources.get(shader.stem).ok_or_else(|| {
                changed(mode, format!("{} is no file of its own; modes replace base shaders alone", shader.stem))
            })?;
            let words = compiler
                .compile(&format!("{} ({mode})", shader.stem), source, &defines(shader), Purpose::Ship)
                .map_err(|text| changed(mode, text))?;
            made.0.insert(shader.name, stand_in(shader, &words));
        }
    }
    match stems.iter().find(|stem| !made.0.values().any(|shader| shader.stem == **stem)) {
        Some(stem) => Err(changed(mode, format!("no pass of a step uses the shader {stem}"))),
        None => Ok(made),
    }
}

impl Replacements {
    /// Puts the new shaders into a list.
    pub fn put_into(&self, list: &mut PassList) {
        for work in &mut list.work {
            if let Work::Pass(pass) = work
                && let Some(shader) = self.0.get(pass.shader.name)
            {
                pass.shader = shader;
            }
        }
    }
}

fn changed(mode: &str, what: String) -> Error {
    Error::Check(format!("mode `{mode}`: {what}"))
}

fn apply(mode: &str, patch: &Patch, text: &str) -> Result<String> {
    match text.matches(patch.find).count() {
        1 => Ok(text.replacen(patch.find, patch.replace, 1)),
        count => Err(changed(
            mode,
            format!("the shader changed: {} has `{}` {count} times, once is expected", patch.file, patch.find),
        )),
    }
}

/// All GLSL files, in any order.
fn sources_of(folder: &Path) -> Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).map_err(Error::read(folder))? {
        let path = entry.map_err(Error::read(folder))?.path();
        if path.is_dir() {
            found.extend(sources_of(&path)?);
        } else if path.extension().is_some_and(|extension| extension == "comp" || extension == "glsl") {
            found.push(path);
        }
    }
    Ok(found)
}

/// Base shaders have no macros but that of the texel variant.
fn defines(shader: &ShaderDesc) -> Vec<Define> {
    if shader.name.ends_with("_texel") { vec![("TEXEL".to_owned(), None)] } else { Vec::new() }
}

/// Interfaces do not change. Pipelines are told apart by the address of the module, which therefore stays for good.
fn stand_in(shader: &ShaderDesc, words: &[u32]) -> &'static ShaderDesc {
    let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
    Box::leak(Box::new(ShaderDesc {
        stem: shader.stem,
        name: shader.name,
        spirv: Box::leak(bytes.into_boxed_slice()),
        bindings: shader.bindings,
        spec: shader.spec,
        local_size: shader.local_size,
        uses_subgroups: shader.uses_subgroups,
    }))
}
