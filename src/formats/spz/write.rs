//! Writes SPZ.

use super::{ANTIALIASED_BIT, BITS_MAX, MAGIC, RECORDS_BIT, SPZ_AXES, pack, planes, record};
use crate::format::{Export, ModelWriter, SpzVersion};
use crate::values::opacity_byte;
use flate2::Compression;
use flate2::write::GzEncoder;
use labelgs_scene::{Error, Result};
use std::io::{self, Write};

pub(super) const MODEL_WRITER: ModelWriter = ModelWriter { losses, write, checksum: Some(checksum) };

/// Largest integer value of a position.
const STEPS_MAX: f32 = 8_388_607.0;
/// Fractional bits that other writers use.
const USUAL_BITS: u32 = 12;
/// Fewest steps across a scene: a smaller scene gets more fractional bits to keep its detail.
const SCENE_STEPS_MIN: f32 = 32_768.0;
/// Zstandard level, as other writers use it.
const ZSTD_LEVEL: i32 = 12;

/// Returns the largest coordinate of an export.
fn extent(export: &Export) -> f32 {
    let largest = |row: &usize| export.position(*row).iter().fold(0.0_f32, |most, value| most.max(value.abs()));
    export.rows.iter().map(largest).fold(0.0, f32::max)
}

/// Returns the most fractional bits with which all positions fit into 24 bits.
fn bits(extent: f32) -> u32 {
    let fitting = |most: f32, count: f32| if count > 0.0 { (most / count).log2() } else { f32::from(u8::MAX) };
    // Rounding may add half a step.
    let most = fitting(STEPS_MAX - 1.0, extent).floor().clamp(0.0, BITS_MAX as f32) as u32;
    let least = fitting(SCENE_STEPS_MIN, extent).ceil().clamp(0.0, BITS_MAX as f32) as u32;
    most.min(least.max(USUAL_BITS))
}

pub fn losses(export: &Export) -> Result<Vec<String>> {
    let (g, extent) = (export.model, extent(export));
    if export.rows.is_empty() || export.rows.len() > i32::MAX as usize {
        let problem = format!("an SPZ holds 1 to {} Gaussians; this model has {}", i32::MAX, export.rows.len());
        return Err(Error::usage("SPZ", problem));
    }
    if extent >= STEPS_MAX {
        let problem =
            format!("a Gaussian is {extent} from the origin, an SPZ ends at {STEPS_MAX}; remove distant ones first");
        return Err(Error::usage("SPZ", problem));
    }
    let mut losses = Vec::new();
    if bits(extent) < USUAL_BITS {
        let step = 1.0 / f64::from(1_u32 << bits(extent));
        losses.push(format!("positions are rounded to {step}, because a Gaussian is {extent} from the origin"));
    }
    let count = |is_cut: &dyn Fn(usize) -> bool| export.rows.iter().filter(|&&row| is_cut(row)).count();
    let outside = |values: &[f32], low: f32, high: f32| values.iter().any(|value| !(low..=high).contains(value));
    let cut = [
        (count(&|row| outside(&g.scales[row], -10.03, 5.97)), "sizes beyond e^-10 to e^5.94"),
        (count(&|row| outside(&g.sh0[row], -3.34, 3.34)), "colours beyond -0.44 to 1.44"),
        (count(&|row| outside(export.model.rest(row).as_flattened(), -1.07, 1.06)), "harmonics beyond -1 to 1"),
    ];
    for (count, what) in cut.into_iter().filter(|cut| cut.0 > 0) {
        losses.push(format!("{count} of {} Gaussians have {what}, which are clamped", export.rows.len()));
    }
    Ok(losses)
}

fn positions(export: &Export) -> Vec<u8> {
    let bits = bits(extent(export));
    let row = |&row: &usize| SPZ_AXES.position(export.position(row)).map(|value| pack::position(value, bits));
    export.rows.iter().flat_map(row).flatten().collect()
}

/// Returns a checksum of the positions, which ties the labels beside the file to its Gaussians.
fn checksum(export: &Export) -> u32 {
    crc32fast::hash(&positions(export))
}

/// Encodes the planes in order.
fn encode(export: &Export) -> [Vec<u8>; 6] {
    let g = export.model;
    let bytes = planes(3, g.sh_degree);
    let mut to = bytes.map(|bytes| Vec::with_capacity(bytes * export.rows.len()));
    to[0] = positions(export);
    let mut rest = Vec::new();
    for &row in export.rows {
        to[1].push(opacity_byte(g.opacities[row]));
        to[2].extend(g.sh0[row].map(pack::colour));
        to[3].extend(g.scales[row].map(pack::scale_byte));
        to[4].extend(pack::rotation(SPZ_AXES.quat(g.quats[row])));
        rest.clear();
        rest.extend_from_slice(export.model.rest(row));
        SPZ_AXES.rest(&mut rest);
        to[5].extend(rest.iter().enumerate().flat_map(|(k, triple)| triple.map(|value| pack::harmonic(k, value))));
    }
    to
}

fn write(export: &Export, out: &mut dyn Write) -> io::Result<()> {
    write_version(export, export.options.spz_version == SpzVersion::V4, out)
}

/// Writes version 3, whatever the options request.
pub fn write_v3(export: &Export, out: &mut dyn Write) -> io::Result<()> {
    write_version(export, false, out)
}

fn write_version(export: &Export, is_v4: bool, out: &mut dyn Write) -> io::Result<()> {
    let records = record::write(export)?;
    let planes = encode(export);
    let count = export.rows.len() as u32;
    let mut header = MAGIC.to_le_bytes().to_vec();
    header.extend(if is_v4 { 4_u32 } else { 3 }.to_le_bytes());
    header.extend(count.to_le_bytes());
    let antialiased = if export.model.antialiased { ANTIALIASED_BIT } else { 0 };
    let flags = antialiased | if records.is_empty() { 0 } else { RECORDS_BIT };
    header.extend([export.model.sh_degree as u8, bits(extent(export)) as u8, flags]);
    if !is_v4 {
        header.push(0);
        let mut out = GzEncoder::new(out, Compression::default());
        out.write_all(&header)?;
        planes.iter().try_for_each(|plane| out.write_all(plane))?;
        out.write_all(&records)?;
        return out.finish().map(|_| ());
    }
    let planes: Vec<&Vec<u8>> = planes.iter().filter(|plane| !plane.is_empty()).collect();
    header.push(planes.len() as u8);
    header.extend((32 + records.len() as u32).to_le_bytes());
    header.extend([0; 12]);
    let packed = planes.iter().map(|plane| zstd::bulk::compress(plane, ZSTD_LEVEL)).collect::<io::Result<Vec<_>>>()?;
    out.write_all(&header)?;
    out.write_all(&records)?;
    for (plane, packed) in planes.iter().zip(&packed) {
        out.write_all(&(packed.len() as u64).to_le_bytes())?;
        out.write_all(&(plane.len() as u64).to_le_bytes())?;
    }
    packed.iter().try_for_each(|packed| out.write_all(packed))
}
