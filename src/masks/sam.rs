//! What the script `amg.py` of Segment Anything writes: for each photo a folder `NAME` with `0.png`, `1.png`, ... and
//! `metadata.csv`, or `NAME.json` with run lengths.

use super::marks::{Found, Mark, Shape, require_aspect};
use super::mask_folder::png_key;
use super::names;
use super::rle::Rle;
use labelgs_files::names::claim;
use labelgs_files::photo_files::photo_keys;
use labelgs_files::read;
use labelgs_scene::{Error, Result, View};
use rayon::prelude::*;
use serde::Deserialize;
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// What follows the name of a photo in the path of its table of pictures, and in that of its list of run lengths.
pub(super) const TABLE: &str = "/metadata.csv";
pub(super) const LIST: &str = ".json";

/// Returns for each photo the file with an ending that belongs to it, without the ending.
pub(super) fn of_photos(photos: &[&str], files: &[String], ending: &str) -> Vec<Option<String>> {
    let there = files.iter().filter_map(|file| file.strip_suffix(ending)).collect();
    claim(&photo_keys(photos), &there)
}

/// True if the file is a list of masks. A broken one must also be found, so that the reader can tell what is wrong.
pub(super) fn is_list(path: &Path) -> Result<bool> {
    let text = read::bytes(path)?;
    let has = |key: &[u8]| text.windows(key.len()).any(|part| part == key);
    Ok(has(b"\"segmentation\"") && !has(b"\"image_id\""))
}

/// Reads the folders of pictures.
pub(super) fn read_folders(root: &Path, views: &[&View], files: &[String]) -> Result<Found> {
    let others = |folder: &str| folder.to_owned();
    read_all(root, views, (files, TABLE), others, |folder, _| pictures(root, folder, files))
}

/// Reads the lists of run lengths.
pub(super) fn read_lists(root: &Path, views: &[&View], files: &[String]) -> Result<Found> {
    let file = |name: &str| format!("{name}{LIST}");
    read_all(root, views, (files, LIST), file, |name, view| masks(&root.join(file(name)), view))
}

/// Reads what `read` finds of each photo by the name of its file without the ending; `stray` is how such a name is told if
/// it belongs to no photo.
fn read_all(
    root: &Path,
    views: &[&View],
    (files, ending): (&[String], &str),
    stray: impl Fn(&str) -> String,
    read: impl Fn(&str, &View) -> Result<Vec<Mark>> + Sync,
) -> Result<Found> {
    let photos = names(views);
    let own = of_photos(&photos, files, ending);
    let marks = |(name, view): (&Option<String>, &&View)| name.as_ref().map_or(Ok(Vec::new()), |name| read(name, view));
    let of_photo = own.par_iter().zip(views).map(marks).collect::<Vec<Result<Vec<Mark>>>>();
    let mut found = Found { of_photo: of_photo.into_iter().collect::<Result<_>>()?, ..Found::default() };
    let own: BTreeSet<&str> = own.iter().flatten().map(String::as_str).collect();
    let others = files.iter().filter_map(|file| file.strip_suffix(ending)).filter(|name| !own.contains(name));
    found.strays = others.map(stray).collect();
    super::marks::require_photo(root, &photos, &found, &found.strays)?;
    Ok(found)
}

/// Returns the pictures that the table of a photo lists.
fn pictures<'a>(root: &Path, folder: &str, files: &'a [String]) -> Result<Vec<Mark>> {
    let path = root.join(format!("{folder}{TABLE}"));
    let text = read::text(&path)?;
    let mut lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
    if lines.next().is_none_or(|(_, line)| line.split(',').next() != Some("id")) {
        return Err(Error::data(
            &path,
            "line 1",
            "does not begin with `id,area`; expected the table that amg.py writes",
        ));
    }
    let key = |file: &'a String| Some((png_key(file)?.strip_prefix(folder)?.strip_prefix('/')?, file));
    let there: BTreeMap<&str, &String> = files.iter().filter_map(key).collect();
    let mut marks = Vec::new();
    let mut listed = BTreeSet::new();
    for (at, line) in lines {
        let place = || format!("line {}", at + 1);
        let id = line.split(',').next().unwrap_or_default().trim();
        if id.parse::<u32>().is_err() || !listed.insert(id) {
            let problem =
                format!("begins with `{}`, expected the number of a picture that no other line has", id.escape_debug());
            return Err(Error::data(&path, place(), problem));
        }
        let Some(&file) = there.get(id) else {
            let problem = format!("lists the mask {id}, and {folder}/{id}.png is not there; copy the whole folder");
            return Err(Error::data(&path, place(), problem));
        };
        marks.push(Mark::new(None, Shape::Png(file.clone())));
    }
    if let Some(other) = there.keys().find(|name| name.parse::<u32>().is_ok() && !listed.contains(*name)) {
        let problem = format!("does not list {folder}/{other}.png: pictures of another run? Segment the photo again");
        return Err(Error::data(&path, "", problem));
    }
    Ok(marks)
}

/// The masks of a photo, alone or with what the data set SA-1B says of the photo.
#[derive(Deserialize)]
#[serde(untagged)]
enum List {
    Alone(Vec<Annotation>),
    WithImage { annotations: Vec<Annotation> },
}

/// A mask of a list.
#[derive(Deserialize)]
pub(super) struct Annotation {
    pub(super) segmentation: Value,
    pub(super) predicted_iou: Option<f64>,
    pub(super) stability_score: Option<f64>,
}

const EXPECTED: &str = r#"expected what amg.py writes as run lengths: [{"segmentation": {"size": [height, width], "counts": "..."}, "area": 9}]"#;

/// Reads the list of a photo's masks.
pub(super) fn annotations(path: &Path) -> Result<Vec<Annotation>> {
    // The message of a type with two forms tells neither line nor reason.
    let value: Value = read::json(path, EXPECTED)?;
    let list =
        serde_json::from_value(value).map_err(|_| Error::data(path, "", format!("is no list of masks; {EXPECTED}")))?;
    let (List::Alone(list) | List::WithImage { annotations: list }) = list;
    Ok(list)
}

fn masks(path: &Path, view: &View) -> Result<Vec<Mark>> {
    let list = annotations(path)?;
    let mut marks = Vec::with_capacity(list.len());
    for (at, annotation) in list.iter().enumerate() {
        let wrong = |problem: String| Error::data(path, format!("mask {at}"), problem);
        let rle = Rle::read(&annotation.segmentation).map_err(wrong)?;
        require_aspect("the mask", rle.size, view).map_err(wrong)?;
        marks.push(Mark::new(None, Shape::Rle(rle)));
    }
    Ok(marks)
}
