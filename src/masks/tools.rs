//! Recognises annotation and segmentation tools by the files beside their masks.

use super::folder::{layouts, root};
use super::marks::FoundMarks;
use super::mask_folder::no_mask_found;
use super::{Format, Overlap, coco, sam};
use labelgs_files::names::below;
use labelgs_scene::{Error, Result, Setting, View};
use std::path::{Path, PathBuf};

/// Returns the format of the tool whose files the folder or file contains, with the reason. Two tools are an error.
pub(super) fn recognise(path: &Path, photos: &[&str]) -> Result<Option<(Format, String)>> {
    let mut fits = Vec::new();
    if path.is_file() {
        return Ok(Some((Format::Coco, "a file is read as COCO instances".to_owned())));
    }
    let files = below(path)?;
    if let Some(tool) = other_export(&files) {
        let problem = format!("holds an unsupported export of {tool}; export the project as COCO 1.0 instead");
        return Err(Error::data(path, "", problem));
    }
    let with = |list: &[Option<String>]| list.iter().flatten().count();
    let folders = with(&sam::files_of_photos(photos, &files, sam::TABLE_SUFFIX));
    if folders > 0 {
        fits.push((Format::SamFolders, format!("{folders} folders named after photos hold a metadata.csv")));
    }
    let lists = sam::files_of_photos(photos, &files, sam::LIST_SUFFIX);
    let first = lists.iter().flatten().next();
    if let Some(first) = first
        && sam::is_list(&path.join(format!("{first}.json")))?
    {
        fits.push((Format::SamJson, format!("{} files named after photos are mask lists", with(&lists))));
    }
    if let Some(file) = coco::files(path)?.first() {
        fits.push((Format::Coco, format!("{} has images and annotations", file.display())));
    }
    if fits.len() > 1 {
        let all: Vec<String> =
            fits.iter().map(|(format, why)| format!("{why} ({})", Setting("format").to(format.name()))).collect();
        let problem = format!(
            "can be read in more than one way: {}. Set {}, or name the folder or file of one",
            all.join("; "),
            Setting("format")
        );
        return Err(Error::data(path, "", problem));
    }
    Ok(fits.pop())
}

/// Returns the tool that wrote a mask folder in an unsupported form: colours with a legend, or names without a photo.
/// These tools can also export COCO.
fn other_export(files: &[String]) -> Option<&'static str> {
    let is_of_cvat = |file: &String| file.ends_with("labelmap.txt") || file.contains("SegmentationObject/");
    let is_of_label_studio = |file: &String| file.contains("task-") && file.contains("-annotation-");
    if files.iter().any(is_of_cvat) {
        return Some("CVAT (\"Segmentation mask\")");
    }
    files.iter().any(is_of_label_studio).then_some("Label Studio (\"Brush labels\")")
}

/// Reads the masks of a tool, with their folder or file. Returns `None` for other formats.
pub(super) fn read(path: &Path, format: Format, views: &[&View]) -> Result<Option<(PathBuf, FoundMarks)>> {
    if matches!(format, Format::SamFolders | Format::SamJson) && path.is_file() {
        return Err(Error::data(
            path,
            "",
            format!("is a file, but {} needs a folder; name the folder", Setting("format").to(format.name())),
        ));
    }
    let own = || path.to_owned();
    Ok(Some(match format {
        Format::Coco => {
            let file = coco::file(path)?;
            let found = coco::read(&file, views)?;
            (file, found)
        }
        Format::SamFolders => (own(), sam::read_folders(path, views, &below(path)?)?),
        Format::SamJson => (own(), sam::read_lists(path, views, &below(path)?)?),
        _ => return Ok(None),
    }))
}

/// Returns the rule for shared pixels that users of a format expect.
pub(super) fn overlap(format: Format, asked: Overlap) -> Overlap {
    match (asked, format) {
        (Overlap::Auto, Format::SamFolders | Format::SamJson) => Overlap::Smaller,
        (Overlap::Auto, Format::Coco) => Overlap::Later,
        (Overlap::Auto, _) => Overlap::Error,
        (asked, _) => asked,
    }
}

/// Creates the error for a folder without masks for any photo. If `masks import` knows its format, the message says so.
pub fn nothing_found(folder: &Path, scene: &Path, photos: &[&str]) -> Error {
    let why = match recognise(folder, photos) {
        Ok(tool) => tool.map(|(_, why)| why).or_else(|| nested(folder, photos)),
        // Two formats fit; the import names them.
        Err(_) => Some("it contains files of a segmenter or tool".to_owned()),
    };
    let Some(why) = why else { return no_mask_found(folder, photos.first().copied().unwrap_or_default()) };
    let problem = format!(
        "holds masks in another format ({why}); convert them first, with `masks import {}` and the scene {}",
        folder.display(),
        scene.display()
    );
    Error::data(folder, "", problem)
}

/// Returns why the images in subfolders are masks, if they are named after photos.
fn nested(folder: &Path, photos: &[&str]) -> Option<String> {
    let inside = root(folder, Format::Auto).ok()?;
    let layouts = layouts(photos, &below(&inside).ok()?);
    let flat = layouts.flat.photos();
    let both = [(layouts.by_object, "OBJECT/NAME.png"), (layouts.by_photo, "NAME/OBJECT.png")];
    let found = both.iter().find(|(claims, _)| claims.photos() > 0).map(|(claims, form)| (claims.photos(), *form));
    let (count, form) = (flat > 0).then_some((flat, "NAME.png")).or(found)?;
    Some(format!("{count} photos have images {form} in {}", inside.display()))
}
