//! Reads SOG.

use super::images::{Image, picture};
use super::meta::{ANTIALIASED_MODEL, EXTRAS_VERSION, Labels, META_FILE, Meta, VERSION};
use super::{CODEBOOK_SIZE, PALETTE_ROW_ENTRIES, ROTATION_ALPHA_MIN};
use crate::archive::Archive;
use crate::format::{FirstView, ReadModel};
use crate::rows::{Row, Rows};
use crate::values::{logit_of_byte, with_largest};
use labelgs_files::read as file;
use labelgs_scene::harmonics::coefficients;
use labelgs_scene::{Error, Result};
use std::f64::consts::SQRT_2;
use std::path::Path;

/// The images of a file, each with a pixel for every Gaussian.
struct Images {
    low: Image,
    high: Image,
    quats: Image,
    scales: Image,
    sh0: Image,
    /// The palette index of each Gaussian, and the palette.
    rest: Option<(Image, Image)>,
    labels: Option<Image>,
}

/// Reads a SOG of version 2.
pub(super) fn read(path: &Path) -> Result<ReadModel> {
    let bytes = file::bytes(path)?;
    let mut archive = Archive::open(path, &bytes, "SOG")?;
    let text = archive.file(META_FILE)?;
    let meta: Meta = serde_json::from_slice(&text)
        .map_err(|error| Error::data(path, META_FILE, format!("{error}; expected that of a SOG; export it again")))?;
    if meta.version != VERSION {
        return Err(bad(path, META_FILE, format!("has version {}; {VERSION} is read", meta.version)));
    }
    let view = meta.extras.as_ref().and_then(|extras| extras.view);
    let own = meta.extras.as_ref().and_then(|extras| extras.labelgs.as_ref());
    let own = own.filter(|own| own.version == EXTRAS_VERSION);
    let pictures = pictures(path, &meta, own, &mut archive)?;
    let bands = meta.rest.as_ref().map_or(0, |rest| rest.bands);
    let mut triples = vec![[0.0; 3]; coefficients(bands)];
    let mut rows = Rows::new(bands, own.is_some(), own.is_some_and(|own| own.confidence));
    for index in 0..meta.count {
        if let (Some(own), Some((entries, palette))) = (&meta.rest, &pictures.rest) {
            harmonics(&mut triples, &own.codebook, palette, entries.texels[index])
                .ok_or_else(|| bad(path, &own.files[1], format!("pixel {index} refers to a missing palette entry")))?;
        }
        let place = |axis: usize| {
            let steps = [&pictures.low, &pictures.high].map(|picture| picture.texels[index][axis]);
            let (least, most) = (meta.means.mins[axis], meta.means.maxs[axis]);
            let logarithm = least + (most - least) * f64::from(u16::from_le_bytes(steps)) / 65_535.0;
            logarithm.abs().exp_m1().copysign(logarithm)
        };
        let of_book = |book: &[f32], texel: [u8; 4]| [0, 1, 2].map(|at| book[usize::from(texel[at])]);
        let label = pictures.labels.as_ref().map(|labels| labels.texels[index]);
        rows.push(&Row {
            position: [place(0), place(1), place(2)],
            quat: quat(pictures.quats.texels[index]),
            scale: of_book(&meta.scales.codebook, pictures.scales.texels[index]),
            opacity: logit_of_byte(pictures.sh0.texels[index][3]),
            sh0: of_book(&meta.sh0.codebook, pictures.sh0.texels[index]),
            rest: &triples,
            label: label.map(|[low, high, _, _]| u32::from(u16::from_le_bytes([low, high]))),
            confidence: label.map(|texel| f32::from(texel[2]) / 255.0),
        });
    }
    let names = own.and_then(|own| own.names.as_ref());
    let names = names.map(|names| names.checked(path)).transpose()?;
    let mut read = rows.finish(path, None)?;
    read.gaussians.antialiased = meta.antialias || meta.model.as_deref() == Some(ANTIALIASED_MODEL);
    let first_view = view.and_then(|view| FirstView::checked(view.up.into(), view.eye.into()));
    Ok(ReadModel { names, first_view, ..read })
}

fn bad(path: &Path, place: &str, problem: String) -> Error {
    Error::data(path, place, format!("{problem}; export the file again"))
}

/// Reads the images, and checks their sizes and the codebooks.
fn pictures(path: &Path, meta: &Meta, own: Option<&Labels>, archive: &mut Archive) -> Result<Images> {
    let mut rest = None;
    if let Some(own) = &meta.rest {
        if !(1..=3).contains(&own.bands) {
            return Err(bad(path, META_FILE, format!("has harmonics of degree {}; expected 1 to 3", own.bands)));
        }
        let (entries, palette) = (picture(archive, &own.files[1])?, picture(archive, &own.files[0])?);
        if palette.width != PALETTE_ROW_ENTRIES * coefficients(own.bands) {
            let problem = format!("is {} wide, expected {PALETTE_ROW_ENTRIES} entries a row", palette.width);
            return Err(bad(path, &own.files[0], problem));
        }
        rest = Some((entries, palette));
    }
    let all = Images {
        low: picture(archive, &meta.means.files[0])?,
        high: picture(archive, &meta.means.files[1])?,
        quats: picture(archive, &meta.quats.files[0])?,
        scales: picture(archive, &meta.scales.files[0])?,
        sh0: picture(archive, &meta.sh0.files[0])?,
        labels: own.map(|own| picture(archive, &own.file)).transpose()?,
        rest,
    };
    let needed = [&all.low, &all.high, &all.quats, &all.scales, &all.sh0].into_iter().chain(&all.labels);
    let least = needed.chain(all.rest.as_ref().map(|rest| &rest.0)).map(|picture| picture.texels.len()).min();
    if meta.count == 0 || least < Some(meta.count) {
        return Err(bad(path, META_FILE, format!("has {} Gaussians, but an image has fewer pixels", meta.count)));
    }
    let books =
        [&meta.scales.codebook, &meta.sh0.codebook].into_iter().chain(meta.rest.as_ref().map(|rest| &rest.codebook));
    if books.into_iter().any(|book| book.len() != CODEBOOK_SIZE) {
        return Err(bad(path, META_FILE, format!("has a codebook without exactly {CODEBOOK_SIZE} numbers")));
    }
    Ok(all)
}

/// Decodes the harmonics of a palette entry; `None` if the palette has no such entry.
fn harmonics(to: &mut [[f32; 3]], book: &[f32], palette: &Image, [low, high, _, _]: [u8; 4]) -> Option<()> {
    let entry = usize::from(u16::from_le_bytes([low, high]));
    let start = entry / PALETTE_ROW_ENTRIES * palette.width + entry % PALETTE_ROW_ENTRIES * to.len();
    let texels = palette.texels.get(start..start + to.len())?;
    to.iter_mut().zip(texels).for_each(|(triple, texel)| *triple = [0, 1, 2].map(|at| book[usize::from(texel[at])]));
    Some(())
}

/// Decodes the rotation (w, x, y, z) of a pixel.
fn quat([a, b, c, which]: [u8; 4]) -> [f64; 4] {
    if which < ROTATION_ALPHA_MIN {
        return [1.0, 0.0, 0.0, 0.0];
    }
    let [a, b, c] = [a, b, c].map(|value| (f64::from(value) / 255.0 * 2.0 - 1.0) / SQRT_2);
    let largest = (1.0 - a * a - b * b - c * c).max(0.0).sqrt();
    with_largest(largest, u32::from(which - ROTATION_ALPHA_MIN), [a, b, c])
}
