//! Reads SOG.

use super::archive::{Archive, Picture};
use super::meta::{EXTRAS_VERSION, FILE, Meta, VERSION};
use super::{CODEBOOK, PALETTE_ROW, ROTATION, coefficients};
use crate::error::{Error, Result};
use crate::io::model::format::ReadModel;
use crate::io::model::rows::{Row, Rows};
use crate::io::model::values::logit_of_byte;
use crate::io::read as file;
use std::f64::consts::SQRT_2;
use std::path::Path;

/// Reads a SOG of version 2.
pub(super) fn read(path: &Path) -> Result<ReadModel> {
    let bytes = file::bytes(path)?;
    let mut archive = Archive::open(path, &bytes)?;
    let text = archive.file(FILE)?;
    let meta: Meta = serde_json::from_slice(&text)
        .map_err(|error| Error::data(path, FILE, format!("{error}; expected that of a SOG; export the file again")))?;
    let bad = |place: &str, problem: String| Error::data(path, place, format!("{problem}; export the file again"));
    if meta.version != VERSION {
        return Err(bad(FILE, format!("has version {}; {VERSION} is read", meta.version)));
    }
    let count = meta.count;
    let [low, high] = [archive.picture(&meta.means.files[0])?, archive.picture(&meta.means.files[1])?];
    let (quats, scales) = (archive.picture(&meta.quats.files[0])?, archive.picture(&meta.scales.files[0])?);
    let sh0 = archive.picture(&meta.sh0.files[0])?;
    let mut rest = None;
    if let Some(own) = &meta.rest {
        if !(1..=3).contains(&own.bands) {
            return Err(bad(FILE, format!("has harmonics of degree {}; expected 1 to 3", own.bands)));
        }
        let [entries, palette] = [archive.picture(&own.files[1])?, archive.picture(&own.files[0])?];
        if palette.width != PALETTE_ROW * coefficients(own.bands) {
            return Err(bad(&own.files[0], format!("is {} wide, expected {PALETTE_ROW} entries a row", palette.width)));
        }
        rest = Some((own, entries, palette));
    }
    let own = meta.extras.as_ref().and_then(|extras| extras.labelgs.as_ref());
    let own = own.filter(|own| own.version == EXTRAS_VERSION);
    let labels = own.map(|own| archive.picture(&own.file)).transpose()?;
    let pictures =
        [&low, &high, &quats, &scales, &sh0].into_iter().chain(&labels).chain(rest.as_ref().map(|rest| &rest.1));
    if count == 0 || pictures.into_iter().any(|picture| picture.texels.len() < count) {
        return Err(bad(FILE, format!("has {count} Gaussians, and a picture has fewer pixels")));
    }
    let books =
        [&meta.scales.codebook, &meta.sh0.codebook].into_iter().chain(rest.as_ref().map(|rest| &rest.0.codebook));
    if books.into_iter().any(|book| book.len() != CODEBOOK) {
        return Err(bad(FILE, format!("has a codebook of other than {CODEBOOK} numbers")));
    }
    let bands = rest.as_ref().map_or(0, |rest| rest.0.bands);
    let mut triples = vec![[0.0; 3]; coefficients(bands)];
    let confident = own.is_some_and(|own| own.confidence);
    let mut rows = Rows::new(bands, labels.is_some(), confident);
    for index in 0..count {
        if let Some((own, entries, palette)) = &rest {
            harmonics(&mut triples, &own.codebook, palette, entries.texels[index])
                .ok_or_else(|| bad(&own.files[1], format!("pixel {index} names no entry of the palette")))?;
        }
        let place = |axis: usize| {
            let steps = f64::from(u16::from_le_bytes([low.texels[index][axis], high.texels[index][axis]]));
            let (least, most) = (meta.means.mins[axis], meta.means.maxs[axis]);
            let logarithm = least + (most - least) * steps / 65_535.0;
            logarithm.abs().exp_m1().copysign(logarithm)
        };
        let of_book = |book: &[f32], texel: [u8; 4]| [0, 1, 2].map(|at| book[usize::from(texel[at])]);
        let label = labels.as_ref().map(|labels| labels.texels[index]);
        rows.push(&Row {
            position: [place(0), place(1), place(2)],
            quat: quat(quats.texels[index]),
            scale: of_book(&meta.scales.codebook, scales.texels[index]),
            opacity: logit_of_byte(sh0.texels[index][3]),
            sh0: of_book(&meta.sh0.codebook, sh0.texels[index]),
            rest: &triples,
            label: label.map(|[low, high, _, _]| u32::from(u16::from_le_bytes([low, high]))),
            confidence: label.map(|texel| f32::from(texel[2]) / 255.0),
        });
    }
    let names = own.and_then(|own| own.names.as_ref());
    let names = names.map(|names| names.checked(path)).transpose()?;
    Ok(ReadModel { names, ..rows.finish(path, None)? })
}

/// Fills in the harmonics of a palette's entry; `None` if there is no such entry.
fn harmonics(to: &mut [[f32; 3]], book: &[f32], palette: &Picture, [low, high, _, _]: [u8; 4]) -> Option<()> {
    let entry = usize::from(u16::from_le_bytes([low, high]));
    let start = entry / PALETTE_ROW * palette.width + entry % PALETTE_ROW * to.len();
    let texels = palette.texels.get(start..start + to.len())?;
    to.iter_mut().zip(texels).for_each(|(triple, texel)| *triple = [0, 1, 2].map(|at| book[usize::from(texel[at])]));
    Some(())
}

/// The rotation (w, x, y, z) of a pixel.
fn quat([a, b, c, which]: [u8; 4]) -> [f64; 4] {
    if which < ROTATION {
        return [1.0, 0.0, 0.0, 0.0];
    }
    let [a, b, c] = [a, b, c].map(|value| (f64::from(value) / 255.0 * 2.0 - 1.0) / SQRT_2);
    let largest = (1.0 - a * a - b * b - c * c).max(0.0).sqrt();
    match which - ROTATION {
        0 => [largest, a, b, c],
        1 => [a, largest, b, c],
        2 => [a, b, largest, c],
        _ => [a, b, c, largest],
    }
}
