//! Writes SOG.

use super::meta::{
    ANTIALIASED_MODEL, Asset, CodebookIndices, EXTRAS_VERSION, Extras, Files, Labels, META_FILE, Means, Meta, Palette,
    VERSION, View,
};
use super::{CODEBOOK_SIZE, LABELS_IMAGE, PALETTE_ROW_ENTRIES, ROTATION_ALPHA_MIN, cluster, images};
use crate::archive;
use crate::format::{Export, ModelWriter};
use crate::values::{byte, index_of_largest, opacity_byte, unit};
use labelgs_scene::harmonics::coefficients;
use labelgs_scene::{Error, Result};
use std::f32::consts::SQRT_2;
use std::io::{self, Write};

pub(super) const MODEL_WRITER: ModelWriter = ModelWriter { losses, write, checksum: None };

/// Most Gaussians: an image has up to 16383 pixels per side.
const COUNT_MAX: usize = 16_380 * 16_380;
const LABEL_MAX: u32 = 0xffff;
/// Bits per axis in the sort key of pixels.
const MORTON_BITS: u32 = 10;

fn losses(export: &Export) -> Result<Vec<String>> {
    if export.rows.is_empty() || export.rows.len() > COUNT_MAX {
        let problem = format!("a SOG holds 1 to {COUNT_MAX} Gaussians; this model has {}", export.rows.len());
        return Err(Error::usage("SOG", problem));
    }
    if let Some(label) = export.labels().and_then(|labels| labels.iter().find(|&&label| label > LABEL_MAX)) {
        return Err(Error::usage("SOG", format!("label {label} is above {LABEL_MAX}; give it a smaller id")));
    }
    Ok(Vec::new())
}

/// Returns the logarithmic position that the format stores.
fn logarithm(value: f32) -> f64 {
    f64::from(value).abs().ln_1p().copysign(f64::from(value))
}

/// Sorts the rows along a Morton curve, so that similar neighbours compress well.
fn sorted(export: &Export) -> Vec<usize> {
    let (low, high) = bounds(export, |value| value.into());
    let code = |&row: &usize| {
        let place = export.position(row);
        let cell = |axis: usize| {
            let size = high[axis] - low[axis];
            let share = if size > 0.0 { (f64::from(place[axis]) - low[axis]) / size } else { 0.0 };
            (share * f64::from((1_u32 << MORTON_BITS) - 1)) as u32
        };
        let spread =
            |cell: u32, axis: u32| (0..MORTON_BITS).map(|bit| (cell >> bit & 1) << (3 * bit + axis)).sum::<u32>();
        spread(cell(0), 0) | spread(cell(1), 1) | spread(cell(2), 2)
    };
    let mut rows = export.rows.to_vec();
    rows.sort_by_cached_key(code);
    rows
}

fn bounds(export: &Export, value: impl Fn(f32) -> f64) -> ([f64; 3], [f64; 3]) {
    let (mut low, mut high) = ([f64::MAX; 3], [f64::MIN; 3]);
    for &row in export.rows {
        for (axis, coordinate) in export.position(row).into_iter().enumerate() {
            low[axis] = low[axis].min(value(coordinate));
            high[axis] = high[axis].max(value(coordinate));
        }
    }
    (low, high)
}

fn write(export: &Export, out: &mut dyn Write) -> io::Result<()> {
    let g = export.model;
    let rows = sorted(export);
    let width = ((rows.len() as f64).sqrt() / 4.0).ceil() as usize * 4;
    let height = rows.len().div_ceil(width).next_multiple_of(4);
    let mut files = Vec::new();
    let mut add = |name: &str, texels: &[[u8; 4]], width: usize, height: usize| -> io::Result<String> {
        files.push((name.to_owned(), images::encode(texels, width, height)?));
        Ok(name.to_owned())
    };
    let (mins, maxs) = bounds(export, logarithm);
    let place = |&row: &usize| {
        let at = export.position(row);
        [0, 1, 2].map(|axis| {
            let size = maxs[axis] - mins[axis];
            let share = if size > 0.0 { (logarithm(at[axis]) - mins[axis]) / size } else { 0.0 };
            ((65_535.0 * share).round() as u16).to_le_bytes()
        })
    };
    let half = |which: usize| -> Vec<[u8; 4]> {
        rows.iter().map(|row| place(row).map(|pair| pair[which])).map(|[x, y, z]| [x, y, z, 255]).collect()
    };
    let means = Means {
        mins,
        maxs,
        files: [add("means_l.webp", &half(0), width, height)?, add("means_u.webp", &half(1), width, height)?],
    };
    let quats: Vec<[u8; 4]> = rows.iter().map(|&row| rotation(g.quats[row])).collect();
    let quats = Files { files: [add("quats.webp", &quats, width, height)?] };
    let book = cluster::numbers(rows.iter().flat_map(|&row| g.scales[row]), CODEBOOK_SIZE);
    let texel = |&row: &usize| {
        let [x, y, z] = g.scales[row].map(|value| cluster::nearest(&book, value));
        [x, y, z, 255]
    };
    let scales = rows.iter().map(texel).collect::<Vec<_>>();
    let scales = CodebookIndices { files: [add("scales.webp", &scales, width, height)?], codebook: book };
    let book = cluster::numbers(rows.iter().flat_map(|&row| g.sh0[row]), CODEBOOK_SIZE);
    let texel = |&row: &usize| {
        let [r, g_, b] = g.sh0[row].map(|value| cluster::nearest(&book, value));
        [r, g_, b, opacity_byte(g.opacities[row])]
    };
    let sh0 = rows.iter().map(texel).collect::<Vec<_>>();
    let sh0 = CodebookIndices { files: [add("sh0.webp", &sh0, width, height)?], codebook: book };
    let rest = if g.sh_degree > 0 { Some(palette(export, &rows, (width, height), &mut add)?) } else { None };
    let extras = extras(export, &rows, (width, height), &mut add)?;
    let asset = Asset { generator: concat!("labelgs ", env!("CARGO_PKG_VERSION")).into() };
    let model = export.model.antialiased.then(|| ANTIALIASED_MODEL.to_owned());
    let (version, count) = (VERSION, rows.len());
    let meta = Meta { version, asset, count, model, antialias: false, means, scales, quats, sh0, rest, extras };
    files.push((META_FILE.into(), serde_json::to_vec(&meta)?));
    out.write_all(&archive::pack(files, 1)?)
}

/// Encodes a rotation as its three smaller components and the index of the largest.
fn rotation(quat: [f32; 4]) -> [u8; 4] {
    let unit = unit(quat);
    let largest = index_of_largest(unit);
    let sign = if unit[largest] < 0.0 { -SQRT_2 } else { SQRT_2 };
    let mut texel = [0, 0, 0, ROTATION_ALPHA_MIN + largest as u8];
    let others = (0..4).filter(|&at| at != largest);
    texel.iter_mut().zip(others).for_each(|(to, at)| *to = byte(255.0 * (0.5 * sign * unit[at] + 0.5)));
    texel
}

type AddImage<'a> = dyn FnMut(&str, &[[u8; 4]], usize, usize) -> io::Result<String> + 'a;

/// Writes the label image, if there are labels.
fn extras(
    export: &Export,
    rows: &[usize],
    (width, height): (usize, usize),
    add: &mut AddImage,
) -> io::Result<Option<Extras>> {
    let view = export.options.first_view.map(|view| View { up: view.up.to_array(), eye: view.eye.to_array() });
    let Some(labels) = export.labels() else { return Ok(view.map(|_| Extras { labelgs: None, view })) };
    let shares = export.label_confidence();
    let texel = |&row: &usize| {
        let [low, high, _, _] = labels[row].to_le_bytes();
        [low, high, shares.map_or(255, |shares| byte(255.0 * shares[row])), 255]
    };
    let file = add(LABELS_IMAGE, &rows.iter().map(texel).collect::<Vec<_>>(), width, height)?;
    let names = export.names.cloned();
    let labels = Labels { version: EXTRAS_VERSION, file, confidence: shares.is_some(), names };
    Ok(Some(Extras { labelgs: Some(labels), view }))
}

/// Writes the palette of harmonics.
fn palette(
    export: &Export,
    rows: &[usize],
    (width, height): (usize, usize),
    add: &mut AddImage,
) -> io::Result<Palette> {
    let bands = export.model.sh_degree;
    let values: Vec<f32> = rows.iter().flat_map(|&row| export.model.rest(row).as_flattened()).copied().collect();
    // Like other writers: at most 64 Ki entries, fewer than Gaussians.
    let size = ((rows.len() as f64 / 1024.0).log2().floor().exp2().min(64.0) * 1024.0) as usize;
    let (centres, of) = cluster::vectors(&values, 3 * coefficients(bands), size.max(1));
    let book = cluster::numbers(centres.iter().flatten().copied(), CODEBOOK_SIZE);
    let across = PALETTE_ROW_ENTRIES * coefficients(bands);
    let down = centres.len().div_ceil(PALETTE_ROW_ENTRIES);
    let mut texels = vec![[0, 0, 0, 255]; across * down];
    for (entry, centre) in centres.iter().enumerate() {
        let start = entry / PALETTE_ROW_ENTRIES * across + entry % PALETTE_ROW_ENTRIES * coefficients(bands);
        for (k, triple) in centre.chunks_exact(3).enumerate() {
            let index = |channel: usize| cluster::nearest(&book, triple[channel]);
            texels[start + k] = [index(0), index(1), index(2), 255];
        }
    }
    let entries: Vec<[u8; 4]> =
        of.iter().map(|entry| entry.to_le_bytes()).map(|[low, high]| [low, high, 0, 255]).collect();
    let files = [add("shN_centroids.webp", &texels, across, down)?, add("shN_labels.webp", &entries, width, height)?];
    Ok(Palette { count: centres.len(), bands, codebook: book, files })
}
