//! Reads and writes SPZ with the crate `spz`, which is independent of labelgs: `spz-oracle unpack IN.spz OUT.ply`,
//! `spz-oracle pack IN.ply OUT.spz`. The PLY is a 3DGS PLY with only floats.

use spz::{CoordinateSystem, GaussianSplat, PackOptions, UnpackOptions};
use std::{env, error::Error, fs};

/// Columns of a 3DGS PLY before the harmonics.
const COLUMNS_BEFORE_SH: [&str; 6] = ["x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2"];
/// Columns after the harmonics.
const COLUMNS_AFTER_SH: [&str; 8] = ["opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"];

fn main() -> Result<(), Box<dyn Error>> {
    let args: Vec<String> = env::args().skip(1).collect();
    match args.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["unpack", from, to] => unpack(from, to),
        ["pack", from, to] => pack(from, to),
        _ => Err("unpack IN.spz OUT.ply, or pack IN.ply OUT.spz".into()),
    }
}

fn unpack(from: &str, to: &str) -> Result<(), Box<dyn Error>> {
    let options = UnpackOptions::builder().to_coord_system(CoordinateSystem::RDF).build();
    let g = GaussianSplat::load_packed_from_file(from, &options)?;
    let count = g.num_points as usize;
    let rest = g.spherical_harmonics.len() / count / 3;
    let columns = COLUMNS_BEFORE_SH.map(str::to_owned).into_iter();
    let columns =
        columns.chain((0..3 * rest).map(|k| format!("f_rest_{k}"))).chain(COLUMNS_AFTER_SH.map(str::to_owned));
    let properties: String = columns.map(|name| format!("property float {name}\n")).collect();
    let header = format!("ply\nformat binary_little_endian 1.0\nelement vertex {count}\n{properties}end_header\n");
    let mut bytes = header.into_bytes();
    for row in 0..count {
        let triple = |values: &[f32]| values[3 * row..][..3].to_vec();
        // The file has triples of colours; a PLY stores them channel by channel.
        let harmonic = |k: usize| g.spherical_harmonics[3 * (row * rest + k % rest) + k / rest];
        let [x, y, z, w] = [0, 1, 2, 3].map(|k| g.rotations[4 * row + k]);
        let values = [triple(&g.positions), triple(&g.colors), (0..3 * rest).map(harmonic).collect()];
        let values = values.into_iter().chain([vec![g.alphas[row]], triple(&g.scales), vec![w, x, y, z]]);
        values.flatten().for_each(|value| bytes.extend(value.to_le_bytes()));
    }
    Ok(fs::write(to, bytes)?)
}

fn pack(from: &str, to: &str) -> Result<(), Box<dyn Error>> {
    let bytes = fs::read(from)?;
    let end = bytes.windows(11).position(|window| window == b"end_header\n").ok_or("no header")? + 11;
    let header = std::str::from_utf8(&bytes[..end])?;
    let columns: Vec<&str> = header.lines().filter_map(|line| line.strip_prefix("property float ")).collect();
    let floats: Vec<f32> = bytes[end..].chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
    let of = |names: &[String]| -> Result<Vec<f32>, Box<dyn Error>> {
        let at = |name: &String| columns.iter().position(|column| column == name).ok_or(format!("no {name}"));
        let places = names.iter().map(at).collect::<Result<Vec<_>, _>>()?;
        Ok(floats.chunks_exact(columns.len()).flat_map(|row| places.iter().map(|&at| row[at])).collect())
    };
    let named = |names: &[&str]| of(&names.iter().map(|&name| name.to_owned()).collect::<Vec<_>>());
    let rest = columns.iter().filter(|name| name.starts_with("f_rest_")).count() / 3;
    let harmonics: Vec<String> =
        (0..rest).flat_map(|k| [0, 1, 2].map(|channel| format!("f_rest_{}", channel * rest + k))).collect();
    let g = GaussianSplat {
        num_points: (floats.len() / columns.len()) as i32,
        spherical_harmonics_degree: ((rest + 1) as f64).sqrt() as i32 - 1,
        antialiased: false,
        positions: named(&COLUMNS_BEFORE_SH[..3])?,
        colors: named(&COLUMNS_BEFORE_SH[3..])?,
        spherical_harmonics: of(&harmonics)?,
        alphas: named(&COLUMNS_AFTER_SH[..1])?,
        scales: named(&COLUMNS_AFTER_SH[1..4])?,
        rotations: named(&["rot_1", "rot_2", "rot_3", "rot_0"])?,
    };
    g.save_as_packed(to, &PackOptions::builder().from(CoordinateSystem::RDF).build())?;
    Ok(())
}
