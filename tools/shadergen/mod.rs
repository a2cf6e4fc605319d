//! From GLSL to Rust: finds the shaders, compiles them, reflects their interfaces, checks the rules and writes
//! `shaders.rs`. Called by `build.rs`; the tests call it on small folders.

pub mod check;
pub mod compile;
pub mod constants;
pub mod emit;
pub mod interface;
pub mod reflect;
pub mod source;
pub mod uniform;
pub mod variants;

use compile::{Define, GlslCompiler, Purpose};
use interface::Interface;
use std::collections::BTreeSet;
use std::fmt;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

/// A breach of a rule, or a file that does not compile. Any of them stops the build.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// File and line.
    pub place: String,
    /// The problem and its remedy.
    pub rule: String,
}

impl Finding {
    /// Creates a finding at a location.
    pub fn new(place: impl Into<String>, rule: impl Into<String>) -> Self {
        Self { place: place.into(), rule: rule.into() }
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.place.is_empty() {
            return formatter.write_str(&self.rule);
        }
        write!(formatter, "{}: {}", self.place, self.rule)
    }
}

/// One `.comp` file.
#[derive(Clone, Debug)]
pub struct Shader {
    /// File name without extension, or the name of a sibling that `variants.txt` makes from the same file.
    pub stem: String,
    /// File name without extension.
    pub file_stem: String,
    /// Path as messages write it: `glsl/family/stem.comp`.
    pub path: String,
    /// Its text.
    pub source: String,
    /// The variants, base first.
    pub variants: Vec<Variant>,
}

impl Shader {
    /// The sentence of the header comment, `// stem — sentence`.
    pub fn summary(&self) -> Option<&str> {
        self.source
            .lines()
            .find_map(|line| {
                line.trim_start_matches('/').trim().strip_prefix(self.file_stem.as_str())?.trim().strip_prefix('—')
            })
            .map(str::trim)
            .filter(|sentence| !sentence.is_empty())
    }

    /// The macros that make it a sibling.
    pub fn macros(&self) -> Vec<String> {
        self.variants.first().map(Variant::macros).unwrap_or_default()
    }
}

/// One way to compile a shader.
#[derive(Clone, Debug, Default)]
pub struct Variant {
    /// `stem` or `stem_suffix`.
    pub name: String,
    /// Its macros.
    pub defines: Vec<Define>,
    /// The shipped module.
    pub words: Vec<u32>,
    /// Interface of the module without optimisation.
    pub interface: Interface,
    /// Binding numbers that the shipped module uses.
    pub used: BTreeSet<u32>,
}

impl Variant {
    /// The macros as texts, in the order of their names.
    pub fn macros(&self) -> Vec<String> {
        let texts = self.defines.iter().map(|(name, value)| match value {
            Some(value) => format!("{name}={value}"),
            None => name.clone(),
        });
        texts.collect::<BTreeSet<_>>().into_iter().collect()
    }
}

/// Generated files.
#[derive(Debug)]
pub struct Generated {
    /// Text of `shaders.rs`.
    pub rust: String,
    /// All shaders, by stem.
    pub shaders: Vec<Shader>,
}

/// Generates from the folder `glsl` and writes `shaders.rs` and the `.spv` files into `out`.
pub fn run(glsl: &Path, out: &Path) -> Result<(), Vec<Finding>> {
    let generated = generate(glsl)?;
    let save = |file: PathBuf, bytes: &[u8]| {
        fs::write(&file, bytes).map_err(|error| vec![Finding::new(file.display().to_string(), error.to_string())])
    };
    for variant in generated.shaders.iter().flat_map(|shader| &shader.variants) {
        let bytes: Vec<u8> = variant.words.iter().flat_map(|word| word.to_le_bytes()).collect();
        save(out.join(format!("{}.spv", variant.name)), &bytes)?;
    }
    save(out.join("shaders.rs"), generated.rust.as_bytes())
}

/// Everything except writing. All findings of a stage are reported together.
pub fn generate(glsl: &Path) -> Result<Generated, Vec<Finding>> {
    let include = glsl.join("include");
    let compiler = GlslCompiler::new(&include).map_err(|error| vec![Finding::new("", error)])?;
    let mut shaders = find(glsl)?;
    declare_variants(glsl, &mut shaders)?;
    compile_all(&include, &mut shaders)?;
    let mut findings: Vec<Finding> = shaders.iter().flat_map(check::shader).collect();
    findings.extend(check::shared_structs(&shaders));
    findings.extend(check::siblings(&shaders));
    for path in files(&include, "glsl")? {
        findings.extend(check::text(&message_path(glsl, &path), &read(&path)?));
    }
    let constants = match fs::read_to_string(include.join(constants::FILE_NAME)) {
        Ok(text) => constants::read(&compiler, &text)?,
        Err(_) => Vec::new(),
    };
    // Variants of a shader share many findings, so report each once.
    let mut seen = BTreeSet::new();
    findings.retain(|finding| seen.insert(finding.to_string()));
    if !findings.is_empty() {
        return Err(findings);
    }
    Ok(Generated { rust: emit::rust(&shaders, &constants), shaders })
}

/// Whether a name can be a Rust module or field.
pub fn is_snake_case(name: &str) -> bool {
    let inner = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
    name.starts_with(|c: char| c.is_ascii_lowercase()) && name.chars().all(inner)
}

fn read(path: &Path) -> Result<String, Vec<Finding>> {
    fs::read_to_string(path).map_err(|error| vec![Finding::new(path.display().to_string(), error.to_string())])
}

/// `glsl/family/stem.comp`, with slashes on every system.
fn message_path(glsl: &Path, path: &Path) -> String {
    let parts = path.strip_prefix(glsl).unwrap_or(path).iter().map(|part| part.to_string_lossy());
    std::iter::once("glsl".into()).chain(parts).collect::<Vec<_>>().join("/")
}

/// Files with an extension below a folder, in the order of their paths.
fn files(folder: &Path, extension: &str) -> Result<Vec<PathBuf>, Vec<Finding>> {
    let fail = |error: std::io::Error| vec![Finding::new(folder.display().to_string(), error.to_string())];
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).map_err(fail)? {
        let path = entry.map_err(fail)?.path();
        if path.is_dir() {
            found.extend(files(&path, extension)?);
        } else if path.extension().is_some_and(|found| found == extension) {
            found.push(path);
        }
    }
    found.sort();
    Ok(found)
}

fn find(glsl: &Path) -> Result<Vec<Shader>, Vec<Finding>> {
    let mut shaders: Vec<Shader> = Vec::new();
    let mut findings = Vec::new();
    for file in files(glsl, "comp")? {
        let stem = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let path = message_path(glsl, &file);
        if !is_snake_case(&stem) {
            findings.push(Finding::new(path.clone(), "a shader's file name must be in snake_case"));
        }
        if let Some(twin) = shaders.iter().find(|shader| shader.stem == stem) {
            findings.push(Finding::new(path.clone(), format!("{} has the same stem", twin.path)));
        }
        let variants = vec![Variant { name: stem.clone(), ..Variant::default() }];
        shaders.push(Shader { file_stem: stem.clone(), stem, path, source: read(&file)?, variants });
    }
    shaders.sort_by(|a, b| a.stem.cmp(&b.stem));
    if findings.is_empty() { Ok(shaders) } else { Err(findings) }
}

fn declare_variants(glsl: &Path, shaders: &mut Vec<Shader>) -> Result<(), Vec<Finding>> {
    let file = glsl.join("variants.txt");
    if !file.exists() {
        return Ok(());
    }
    let name = message_path(glsl, &file);
    let mut findings = Vec::new();
    let text = read(&file)?;
    for line in &variants::parse(&name, &text)? {
        let place = format!("{name}:{}", line.line);
        let full = if line.sibling { line.suffix.clone() } else { format!("{}_{}", line.stem, line.suffix) };
        if shaders.iter().any(|shader| shader.stem == full) {
            findings.push(Finding::new(place.clone(), format!("`{full}` is a shader's name already")));
        }
        if line.prefix().is_none() && !shaders.iter().any(|shader| shader.stem == line.stem) {
            findings.push(Finding::new(place, format!("there is no shader `{}`", line.stem)));
            continue;
        }
        if line.sibling {
            declare_sibling(shaders, line);
        } else {
            shaders.iter_mut().filter(|shader| line.applies_to(shader)).for_each(|shader| {
                let from = if line.prefix().is_some() { shader.variants.len() } else { 1 };
                for at in 0..from {
                    let base = &shader.variants[at];
                    let defines = [&base.defines[..], &line.defines].concat();
                    let name = format!("{}_{}", base.name, line.suffix);
                    shader.variants.push(Variant { name, defines, ..Variant::default() });
                }
            });
        }
    }
    shaders.sort_by(|a, b| a.stem.cmp(&b.stem));
    if findings.is_empty() { Ok(()) } else { Err(findings) }
}

fn declare_sibling(shaders: &mut Vec<Shader>, line: &variants::VariantLine) {
    let Some(base) = shaders.iter().find(|shader| shader.stem == line.stem).cloned() else { return };
    let variant = Variant { name: line.suffix.clone(), defines: line.defines.clone(), ..Variant::default() };
    shaders.push(Shader { stem: line.suffix.clone(), variants: vec![variant], ..base });
}

/// Compiles and reflects all variants, on all cores.
fn compile_all(include: &Path, shaders: &mut [Shader]) -> Result<(), Vec<Finding>> {
    let jobs: Vec<(usize, usize)> = shaders
        .iter()
        .enumerate()
        .flat_map(|(shader, found)| (0..found.variants.len()).map(move |variant| (shader, variant)))
        .collect();
    let threads = std::thread::available_parallelism().map_or(1, usize::from).min(jobs.len());
    let next = AtomicUsize::new(0);
    let shared = &*shaders;
    let worker = || -> Vec<(usize, Result<Variant, Vec<Finding>>)> {
        let compiler = GlslCompiler::new(include).map_err(|error| vec![Finding::new("", error)]);
        let mut done = Vec::new();
        loop {
            let job = next.fetch_add(1, Ordering::Relaxed);
            let Some(&(shader, variant)) = jobs.get(job) else { return done };
            let (shader, compiler) = (&shared[shader], compiler.as_ref().map_err(Clone::clone));
            done.push((job, compiler.and_then(|compiler| build(compiler, shader, &shader.variants[variant]))));
        }
    };
    let mut done: Vec<_> = std::thread::scope(|scope| {
        let workers: Vec<_> = (0..threads).map(|_| scope.spawn(worker)).collect();
        workers.into_iter().flat_map(|worker| worker.join().expect("a worker does not panic")).collect()
    });
    done.sort_by_key(|(job, _)| *job);
    let mut findings = Vec::new();
    for (job, result) in done {
        let (shader, variant) = jobs[job];
        match result {
            Ok(built) => shaders[shader].variants[variant] = built,
            Err(found) => findings.extend(found),
        }
    }
    if findings.is_empty() { Ok(()) } else { Err(findings) }
}

fn build(compiler: &GlslCompiler, shader: &Shader, variant: &Variant) -> Result<Variant, Vec<Finding>> {
    // Messages of the GLSL compiler name file and line themselves.
    let fail = |error: String| vec![Finding::new("", format!("{} ({}): {}", shader.path, variant.name, error.trim()))];
    let compile = |purpose| -> Result<(Vec<u32>, rspirv::dr::Module), String> {
        let words = compiler.compile(&shader.path, &shader.source, &variant.defines, purpose)?;
        let module = rspirv::dr::load_words(&words).map_err(|error| error.to_string())?;
        Ok((words, module))
    };
    let (_, declared) = compile(Purpose::Reflect).map_err(fail)?;
    let (words, shipped) = compile(Purpose::Ship).map_err(fail)?;
    // Emulated subgroups decide by sums of all lanes, which look like values of a lane.
    let is_emulated = variant.defines.iter().any(|(name, _)| name == "EMULATED");
    let split = if is_emulated { 0 } else { uniform::split_barriers(&shipped) };
    if split > 0 {
        let rule = format!(
            "{split} barriers of {} stand where only some invocations of a workgroup may arrive; move them out of \
             branches and loops that depend on the invocation",
            variant.name
        );
        return Err(vec![Finding::new(format!("{}:1", shader.path), rule)]);
    }
    let interface = reflect::interface(&declared);
    Ok(Variant { words, interface, used: reflect::used_bindings(&shipped), ..variant.clone() })
}
