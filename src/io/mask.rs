//! Id images: which object each pixel of a photo shows.
//!
//! The pixel value is the id and 0 is unlabelled: grey PNG of any depth, or palette PNG, whose *index* is the id.
//! Colours are never turned into ids: two palette entries may share a colour, and a colour code needs its legend.

use super::image::check_size;
use super::resample::same_aspect;
use crate::error::{Error, Result};
use crate::scene::LabelMap;
use std::collections::HashMap;
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

type Decoder = png::Decoder<BufReader<File>>;

fn problem(path: &Path, error: impl std::fmt::Display) -> Error {
    Error::data(path, "", format!("is no readable PNG mask: {error}"))
}

/// Reads an id image: 8- or 16-bit grey, palette indices, or either with 1, 2 or 4 bits.
pub fn read_mask(path: impl AsRef<Path>) -> Result<LabelMap> {
    read_checked(path.as_ref(), |_| Ok(()))
}

/// Like [`read_mask`], with `accept` asked about the size before a pixel is decoded.
pub(crate) fn read_checked(path: &Path, accept: impl FnOnce((u32, u32)) -> Result<()>) -> Result<LabelMap> {
    let file = File::open(path).map_err(Error::read(path))?;
    let mut decoder = Decoder::new(BufReader::new(file));
    // Any other choice expands a palette to colours or drops the low half of 16-bit ids.
    decoder.set_transformations(png::Transformations::IDENTITY);
    let mut reader = decoder.read_info().map_err(|error| problem(path, error))?;
    let (size, colour, depth) = {
        let info = reader.info();
        ((info.width, info.height), info.color_type, info.bit_depth)
    };
    check_size(path, size)?;
    if !matches!(colour, png::ColorType::Grayscale | png::ColorType::Indexed) {
        let text = format!(
            "a mask holds one id per pixel as grey value or palette index; this PNG is {colour:?}. Convert it: for \
             ids coded as R + 256 G + 65536 B write the number as 16-bit grey (DEVA: use --use_short_id), for \
             display colours use the id image they were made from"
        );
        return Err(Error::data(path, "", text));
    }
    accept(size)?;
    let length = reader.output_buffer_size().ok_or_else(|| problem(path, "too large"))?;
    let mut bytes = vec![0; length];
    let frame = reader.next_frame(&mut bytes).map_err(|error| problem(path, error))?;
    let ids = bytes.chunks_exact(frame.line_size).take(size.1 as usize);
    let ids = ids.flat_map(|line| unpack(line, depth, size.0 as usize)).collect();
    Ok(LabelMap { width: size.0, height: size.1, ids })
}

/// The samples of one line.
fn unpack(line: &[u8], depth: png::BitDepth, width: usize) -> Vec<u16> {
    let packed = |bits: usize| {
        let per_byte = 8 / bits;
        let sample = move |x: usize| {
            let shift = 8 - bits * (x % per_byte + 1);
            u16::from(line[x / per_byte] >> shift) & ((1 << bits) - 1)
        };
        (0..width).map(sample).collect()
    };
    match depth {
        png::BitDepth::One => packed(1),
        png::BitDepth::Two => packed(2),
        png::BitDepth::Four => packed(4),
        png::BitDepth::Eight => line.iter().take(width).map(|&id| u16::from(id)).collect(),
        png::BitDepth::Sixteen => {
            line.chunks_exact(2).take(width).map(|pair| u16::from_be_bytes([pair[0], pair[1]])).collect()
        }
    }
}

/// True if a mask of the size `found` can serve a photo of the size `photo`: it is a scaled one.
pub fn mask_size_fits(found: (u32, u32), photo: (u32, u32)) -> bool {
    same_aspect(found, photo)
}

/// Finds the mask of a photo by its name.
pub(crate) struct MaskFolder {
    folder: PathBuf,
    /// How many photos share a file stem; a flat folder serves only stems that are unique.
    stems: HashMap<String, usize>,
    /// How many share a path cut at the first dot of the file name, likewise.
    cut: HashMap<PathBuf, usize>,
}

fn stem(name: &str) -> String {
    Path::new(name).file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default()
}

/// The path with the file name cut at its first dot, as Gaussian Grouping does.
fn cut_at_first_dot(name: &str) -> PathBuf {
    let path = Path::new(name);
    let file = path.file_name().map(|file| file.to_string_lossy().into_owned()).unwrap_or_default();
    path.with_file_name(file.split('.').next().unwrap_or_default())
}

impl MaskFolder {
    /// `names` are those of all photos of the scene.
    pub(crate) fn new<'a>(folder: &Path, names: impl Iterator<Item = &'a str>) -> Result<Self> {
        if !folder.is_dir() {
            return Err(Error::data(folder, "", "there is no such folder of masks"));
        }
        let (mut stems, mut cut) = (HashMap::new(), HashMap::new());
        for name in names {
            *stems.entry(stem(name)).or_insert(0) += 1;
            *cut.entry(cut_at_first_dot(name)).or_insert(0) += 1;
        }
        Ok(Self { folder: folder.to_owned(), stems, cut })
    }

    /// Paths at which the mask of `name` may be, in order of preference: the photo's name with `.png` in place of
    /// its extension, with `.png` added, cut at the first dot of the file name, and the first two without
    /// folders; the last three only where no other photo comes to the same name.
    pub(crate) fn candidates(&self, name: &str) -> Vec<PathBuf> {
        let path = Path::new(name);
        let file = path.file_name().map(|file| file.to_string_lossy().into_owned()).unwrap_or_default();
        let mut found = vec![self.folder.join(path.with_extension("png")), self.folder.join(format!("{name}.png"))];
        let cut = cut_at_first_dot(name);
        if self.cut.get(&cut) == Some(&1) {
            found.push(self.folder.join(cut.with_extension("png")));
        }
        if self.stems.get(&stem(name)) == Some(&1) {
            found.push(self.folder.join(format!("{}.png", stem(name))));
            found.push(self.folder.join(format!("{file}.png")));
        }
        found
    }

    /// The mask file of `name`, if there is one.
    pub(crate) fn find(&self, name: &str) -> Option<PathBuf> {
        self.candidates(name).into_iter().find(|path| path.is_file())
    }

    /// The error for a folder in which no photo has a mask.
    pub(crate) fn nothing_found(&self, name: &str) -> Error {
        let expected = Path::new(name).with_extension("png");
        let mut text = format!("no photo of the scene has a mask here; expected for example {}", expected.display());
        if ["jpg", "jpeg", "JPG"].iter().any(|ext| self.folder.join(expected.with_extension(ext)).is_file()) {
            text.push_str("; JPEG masks are refused because compression changes ids, write PNG");
        }
        Error::data(&self.folder, "", text)
    }
}
