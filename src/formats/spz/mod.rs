//! SPZ, the compressed format of Niantic: reads versions 1 to 4, writes 3 and 4.
//!
//! Versions 1 to 3 are a single gzip stream: a header of 16 bytes, a plane per attribute, then records. Version 4 has a
//! header of 32 bytes, records, a table of sizes, and a Zstandard frame per plane. A record is a type, a length and
//! bytes. Readers skip records of unknown type; labels are such a record ([`record`]).

mod axes;
mod pack;
mod read;
mod record;
mod write;

use super::axis_signs::Signs;
use super::format::ModelFormat;
use labelgs_scene::harmonics::coefficients;
pub(super) use read::read_bytes;
pub(super) use write::{losses, write_v3};

/// The SPZ format.
pub(super) const MODEL_FORMAT: ModelFormat = ModelFormat {
    name: "SPZ",
    extensions: &[".spz"],
    contents: &["an SPZ", "a file packed by gzip"],
    read: read::read,
    write: Some(write::MODEL_WRITER),
};

/// First bytes of a header: `NGSP`.
const MAGIC: u32 = 0x5053_474E;
/// Axes of a file without an axes record: x right, y up, z back.
pub(super) const SPZ_AXES: Signs = Signs([1.0, -1.0, -1.0]);
/// Bit of the header's flags: the model is antialiased.
const ANTIALIASED_BIT: u8 = 1;
/// Bit of the header's flags: records follow.
const RECORDS_BIT: u8 = 2;
/// Most fractional bits of a position: with more, the range of 24 bits ends below 1.
const BITS_MAX: u32 = 23;

/// Returns the bytes per Gaussian in each plane: positions, alphas, colours, scales, rotations, harmonics.
fn planes(version: u32, sh_degree: u32) -> [usize; 6] {
    let positions = if version == 1 { 6 } else { 9 };
    [positions, 1, 3, 3, if version < 3 { 3 } else { 4 }, 3 * coefficients(sh_degree)]
}
