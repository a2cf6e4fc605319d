//! What the script `amg.py` of Segment Anything writes: for each photo a folder `NAME` with `0.png`, `1.png`, ... and
//! `metadata.csv`, or `NAME.json` with run lengths.

use super::marks::{Found, Mark, Shape, require_aspect};
use super::mask_folder::{photo_keys, png_key};
use super::rle::Rle;
use labelgs_files::names::claim;
use labelgs_files::read;
use labelgs_scene::{Error, Result, View};
use rayon::prelude::*;
use serde::Deserialize;
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

const TABLE: &str = "metadata.csv";

/// Returns the folder of each photo among the files of a folder.
pub(super) fn folders(photos: &[&str], files: &[String]) -> Vec<Option<String>> {
    let there = files.iter().filter_map(|file| file.strip_suffix(TABLE)?.strip_suffix('/')).collect();
    claim(&photo_keys(photos), &there)
}

/// Returns the JSON of each photo, without `.json`, among the files of a folder.
pub(super) fn lists(photos: &[&str], files: &[String]) -> Vec<Option<String>> {
    let there = files.iter().filter_map(|file| file.strip_suffix(".json")).collect();
    claim(&photo_keys(photos), &there)
}

/// True if the file is a list of masks. A broken one must also be found, so that the reader can tell what is wrong.
pub(super) fn is_list(path: &Path) -> Result<bool> {
    let text = read::bytes(path)?;
    let has = |key: &[u8]| text.windows(key.len()).any(|part| part == key);
    Ok(has(b"\"segmentation\"") && !has(b"\"image_id\""))
}

/// Reads the folders of pictures.
pub(super) fn read_folders(root: &Path, photos: &[&str], files: &[String]) -> Result<Found> {
    let folders = folders(photos, files);
    let mut found = Found::default();
    for folder in &folders {
        found.of_photo.push(match folder {
            Some(folder) => pictures(root, folder, files)?,
            None => Vec::new(),
        });
    }
    let own: BTreeSet<&str> = folders.iter().flatten().map(String::as_str).collect();
    let others = files.iter().filter_map(|file| file.strip_suffix(TABLE)?.strip_suffix('/'));
    found.strays = others.filter(|folder| !own.contains(folder)).map(str::to_owned).collect();
    super::marks::require_photo(root, photos, &found, &found.strays)?;
    Ok(found)
}

/// Returns the pictures that the table of a photo lists.
fn pictures<'a>(root: &Path, folder: &str, files: &'a [String]) -> Result<Vec<Mark>> {
    let path = root.join(folder).join(TABLE);
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

#[derive(Deserialize)]
struct Annotation {
    segmentation: Value,
}

const EXPECTED: &str = r#"expected what amg.py writes as run lengths: [{"segmentation": {"size": [height, width], "counts": "..."}, "area": 9}]"#;

/// Reads the lists of run lengths.
pub(super) fn read_lists(root: &Path, views: &[&View], files: &[String]) -> Result<Found> {
    let photos: Vec<&str> = views.iter().map(|view| view.name.as_str()).collect();
    let lists = lists(&photos, files);
    let masks = |(list, view): (&Option<String>, &&View)| match list {
        Some(list) => masks(&root.join(format!("{list}.json")), view),
        None => Ok(Vec::new()),
    };
    let of_photo = lists.par_iter().zip(views).map(masks).collect::<Vec<Result<Vec<Mark>>>>();
    let mut found = Found { of_photo: of_photo.into_iter().collect::<Result<_>>()?, ..Found::default() };
    let own: BTreeSet<&str> = lists.iter().flatten().map(String::as_str).collect();
    let others = files.iter().filter(|file| file.strip_suffix(".json").is_some_and(|name| !own.contains(name)));
    found.strays = others.cloned().collect();
    super::marks::require_photo(root, &photos, &found, &found.strays)?;
    Ok(found)
}

fn masks(path: &Path, view: &View) -> Result<Vec<Mark>> {
    // The message of a type with two forms tells neither line nor reason.
    let value: Value = read::json(path, EXPECTED)?;
    let (List::Alone(list) | List::WithImage { annotations: list }) =
        serde_json::from_value(value).map_err(|_| Error::data(path, "", format!("is no list of masks; {EXPECTED}")))?;
    let mut marks = Vec::with_capacity(list.len());
    for (at, annotation) in list.iter().enumerate() {
        let wrong = |problem: String| Error::data(path, format!("mask {at}"), problem);
        let rle = Rle::read(&annotation.segmentation).map_err(wrong)?;
        require_aspect("the mask", rle.size, view).map_err(wrong)?;
        marks.push(Mark::new(None, Shape::Rle(rle)));
    }
    Ok(marks)
}
