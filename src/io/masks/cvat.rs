//! "Segmentation mask 1.1" of CVAT: `SegmentationObject/NAME.png` with a colour per object of the photo,
//! `SegmentationClass/NAME.png` with a colour per label, and `labelmap.txt` with the labels of colours.

use super::marks::{Found, Mark, Shape};
use super::spans::Spans;
use crate::error::{Error, Result, Setting};
use crate::io::mask::read_raw;
use crate::io::mask_folder::{photo_keys, png_key};
use crate::io::names::{below, claim};
use crate::io::read;
use png::{BitDepth, ColorType};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

const OBJECTS: &str = "SegmentationObject";
const CLASSES: &str = "SegmentationClass";
const LEGEND: &str = "labelmap.txt";

type Colour = [u8; 3];

/// Returns the exported folder, if the path is it or one of its two folders of pictures.
pub(super) fn find(path: &Path) -> Option<PathBuf> {
    let above = path.file_name().filter(|name| *name == OBJECTS || *name == CLASSES).and(path.parent());
    let has = |root: &&Path| root.join(OBJECTS).is_dir() || root.join(CLASSES).is_dir();
    [Some(path), above].into_iter().flatten().find(has).map(Path::to_owned)
}

/// Reads the folders.
pub(super) fn read(root: &Path, photos: &[&str]) -> Result<Found> {
    let legend = legend(&root.join(LEGEND))?;
    let (objects, classes) = (pictures(root, OBJECTS, photos)?, pictures(root, CLASSES, photos)?);
    let mut found = Found { names: legend.iter().map(|(_, name)| name.clone()).collect(), ..Found::default() };
    let marks = |photo: usize| match (&objects.0[photo], &classes.0[photo]) {
        (Some(object), Some(class)) => instances(root, object, class, &legend),
        (Some(object), None) => {
            let problem = format!("has no counterpart in {CLASSES}, which names its objects; export both folders");
            Err(Error::data(root.join(object), "", problem))
        }
        (None, Some(class)) if objects.0.iter().all(Option::is_none) => labels(root, class, &legend),
        _ => Ok(Vec::new()),
    };
    let all: Vec<Result<Vec<Mark>>> = (0..photos.len()).into_par_iter().map(marks).collect();
    found.of_photo = crate::io::all::all_or_one_error(root, all)?;
    found.strays = if objects.1.is_empty() { classes.1 } else { objects.1 };
    super::marks::require_photo(root, photos, &found, &found.strays)?;
    Ok(found)
}

/// Returns the picture of each photo in a folder, and the others.
fn pictures(root: &Path, folder: &str, photos: &[&str]) -> Result<(Vec<Option<String>>, Vec<String>)> {
    let path = root.join(folder);
    if !path.is_dir() {
        return Ok((vec![None; photos.len()], Vec::new()));
    }
    let files = below(&path)?;
    let mut there: BTreeMap<&str, &String> =
        files.iter().filter_map(|file| png_key(file).map(|key| (key, file))).collect();
    let own = claim(&photo_keys(photos), &there.keys().copied().collect());
    let file = |key: Option<String>| there.remove(key?.as_str()).map(|file| format!("{folder}/{file}"));
    let own = own.into_iter().map(file).collect();
    Ok((own, there.values().map(|file| format!("{folder}/{file}")).collect()))
}

/// Reads the labels of colours, in the order of the file. A label `background` marks no object.
fn legend(path: &Path) -> Result<Vec<(Colour, String)>> {
    if !path.is_file() {
        let problem = format!("is not there: the export holds it beside {CLASSES}; copy the whole export");
        return Err(Error::data(path, "", problem));
    }
    let text = read::text(path)?;
    let mut found: Vec<(Colour, String)> = Vec::new();
    for (at, line) in
        text.lines().map(str::trim).enumerate().filter(|(_, line)| !line.is_empty() && !line.starts_with('#'))
    {
        let wrong = |problem: String| Err(Error::data(path, format!("line {}", at + 1), problem));
        let mut parts = line.split(':');
        let (name, colour) = (parts.next().unwrap_or_default().trim(), parts.next().unwrap_or_default());
        let bytes: Vec<Option<u8>> = colour.split(',').map(|byte| byte.trim().parse().ok()).collect();
        let [Some(r), Some(g), Some(b)] = bytes[..] else {
            return wrong(format!(
                "is `{}`, expected `label:red,green,blue::` with numbers up to 255",
                line.escape_debug()
            ));
        };
        if let Some((_, other)) = found.iter().find(|(colour, _)| *colour == [r, g, b]) {
            return wrong(format!("has the colour of {other}; give each label a colour of its own and export again"));
        }
        found.push(([r, g, b], name.to_owned()));
    }
    if found.is_empty() {
        return Err(Error::data(path, "", "has no label; expected lines like `cup:128,0,0::`"));
    }
    Ok(found)
}

/// Reads the colours of a picture.
fn colours(path: &Path) -> Result<((u32, u32), Vec<Colour>)> {
    let raw = read_raw(path, |header| match (header.colour, header.depth) {
        (ColorType::Rgb, BitDepth::Eight) => Ok(()),
        (ColorType::Indexed, _) => {
            let problem = format!(
                "is a palette picture, and CVAT writes RGB; import its folder with {}",
                Setting("format").to("palette")
            );
            Err(Error::data(path, "", problem))
        }
        (colour, depth) => {
            let problem =
                format!("is a picture of {colour:?}, {depth:?} bits, and CVAT writes RGB of eight; export it again");
            Err(Error::data(path, "", problem))
        }
    })?;
    let samples = raw.samples();
    Ok((raw.header.size, samples.chunks_exact(3).map(|rgb| [rgb[0] as u8, rgb[1] as u8, rgb[2] as u8]).collect()))
}

/// Reads a picture as size and pixels of each colour.
pub(super) fn regions(path: &Path) -> Result<((u32, u32), BTreeMap<Colour, Spans>)> {
    let (size, pixels) = colours(path)?;
    let mut found: BTreeMap<Colour, Spans> = BTreeMap::new();
    let mut at = 0;
    for run in pixels.chunk_by(|a, b| a == b) {
        found.entry(run[0]).or_default().push(at, at + run.len());
        at += run.len();
    }
    Ok((size, found))
}

fn name_of<'a>(path: &Path, legend: &'a [(Colour, String)], colour: Colour) -> Result<Option<&'a str>> {
    match legend.iter().find(|(known, _)| *known == colour) {
        Some((_, name)) if name == "background" => Ok(None),
        Some((_, name)) => Ok(Some(name)),
        // Without a label of its own, black is the background.
        None if colour == [0; 3] => Ok(None),
        None => {
            let [r, g, b] = colour;
            let problem = format!("has the colour {r},{g},{b}, which {LEGEND} does not list; export both together");
            Err(Error::data(path, "", problem))
        }
    }
}

/// Returns a mask for each label in a picture.
fn labels(root: &Path, class: &str, legend: &[(Colour, String)]) -> Result<Vec<Mark>> {
    let path = root.join(class);
    let mut marks = Vec::new();
    for &colour in regions(&path)?.1.keys() {
        if let Some(name) = name_of(&path, legend, colour)? {
            marks.push(Mark::new(Some(name.to_owned()), Shape::Colour(class.to_owned(), colour)));
        }
    }
    Ok(marks)
}

/// Returns a mask for each object in a picture, named by the label of most of its pixels.
fn instances(root: &Path, object: &str, class: &str, legend: &[(Colour, String)]) -> Result<Vec<Mark>> {
    let (path, class) = (root.join(object), root.join(class));
    let ((size, objects), (class_size, classes)) = (regions(&path)?, colours(&class)?);
    if size != class_size {
        let problem = format!(
            "has {} x {} px and {} {} x {} px; export both together",
            size.0,
            size.1,
            class.display(),
            class_size.0,
            class_size.1
        );
        return Err(Error::data(&path, "", problem));
    }
    let mut marks = Vec::new();
    for (colour, spans) in objects.iter().filter(|(colour, _)| **colour != [0; 3]) {
        let mut counts: BTreeMap<Colour, usize> = BTreeMap::new();
        for run in spans.runs() {
            classes[run].chunk_by(|a, b| a == b).for_each(|part| *counts.entry(part[0]).or_default() += part.len());
        }
        let most = counts.iter().max_by_key(|(_, count)| **count).map_or([0; 3], |(colour, _)| *colour);
        let Some(name) = name_of(&class, legend, most)? else { continue };
        marks.push((number_of(*colour), Mark::new(Some(name.to_owned()), Shape::Colour(object.to_owned(), *colour))));
    }
    marks.sort_by_key(|(number, _)| *number);
    Ok(marks.into_iter().map(|(_, mark)| mark).collect())
}

/// Returns the number of a colour in the table of Pascal VOC, whose bits are spread over the high bits of red, green and
/// blue.
fn number_of(colour: Colour) -> u32 {
    let bit = |at: u32| u32::from(colour[at as usize % 3] >> (7 - at / 3) & 1) << at;
    (0..24).map(bit).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_of_pascal_voc_are_numbers() {
        for (colour, number) in
            [([0; 3], 0), ([128, 0, 0], 1), ([0, 128, 0], 2), ([0, 0, 128], 4), ([64, 0, 0], 8), ([192, 128, 0], 11)]
        {
            assert_eq!(number_of(colour), number, "{colour:?}");
        }
    }
}
