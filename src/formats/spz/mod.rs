//! SPZ, the compressed format of Niantic: versions 1 to 4 are read, 3 and 4 written.
//!
//! Versions 1 to 3 are one stream of gzip: a header of 16 bytes, a plane for each attribute, then records. Version 4 has
//! a header of 32 bytes, records, a table of sizes, and a Zstandard frame for each plane. A record is a type, a length
//! and bytes; readers skip types that they do not know, and labels are such a record ([`record`]).

mod axes;
mod pack;
mod read;
mod record;
mod write;

use super::format::ModelFormat;
use super::turn::Signs;
use labelgs_scene::harmonics::coefficients;
pub(super) use read::read_bytes;
pub(super) use write::{losses, write_v3};

/// The format by its ending.
pub(super) const FORMAT: ModelFormat = ModelFormat {
    name: "SPZ",
    endings: &[".spz"],
    contents: &["an SPZ", "a file packed by gzip"],
    read: read::read,
    write: Some(write::WRITER),
};

/// First bytes of a header: `NGSP`.
const MAGIC: u32 = 0x5053_474E;
/// Axes of a file without a record of them: x right, y up, z back.
pub(super) const AXES: Signs = Signs([1.0, -1.0, -1.0]);
/// Bit of the header's flags: the model is antialiased.
const ANTIALIASED: u8 = 1;
/// Bit of the header's flags: records follow.
const HAS_RECORDS: u8 = 2;
/// Most fractional bits of a position: with more, 24 bits end below 1.
const BITS_MAX: u32 = 23;

/// Bytes of each plane per Gaussian: positions, alphas, colours, scales, rotations, harmonics.
fn planes(version: u32, sh_degree: u32) -> [usize; 6] {
    let positions = if version == 1 { 6 } else { 9 };
    [positions, 1, 3, 3, if version < 3 { 3 } else { 4 }, 3 * coefficients(sh_degree)]
}
