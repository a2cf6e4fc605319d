//! Formats of tools for annotation and segmentation, which the files beside the masks show.

use super::folder::{layouts, root};
use super::marks::Found;
use super::mask_folder::no_mask_found;
use super::{Format, Overlap, coco, sam};
use labelgs_files::names::below;
use labelgs_scene::{Error, Result, Setting, View};
use std::path::{Path, PathBuf};

/// Returns the tool whose files the folder or file holds, with the reason. Two of them are an error.
pub(super) fn recognise(path: &Path, photos: &[&str]) -> Result<Option<(Format, String)>> {
    let mut fits = Vec::new();
    if path.is_file() {
        return Ok(Some((Format::Coco, "a file is read as instances of COCO".to_owned())));
    }
    let files = below(path)?;
    if let Some(tool) = other_export(&files) {
        let problem = format!("holds an export of {tool} that is not read; export the project as COCO 1.0 instead");
        return Err(Error::data(path, "", problem));
    }
    let with = |list: &[Option<String>]| list.iter().flatten().count();
    let folders = with(&sam::of_photos(photos, &files, sam::TABLE));
    if folders > 0 {
        fits.push((Format::SamFolders, format!("{folders} folders named after photos hold a metadata.csv")));
    }
    let lists = sam::of_photos(photos, &files, sam::LIST);
    let first = lists.iter().flatten().next();
    if let Some(first) = first
        && sam::is_list(&path.join(format!("{first}.json")))?
    {
        fits.push((Format::SamJson, format!("{} files named after photos are lists of masks", with(&lists))));
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

/// Returns the tool that wrote a folder of masks in a form of its own: colours with a legend, or names without a photo. These
/// tools export COCO too.
fn other_export(files: &[String]) -> Option<&'static str> {
    let is_of_cvat = |file: &String| file.ends_with("labelmap.txt") || file.contains("SegmentationObject/");
    let is_of_label_studio = |file: &String| file.contains("task-") && file.contains("-annotation-");
    if files.iter().any(is_of_cvat) {
        return Some("CVAT (\"Segmentation mask\")");
    }
    files.iter().any(is_of_label_studio).then_some("Label Studio (\"Brush labels\")")
}

/// Reads the masks of a tool. Returns the folder or file that they are in, and none for formats of other kinds.
pub(super) fn read(path: &Path, format: Format, views: &[&View]) -> Result<Option<(PathBuf, Found)>> {
    if matches!(format, Format::SamFolders | Format::SamJson) && path.is_file() {
        return Err(Error::data(
            path,
            "",
            format!("is a file, and {} is a folder; name the folder", Setting("format").to(format.name())),
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

/// Makes the error for a folder without a mask for any photo. If the import knows its form, that is the cure.
pub fn nothing_found(folder: &Path, scene: &Path, photos: &[&str]) -> Error {
    let why = match recognise(folder, photos) {
        Ok(tool) => tool.map(|(_, why)| why).or_else(|| nested(folder, photos)),
        // Two forms fit; the import says which.
        Err(_) => Some("the files of a segmenter or tool are in it".to_owned()),
    };
    let Some(why) = why else { return no_mask_found(folder, photos.first().copied().unwrap_or_default()) };
    let problem = format!(
        "holds masks of another form ({why}); make id pictures of them first, by `masks import {}` with the scene {}",
        folder.display(),
        scene.display()
    );
    Error::data(folder, "", problem)
}

/// Returns why the pictures in folders of a folder are masks, if they are named after photos.
fn nested(folder: &Path, photos: &[&str]) -> Option<String> {
    let inside = root(folder, Format::Auto).ok()?;
    let layouts = layouts(photos, &below(&inside).ok()?);
    let flat = layouts.flat.photos();
    let both = [(layouts.by_object, "OBJECT/NAME.png"), (layouts.by_photo, "NAME/OBJECT.png")];
    let found = both.iter().find(|(claims, _)| claims.photos() > 0).map(|(claims, form)| (claims.photos(), *form));
    let (count, form) = (flat > 0).then_some((flat, "NAME.png")).or(found)?;
    Some(format!("{count} photos have pictures {form} in {}", inside.display()))
}
