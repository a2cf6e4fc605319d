//! The modes: training steps whose kernels are compiled with macros that trade accuracy for time.
//!
//! A macro replaces a constant of `glsl/include/constants.glsl` or a GLSL function.

use crate::compiler::{GLSL_FOLDER, spirv};
use crate::shadergen::compile::Define;
use labelgs::pass::Stage;
use labelgs::scheduler::plan::{PassList, Work};
use labelgs::shaders::ShaderDesc;
use labelgs::{Error, Result};
use std::cell::RefCell;
use std::collections::{BTreeSet, HashMap};
use std::fs;
use std::path::{Path, PathBuf};

/// One way to run a step.
#[derive(Clone, Copy, Debug)]
pub struct Mode {
    /// Name in tables.
    pub name: &'static str,
    /// The difference from the default, for the legend.
    pub about: &'static str,
    /// Macro and value with which kernels are compiled.
    define: Option<(&'static str, &'static str)>,
    /// Stages with these kernels; unaffected stages stay.
    stages: &'static [Stage],
}

const BLEND_STAGES: &[Stage] = &[Stage::BLEND_FORWARD, Stage::BLEND_BACKWARD];
/// Stages that decide which pairs exist, and in the blends, which of them count.
const PAIR_STAGES: &[Stage] = &[Stage::PROJECT, Stage::TILE, Stage::BLEND_FORWARD, Stage::BLEND_BACKWARD];

const fn stop(name: &'static str, about: &'static str, value: &'static str) -> Mode {
    Mode { name, about, define: Some(("TRANSMITTANCE_MIN", value)), stages: BLEND_STAGES }
}

const fn cut(name: &'static str, about: &'static str, value: &'static str) -> Mode {
    Mode { name, about, define: Some(("ALPHA_MIN", value)), stages: PAIR_STAGES }
}

/// 2^x for -126 <= x <= 0: the integer part becomes the exponent; the rest is a polynomial with minimal largest
/// relative error on [0, 1) by weighted least squares, 7.5e-5.
const EXP2_CUBIC: &str = "(uintBitsToFloat(uint(int(floor(x)) + 127) << 23) * \
     (0.9999252 + fract(x) * (0.6958336 + fract(x) * (0.22606716 + fract(x) * 0.07802452))))";

/// Every mode, the default first.
pub const ALL_MODES: &[Mode] = &[
    Mode { name: "default", about: "the step as the engine runs it", define: None, stages: &[] },
    stop("stop 1e-2", "a pixel stops at T < 1e-2", "1e-2"),
    stop("stop 1e-3", "a pixel stops at T < 1e-3", "1e-3"),
    stop("stop 0", "no pixel stops", "0.0"),
    cut("cut 1/64", "pairs count from alpha 1/64", "(1.0 / 64.0)"),
    cut("cut 1/1024", "pairs count from alpha 1/1024", "(1.0 / 1024.0)"),
    Mode {
        name: "exp2 cubic",
        about: "exp2 by a polynomial of degree 3 (relative error 7.5e-5)",
        define: Some(("exp2(x)", EXP2_CUBIC)),
        stages: BLEND_STAGES,
    },
];

/// Kernels of a mode, by the name of the engine's kernel that they replace.
#[derive(Debug, Default)]
pub struct Replacements(RefCell<HashMap<&'static str, &'static ShaderDesc>>);

impl Replacements {
    /// Returns the kernel compiled once with a macro, or the engine's own if the macro changes nothing.
    fn get(&self, shader: &'static ShaderDesc, (name, value): (&str, &str)) -> Result<&'static ShaderDesc> {
        if let Some(&made) = self.0.borrow().get(shader.name) {
            return Ok(made);
        }
        let path = source_of(shader.stem)?;
        let source = fs::read_to_string(&path).map_err(Error::read(&path))?;
        let mut defines: Vec<Define> = shader.macros.iter().map(|&own| (own.to_owned(), None)).collect();
        defines.push((name.to_owned(), Some(value.to_owned())));
        let spirv = spirv(shader.name, &source, &defines)?;
        let made = if spirv == shader.spirv { shader } else { Box::leak(Box::new(ShaderDesc { spirv, ..*shader })) };
        self.0.borrow_mut().insert(shader.name, made);
        Ok(made)
    }
}

impl Mode {
    /// Returns the mode's list, derived from the default list. Every mode changes the forward blend.
    pub fn list(&self, default: &PassList, kernels: &Replacements) -> Result<PassList> {
        let mut list = PassList { name: self.name.to_owned(), ..default.clone() };
        let Some(define) = self.define else { return Ok(list) };
        let mut changed = BTreeSet::new();
        for work in &mut list.work {
            if let Work::Pass(pass) = work
                && self.stages.contains(&pass.stage)
            {
                let made = kernels.get(pass.shader, define)?;
                if !std::ptr::eq(made, pass.shader) {
                    changed.insert(pass.stage);
                    pass.shader = made;
                }
            }
        }
        let problem = || Error::Check(format!("mode `{}` changes no kernel of the forward blend", self.name));
        if changed.contains(&Stage::BLEND_FORWARD) { Ok(list) } else { Err(problem()) }
    }
}

/// Returns the source file of a kernel. If it shares another kernel's source, its name has additional words.
fn source_of(stem: &str) -> Result<PathBuf> {
    let glsl = Path::new(GLSL_FOLDER);
    let folders: Vec<PathBuf> =
        fs::read_dir(glsl).map_err(Error::read(glsl))?.flatten().map(|folder| folder.path()).collect();
    let words = std::iter::successors(Some(stem), |name| name.rsplit_once('_').map(|(shorter, _)| shorter));
    let mut files = words.flat_map(|name| folders.iter().map(move |folder| folder.join(format!("{name}.comp"))));
    files.find(|file| file.is_file()).ok_or_else(|| Error::Bug(format!("{stem} has no file")))
}
