//! The modes: ways of one training step that differ in accuracy, in time, or in both.

use super::backward::{FROM_THE_FRONT, REPLAYED, RESTARTED};
use super::patch::{self, Patch, Replacements};
use labelgs::scheduler::plan::{Buf, PassList, Work};
use labelgs::{Error, Result};

/// What a mode trades.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Family {
    /// The step as the engine runs it.
    Default,
    /// When a pixel stops.
    Stop,
    /// Which pairs count.
    Cut,
    /// Which tiles a splat is listed in.
    TileTest,
    /// Where the backward pass has the transmittance and the light behind a splat from.
    Backward,
    /// Numbers of fewer bits.
    Packed,
    /// Bits of the depth that are sorted.
    Keys,
    /// Other formulas for the same value.
    Arithmetic,
}

/// One way.
#[derive(Clone, Copy, Debug)]
pub struct Mode {
    /// Name in tables and charts.
    pub name: &'static str,
    /// What it trades.
    pub family: Family,
    /// What is different, for the legend.
    pub about: &'static str,
    /// Stems of the shaders that the patches bear on.
    pub stems: &'static [&'static str],
    /// Changes of the sources.
    pub patches: &'static [Patch],
    /// Low bits of the depth that are not sorted, a multiple of 8.
    pub unsorted_bits: u32,
}

const PLAIN: Mode = Mode { name: "", family: Family::Default, about: "", stems: &[], patches: &[], unsorted_bits: 0 };

const STOP: &str = "TRANSMITTANCE_MIN = 1e-4;";
const CUT: &str = "ALPHA_MIN = 1.0 / 255.0;";
/// Every shader that asks whether a pair counts.
const CUTTING: &[&str] = &["cull", "project_forward", "emit_instances", "blend_forward", "blend_backward"];
const BLENDING: &[&str] = &["blend_forward", "blend_backward"];
const BINNING: &[&str] = &["project_forward", "emit_instances"];
const TOUCHED: &str = "return best >= LOG2_ALPHA_MIN - margin;";
const ALL_TOUCHED: Patch = Patch { file: "ellipse", find: TOUCHED, replace: "return true;" };

const fn stop(name: &'static str, about: &'static str, patches: &'static [Patch]) -> Mode {
    Mode { name, family: Family::Stop, about, stems: &["blend_forward"], patches, ..PLAIN }
}

const fn cut(name: &'static str, about: &'static str, patches: &'static [Patch]) -> Mode {
    Mode { name, family: Family::Cut, about, stems: CUTTING, patches, ..PLAIN }
}

const fn constant(find: &'static str, replace: &'static str) -> Patch {
    Patch { file: "constants", find, replace }
}

/// The built-in function in both blend passes, and where a function of our own can stand in front of them.
const fn other_exp2(stem: &'static str, function: &'static str) -> [Patch; 2] {
    [
        Patch { file: stem, find: "exp2(max(e, -20.0))", replace: "polynomial_exp2(max(e, -20.0))" },
        Patch { file: stem, find: "void main() {", replace: function },
    ]
}

/// Least largest relative error on [0, 1), by weighted least squares: 7.5e-5.
const CUBIC: &str = "float polynomial_exp2(float x) {
    float whole = floor(x), f = x - whole;
    float p = 0.9999252 + f * (0.6958336 + f * (0.22606716 + f * 0.07802452));
    return p * uintBitsToFloat(uint(int(whole) + 127) << 23);
}
void main() {";
const CUBIC_FORWARD: [Patch; 2] = other_exp2("blend_forward", CUBIC);
const CUBIC_BACKWARD: [Patch; 2] = other_exp2("blend_backward", CUBIC);

/// As above: 7.5e-8, about what f32 can hold.
const QUINTIC: &str = "float polynomial_exp2(float x) {
    float whole = floor(x), f = x - whole;
    float p = 0.99999994 + f * (0.6931531 + f * (0.24015361 + f * (0.055826318 + f * (0.0089893397 + f * 0.0018775767))));
    return p * uintBitsToFloat(uint(int(whole) + 127) << 23);
}
void main() {";
const QUINTIC_FORWARD: [Patch; 2] = other_exp2("blend_forward", QUINTIC);
const QUINTIC_BACKWARD: [Patch; 2] = other_exp2("blend_backward", QUINTIC);

/// Every mode, the default first.
pub const MODES: &[Mode] = &[
    Mode { name: "default", about: "the step as the engine runs it", ..PLAIN },
    stop("stop 1e-2", "a pixel stops at T < 1e-2", &[constant(STOP, "TRANSMITTANCE_MIN = 1e-2;")]),
    stop("stop 1e-3", "a pixel stops at T < 1e-3", &[constant(STOP, "TRANSMITTANCE_MIN = 1e-3;")]),
    stop("stop 1e-5", "a pixel stops at T < 1e-5", &[constant(STOP, "TRANSMITTANCE_MIN = 1e-5;")]),
    stop("stop 0", "no pixel stops", &[constant(STOP, "TRANSMITTANCE_MIN = 0.0;")]),
    cut("cut 1/64", "pairs count from alpha 1/64", &[constant(CUT, "ALPHA_MIN = 1.0 / 64.0;")]),
    cut("cut 1/1024", "pairs count from alpha 1/1024", &[constant(CUT, "ALPHA_MIN = 1.0 / 1024.0;")]),
    Mode {
        name: "tiles: box",
        family: Family::TileTest,
        about: "a splat is listed in every tile of its bounding box",
        stems: BINNING,
        patches: &[ALL_TOUCHED],
        ..PLAIN
    },
    Mode {
        name: "tiles: 3 sigma",
        family: Family::TileTest,
        about: "in every tile of the square of 3 sigma of the longer axis, as 3DGS does",
        stems: BINNING,
        patches: &[
            ALL_TOUCHED,
            Patch {
                file: "project_forward",
                find: "vec2 extent = sqrt(p.cov.xz * max(reach, 0.0)) * 1.0001 + 0.01;",
                replace: "float middle = 0.5 * (p.cov.x + p.cov.z), apart = 0.5 * (p.cov.x - p.cov.z);
    vec2 extent = vec2(ceil(3.0 * sqrt(middle + sqrt(apart * apart + p.cov.y * p.cov.y))));",
            },
        ],
        ..PLAIN
    },
    Mode {
        name: "T restarted",
        family: Family::Backward,
        about: "backward walks forward first, keeps T every 8 splats and divides in between; time of its own walk included",
        stems: &["blend_backward"],
        patches: RESTARTED,
        ..PLAIN
    },
    Mode {
        name: "T replayed",
        family: Family::Backward,
        about: "as `T restarted`, and each batch is walked forward again, no division; time of both walks included",
        stems: &["blend_backward"],
        patches: REPLAYED,
        ..PLAIN
    },
    Mode {
        name: "T from the front",
        family: Family::Backward,
        about: "backward walks front to back and subtracts from the final colour what it has passed",
        stems: &["blend_backward"],
        patches: FROM_THE_FRONT,
        ..PLAIN
    },
    Mode {
        name: "fp16 colours",
        family: Family::Packed,
        about: "colours of a splat as three halves: the blend passes read two records a splat, not three",
        stems: &["project_forward", "blend_forward", "blend_backward"],
        patches: &[
            Patch {
                file: "project_forward",
                find: "vec4(q.z, log2_o, colour.x, colour.y)",
                replace: "vec4(q.z, log2_o, uintBitsToFloat(packHalf2x16(colour.xy)), uintBitsToFloat(packHalf2x16(vec2(colour.z, 0.0))))",
            },
            Patch {
                file: "blend_forward",
                find: ", r2 = fetch4(splats, 3u * index + 2u);",
                replace: "; vec3 colour = vec3(unpackHalf2x16(floatBitsToUint(r1.z)), unpackHalf2x16(floatBitsToUint(r1.w)).x);",
            },
            Patch { file: "blend_forward", find: "vec3(r1.zw, r2.x), r2.y);", replace: "colour, 0.0);" },
            Patch {
                file: "blend_backward",
                find: ", r2 = fetch4(splats, 3u * index + 2u);",
                replace: "; vec3 colour = vec3(unpackHalf2x16(floatBitsToUint(r1.z)), unpackHalf2x16(floatBitsToUint(r1.w)).x);",
            },
            Patch { file: "blend_backward", find: "vec3(r1.zw, r2.x), 0.0);", replace: "colour, 0.0);" },
        ],
        ..PLAIN
    },
    Mode {
        name: "fp16 conic",
        family: Family::Packed,
        about: "the three numbers of the exponent are rounded to halves; its time is that of the round trip",
        stems: &["project_forward"],
        patches: &[Patch {
            file: "project_forward",
            find: "vec3 q = exponent_from_conic(p.conic);",
            replace: "vec3 q = exponent_from_conic(p.conic);
    q = vec3(unpackHalf2x16(packHalf2x16(q.xy)), unpackHalf2x16(packHalf2x16(vec2(q.z, 0.0))).x);",
        }],
        ..PLAIN
    },
    Mode {
        name: "keys: 24 bits",
        family: Family::Keys,
        about: "depth is sorted by the upper 24 bits of its f32",
        unsorted_bits: 8,
        ..PLAIN
    },
    Mode {
        name: "keys: 16 bits",
        family: Family::Keys,
        about: "by the upper 16 bits of its f32 (128 steps an octave)",
        unsorted_bits: 16,
        ..PLAIN
    },
    Mode {
        name: "keys: 16 from near",
        family: Family::Keys,
        about: "by 16 bits that count from the near plane (4,096 steps an octave, 16 octaves)",
        stems: &["compact"],
        patches: &[Patch {
            file: "compact",
            find: "keys_out[to] = key;",
            replace: "keys_out[to] = min(key - floatBitsToUint(step.near), 0x07ffffffu) << 5;",
        }],
        unsorted_bits: 16,
    },
    Mode {
        name: "determinant a c - b b",
        family: Family::Arithmetic,
        about: "determinant of the covariance without Cauchy-Binet",
        stems: &["project_forward", "project_backward"],
        patches: &[Patch {
            file: "gaussian",
            find: "float det = dot(crossed, crossed) + COV2D_BLUR * (a + c) + COV2D_BLUR * COV2D_BLUR;",
            replace: "float det = (a + COV2D_BLUR) * (c + COV2D_BLUR) - b * b;",
        }],
        ..PLAIN
    },
    Mode {
        name: "exp2 cubic",
        family: Family::Arithmetic,
        about: "exp2 by a polynomial of degree 3 (relative error 7.5e-5)",
        stems: BLENDING,
        patches: &[CUBIC_FORWARD[0], CUBIC_FORWARD[1], CUBIC_BACKWARD[0], CUBIC_BACKWARD[1]],
        ..PLAIN
    },
    Mode {
        name: "exp2 quintic",
        family: Family::Arithmetic,
        about: "exp2 by a polynomial of degree 5 (relative error 7.5e-8 before rounding)",
        stems: BLENDING,
        patches: &[QUINTIC_FORWARD[0], QUINTIC_FORWARD[1], QUINTIC_BACKWARD[0], QUINTIC_BACKWARD[1]],
        ..PLAIN
    },
];

impl Mode {
    /// The shaders of the mode for the variants that a device gets.
    pub fn compile(&self, list: &PassList) -> Result<Replacements> {
        patch::compile(self.name, self.stems, self.patches, list)
    }

    /// The list of the mode, from that of the default.
    pub fn list(&self, default: &PassList, shaders: &Replacements, digit_bits: u32) -> Result<PassList> {
        let mut list = default.clone();
        list.name = self.name.to_owned();
        if self.unsorted_bits > 0 {
            sort_fewer_bits(&mut list, self.unsorted_bits / digit_bits)?;
        }
        shaders.put_into(&mut list);
        Ok(list)
    }
}

/// Leaves out the first passes of the depth sort, those of the lowest digits.
fn sort_fewer_bits(list: &mut PassList, passes: u32) -> Result<()> {
    let stem = |work: &Work| match work {
        Work::Pass(pass) => pass.shader.stem,
        _ => "",
    };
    let place = |prefix: &str| list.work.iter().position(|work| stem(work).starts_with(prefix));
    let (Some(compact), Some(sort)) = (place("compact"), place("radix_count")) else {
        return Err(Error::Check("the step has no depth sort any more".to_owned()));
    };
    let dropped = sort..sort + 3 * passes as usize;
    if !list.work.get(dropped.clone()).is_some_and(|works| works.iter().all(|work| stem(work).starts_with("radix_"))) {
        return Err(Error::Check("the depth sort has fewer passes than are to be left out".to_owned()));
    }
    list.work.drain(dropped);
    // The sort goes back and forth between two buffers, and its result is expected in the first.
    if passes % 2 == 1
        && let Some(Work::Pass(pass)) = list.work.get_mut(compact)
    {
        for buf in &mut pass.buffers {
            *buf = match *buf {
                Buf::DEPTH_KEYS_A => Buf::DEPTH_KEYS_B,
                Buf::DEPTH_VALUES_A => Buf::DEPTH_VALUES_B,
                other => other,
            };
        }
    }
    Ok(())
}
