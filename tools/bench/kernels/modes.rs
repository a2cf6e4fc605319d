//! The modes: training steps whose kernels are compiled with macros that trade accuracy for time.
//!
//! A macro takes the place of a constant of `glsl/include/constants.glsl`, or of a function of GLSL.

use crate::compiler::{GLSL, spirv, texel_define};
use labelgs::scheduler::plan::{PassList, Work};
use labelgs::shaders::ShaderDesc;
use labelgs::{Error, Result};
use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};

/// One way to run a step.
#[derive(Clone, Copy, Debug)]
pub struct Mode {
    /// Name in tables.
    pub name: &'static str,
    /// The difference from the default, for the legend.
    pub about: &'static str,
    /// Macro and value that its kernels are compiled with.
    define: Option<(&'static str, &'static str)>,
    /// Stems of the kernels that the macro changes.
    stems: &'static [&'static str],
}

const fn stop(name: &'static str, about: &'static str, value: &'static str) -> Mode {
    let define = Some(("TRANSMITTANCE_MIN", value));
    Mode { name, about, define, stems: &["blend_forward"] }
}

const fn cut(name: &'static str, about: &'static str, value: &'static str) -> Mode {
    let define = Some(("ALPHA_MIN", value));
    let stems = &["cull", "project_forward", "emit_instances", "blend_forward", "blend_backward"];
    Mode { name, about, define, stems }
}

/// 2^x for -126 <= x <= 0: the whole part goes into the exponent, of the rest a polynomial with the least largest
/// relative error on [0, 1) by weighted least squares, 7.5e-5.
const CUBIC: &str = "(uintBitsToFloat(uint(int(floor(x)) + 127) << 23) * \
     (0.9999252 + fract(x) * (0.6958336 + fract(x) * (0.22606716 + fract(x) * 0.07802452))))";

/// Every mode, the default first.
pub const MODES: &[Mode] = &[
    Mode { name: "default", about: "the step as the engine runs it", define: None, stems: &[] },
    stop("stop 1e-2", "a pixel stops at T < 1e-2", "1e-2"),
    stop("stop 1e-3", "a pixel stops at T < 1e-3", "1e-3"),
    stop("stop 0", "no pixel stops", "0.0"),
    cut("cut 1/64", "pairs count from alpha 1/64", "(1.0 / 64.0)"),
    cut("cut 1/1024", "pairs count from alpha 1/1024", "(1.0 / 1024.0)"),
    Mode {
        name: "exp2 cubic",
        about: "exp2 by a polynomial of degree 3 (relative error 7.5e-5)",
        define: Some(("exp2(x)", CUBIC)),
        stems: &["blend_forward", "blend_backward"],
    },
];

/// Kernels of a mode, by the name of the engine's kernel that they stand in for.
#[derive(Debug, Default)]
pub struct Replacements(HashMap<&'static str, &'static ShaderDesc>);

impl Mode {
    /// Compiles the kernels of `list` that the mode changes.
    pub fn compile(&self, list: &PassList) -> Result<Replacements> {
        let mut made = Replacements::default();
        let Some((name, value)) = self.define else { return Ok(made) };
        for stem in self.stems {
            let wrong = |what: &str| Error::Check(format!("mode `{}`: {stem} {what}", self.name));
            let mut passes = list.work.iter().filter_map(|work| match work {
                Work::Pass(pass) => Some(pass.shader),
                Work::Fill { .. } | Work::Copy { .. } => None,
            });
            let shader = passes.find(|shader| shader.stem == *stem).ok_or_else(|| wrong("is in no pass of a step"))?;
            let path = source_of(stem)?.ok_or_else(|| wrong("has no file"))?;
            let source = fs::read_to_string(&path).map_err(Error::read(&path))?;
            let mut defines = texel_define(shader.name.ends_with("_texel"));
            defines.push((name.to_owned(), Some(value.to_owned())));
            let spirv = spirv(&format!("{stem} ({})", self.name), &source, &defines)?;
            if spirv == shader.spirv {
                return Err(wrong("is the same with the macro and without"));
            }
            made.0.insert(shader.name, Box::leak(Box::new(ShaderDesc { spirv, ..*shader })));
        }
        Ok(made)
    }

    /// The list of the mode, from that of the default. Every kernel of the mode must be in it.
    pub fn list(&self, default: &PassList, kernels: &Replacements) -> Result<PassList> {
        let mut list = PassList { name: self.name.to_owned(), ..default.clone() };
        let mut put = 0;
        for work in &mut list.work {
            if let Work::Pass(pass) = work
                && let Some(shader) = kernels.0.get(pass.shader.name)
            {
                (pass.shader, put) = (shader, put + 1);
            }
        }
        let all = || Error::Check(format!("mode `{}`: the step has other kernels than those of the mode", self.name));
        if put == kernels.0.len() { Ok(list) } else { Err(all()) }
    }
}

/// The file of a kernel.
fn source_of(stem: &str) -> Result<Option<PathBuf>> {
    let glsl = Path::new(GLSL);
    let folders = fs::read_dir(glsl).map_err(Error::read(glsl))?;
    let files = folders.flatten().map(|folder| folder.path().join(format!("{stem}.comp")));
    Ok(files.into_iter().find(|file| file.is_file()))
}
