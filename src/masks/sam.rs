//! Output of Segment Anything's script `amg.py`: for each photo, a folder `NAME` with `0.png`, `1.png`, ... and
//! `metadata.csv`, or a file `NAME.json` with run lengths.

use super::marks::{FoundMarks, Mark, Shape, require_aspect};
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

/// What follows a photo's name in the path of its image table and of its run-length list.
pub(super) const TABLE_SUFFIX: &str = "/metadata.csv";
pub(super) const LIST_SUFFIX: &str = ".json";

/// Returns for each photo the file that belongs to it, with `ending` removed.
pub(super) fn files_of_photos(photos: &[&str], files: &[String], ending: &str) -> Vec<Option<String>> {
    let there = files.iter().filter_map(|file| file.strip_suffix(ending)).collect();
    claim(&photo_keys(photos), &there)
}

/// Returns true if the file is a list of masks. Recognises broken lists too, so that the reader can explain what is
/// wrong.
pub(super) fn is_list(path: &Path) -> Result<bool> {
    let text = read::bytes(path)?;
    let has = |key: &[u8]| text.windows(key.len()).any(|part| part == key);
    Ok(has(b"\"segmentation\"") && !has(b"\"image_id\""))
}

/// Reads the folders of images.
pub(super) fn read_folders(root: &Path, views: &[&View], files: &[String]) -> Result<FoundMarks> {
    let others = |folder: &str| folder.to_owned();
    read_all(root, views, (files, TABLE_SUFFIX), others, |folder, _| pictures(root, folder, files))
}

/// Reads the run-length lists.
pub(super) fn read_lists(root: &Path, views: &[&View], files: &[String]) -> Result<FoundMarks> {
    let file = |name: &str| format!("{name}{LIST_SUFFIX}");
    read_all(root, views, (files, LIST_SUFFIX), file, |name, view| masks(&root.join(file(name)), view))
}

/// Reads the masks of each photo with `read`, by the name of its file without the ending. `stray` formats a name that
/// does not belong to any photo.
fn read_all(
    root: &Path,
    views: &[&View],
    (files, ending): (&[String], &str),
    stray: impl Fn(&str) -> String,
    read: impl Fn(&str, &View) -> Result<Vec<Mark>> + Sync,
) -> Result<FoundMarks> {
    let photos = names(views);
    let own = files_of_photos(&photos, files, ending);
    let marks = |(name, view): (&Option<String>, &&View)| name.as_ref().map_or(Ok(Vec::new()), |name| read(name, view));
    let of_photo = own.par_iter().zip(views).map(marks).collect::<Vec<Result<Vec<Mark>>>>();
    let mut found = FoundMarks { of_photo: of_photo.into_iter().collect::<Result<_>>()?, ..FoundMarks::default() };
    let own: BTreeSet<&str> = own.iter().flatten().map(String::as_str).collect();
    let others = files.iter().filter_map(|file| file.strip_suffix(ending)).filter(|name| !own.contains(name));
    found.strays = others.map(stray).collect();
    super::marks::require_photo(root, &photos, &found, &found.strays)?;
    Ok(found)
}

/// Returns the images listed in the table of a photo.
fn pictures<'a>(root: &Path, folder: &str, files: &'a [String]) -> Result<Vec<Mark>> {
    let path = root.join(format!("{folder}{TABLE_SUFFIX}"));
    let text = read::text(&path)?;
    let mut lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
    if lines.next().is_none_or(|(_, line)| line.split(',').next() != Some("id")) {
        return Err(Error::data(
            &path,
            "line 1",
            "does not begin with `id,area`; expected the table written by amg.py",
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
                format!("begins with `{}`; expected the number of an image that no other line has", id.escape_debug());
            return Err(Error::data(&path, place(), problem));
        }
        let Some(&file) = there.get(id) else {
            let problem = format!("lists the mask {id}, but {folder}/{id}.png is missing; copy the whole folder");
            return Err(Error::data(&path, place(), problem));
        };
        marks.push(Mark::new(None, Shape::Png(file.clone())));
    }
    if let Some(other) = there.keys().find(|name| name.parse::<u32>().is_ok() && !listed.contains(*name)) {
        let problem = format!("does not list {folder}/{other}.png: images of another run? Segment the photo again");
        return Err(Error::data(&path, "", problem));
    }
    Ok(marks)
}

/// The masks of a photo, alone or with the data set SA-1B's description of the photo.
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

const EXPECTED_FORM: &str = r#"expected what amg.py writes as run lengths: [{"segmentation": {"size": [height, width], "counts": "..."}, "area": 9}]"#;

/// Reads the masks of a photo.
pub(super) fn annotations(path: &Path) -> Result<Vec<Annotation>> {
    // Errors for a type with two forms have neither line nor reason, so parse in two steps.
    let value: Value = read::json(path, EXPECTED_FORM)?;
    let list = serde_json::from_value(value)
        .map_err(|_| Error::data(path, "", format!("is not a list of masks; {EXPECTED_FORM}")))?;
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
