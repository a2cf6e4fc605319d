//! Detects the format of a mask folder. An ambiguous folder is an error.

use super::content::{Kind, is_grey, read_binary};
use super::folder::{Claims, Layouts, layouts, root};
use super::marks::{FoundMarks, Mark, Numbering, Object, Shape, number};
use super::mask::read_header;
use super::pred::Pred;
use super::{Format, ImportOptions, ObjectPer, Overlap, names, shortened, tools};
use labelgs_files::names::below;
use labelgs_files::read;
use labelgs_scene::{Error, Result, Setting, View};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The masks of all photos.
pub(super) enum Content {
    /// One id image per photo.
    Ids { kind: Kind, of_photo: Vec<Option<String>>, pred: Option<Pred> },
    /// Masks of single objects.
    Marks { of_photo: Vec<Vec<Mark>>, numbering: Numbering },
}

/// The detected format of a mask folder.
pub(super) struct Reading {
    pub(super) format: Format,
    /// Folder or file of the masks, possibly inside the given folder.
    pub(super) root: PathBuf,
    pub(super) content: Content,
    /// Images without a photo.
    pub(super) strays: Vec<String>,
    /// Rule for shared pixels; not `Auto`.
    pub(super) overlap: Overlap,
    /// Reason for the choice.
    pub(super) why: String,
    /// Notes for the user.
    pub(super) notes: Vec<String>,
}

impl Reading {
    /// True if the photo has a mask.
    pub(super) fn has_mask(&self, photo: usize) -> bool {
        match &self.content {
            Content::Ids { of_photo, .. } => of_photo[photo].is_some(),
            Content::Marks { of_photo, .. } => !of_photo[photo].is_empty(),
        }
    }

    /// Returns the objects, if each mask shows a single object.
    pub(super) fn objects(&self) -> Option<&[Object]> {
        match &self.content {
            Content::Ids { .. } => None,
            Content::Marks { numbering, .. } => Some(&numbering.objects),
        }
    }

    /// Returns the list of ids that came with id images.
    pub(super) fn pred(&self) -> Option<&Pred> {
        match &self.content {
            Content::Ids { pred, .. } => pred.as_ref(),
            Content::Marks { .. } => None,
        }
    }
}

/// Returns the settings to try for images in folders.
fn nested_formats() -> String {
    let format = |name| Setting("format").to(name);
    format!(
        "{} if a folder is an object (OBJECT/NAME.png), {} if a folder is a photo (NAME/OBJECT.png)",
        format("binary-folders"),
        format("photo-folders")
    )
}

/// Detects the format for these photos.
pub(super) fn detect(views: &[&View], options: &ImportOptions) -> Result<Reading> {
    let photos = names(views);
    if !options.folder.exists() {
        return Err(Error::data(&options.folder, "", "there is no such mask folder"));
    }
    let tool = match options.format {
        Format::Auto => tools::recognise(&options.folder, &photos)?,
        format => Some((format, "as requested".to_owned())),
    };
    if let Some((format, why)) = tool
        && let Some((root, found)) = tools::read(&options.folder, format, views)?
    {
        return reading_from_marks(root, &photos, found, format, why, options);
    }
    folders(&photos, options)
}

/// Detects the format of masks that no tool's files identify.
fn folders(photos: &[&str], options: &ImportOptions) -> Result<Reading> {
    let root = root(&options.folder, options.format)?;
    let files = below(&root)?;
    let layouts = layouts(photos, &files);
    let pred = options.pred.clone().or_else(|| Pred::find(&root));
    let pred = pred.as_deref().map(Pred::read).transpose()?;
    let (format, why) = match options.format {
        Format::Auto => recognise(&root, &layouts, pred.as_ref(), photos)?,
        format => (format, "as requested".to_owned()),
    };
    let (claims, ids) = match format {
        Format::DevaLong => (layouts.flat, Some(Kind::Rgb)),
        Format::Palette => (layouts.flat, Some(Kind::Palette)),
        Format::Grey16 => (layouts.flat, Some(Kind::Grey16)),
        Format::Binary => (layouts.flat, None),
        Format::BinaryFolders => (layouts.by_object, None),
        Format::PhotoFolders | Format::LerfMask | Format::ThreeDOvs => (layouts.by_photo, None),
        _ => (layouts.flat, Some(Kind::Grey8)),
    };
    if claims.photos() == 0 {
        return Err(nothing_found(&root, &files, photos));
    }
    let claims = if format == Format::Binary { claims.into_one_object() } else { claims };
    let Some(kind) = ids else {
        let notes = if format == Format::ThreeDOvs { classes_without_mask(&root, &claims)? } else { Vec::new() };
        return reading_from_marks(
            root,
            photos,
            FoundMarks { notes, ..marks_from_claims(claims) },
            format,
            why,
            options,
        );
    };
    if options.object_per != ObjectPer::Auto {
        let problem = "belongs to masks of single objects, but these are id images; omit it";
        return Err(Error::usage(Setting("object_per"), problem));
    }
    let of_photo = claims.of_photo.into_iter().map(|files| files.into_iter().next().map(|(_, file)| file)).collect();
    let content = Content::Ids { kind, of_photo, pred };
    Ok(Reading { format, root, content, strays: claims.strays, overlap: Overlap::Error, why, notes: Vec::new() })
}

/// Uses the names of black and white images as object names.
fn marks_from_claims(claims: Claims) -> FoundMarks {
    let names = claims.objects();
    let rank = |object: &String| names.iter().position(|name| name == object);
    let marks = |mut files: Vec<(String, String)>| {
        files.sort_by_key(|(object, _)| rank(object));
        files.into_iter().map(|(object, file)| Mark::new(Some(object), Shape::Png(file))).collect()
    };
    let of_photo = claims.of_photo.into_iter().map(marks).collect();
    FoundMarks { of_photo, names, strays: claims.strays, notes: Vec::new() }
}

fn reading_from_marks(
    root: PathBuf,
    photos: &[&str],
    mut found: FoundMarks,
    format: Format,
    why: String,
    options: &ImportOptions,
) -> Result<Reading> {
    if options.pred.is_some() {
        let problem = "belongs to id images, but these are masks of single objects; omit it";
        return Err(Error::usage(Setting("pred"), problem));
    }
    let numbering = number(&root, photos, &mut found, options.object_per)?;
    let overlap = tools::overlap(format, options.overlap);
    let content = Content::Marks { of_photo: found.of_photo, numbering };
    Ok(Reading { format, root, content, strays: found.strays, overlap, why, notes: found.notes })
}

fn recognise(root: &Path, layouts: &Layouts, pred: Option<&Pred>, photos: &[&str]) -> Result<(Format, String)> {
    let Layouts { flat, by_object, by_photo } = layouts;
    let grey = |claims: &Claims| if claims.photos() == 0 { None } else { Some(first_grey(root, claims)) };
    let (object_grey, photo_grey) = (grey(by_object), grey(by_photo));
    let binary = |grey: &Option<Option<String>>| matches!(grey, Some(None));
    match (flat.photos() > 0, binary(&object_grey), binary(&photo_grey)) {
        (true, false, false) => flat_format(root, flat, pred),
        (false, true, false) => {
            let count = by_object.objects().len();
            Ok((Format::BinaryFolders, format!("{count} folders hold a black and white image per photo")))
        }
        (false, false, true) => {
            let named = |name: &str| root.file_name().is_some_and(|found| found == name);
            let why = format!("{} folders named after photos hold black and white images", by_photo.photos());
            Ok(if root.join("classes.txt").is_file() {
                (Format::ThreeDOvs, format!("{why}, and there is a classes.txt"))
            } else if named("test_mask") {
                (Format::LerfMask, format!("{why}, and the folder is called test_mask"))
            } else {
                (Format::PhotoFolders, why)
            })
        }
        (false, false, false) => Err(match object_grey.or(photo_grey).flatten() {
            Some(file) => {
                let problem = format!(
                    "images in folders must be black and white to be recognised, with one value besides 0, but \
                     {file} is not. If it has soft edges, set {}: values in the upper half are then the object. Id \
                     images belong in one folder, named like the photos",
                    nested_formats()
                );
                Error::data(root, "", problem)
            }
            None => nothing_found(root, &below(root)?, photos),
        }),
        (flat_fits, object_fits, photo_fits) => {
            let readings = [
                (flat_fits, "NAME.png", flat),
                (object_fits, "OBJECT/NAME.png", by_object),
                (photo_fits, "NAME/OBJECT.png", by_photo),
            ];
            let fits = readings.iter().filter(|(fits, ..)| *fits);
            let fits = fits.map(|(_, text, claims)| format!("{text} ({} photos)", claims.photos()));
            let problem = format!(
                "can be read in more than one way: {}. Set {}, or for id pictures {} to one of deva-short, deva-long, \
                 palette and grey16",
                fits.collect::<Vec<_>>().join(", "),
                nested_formats(),
                Setting("format")
            );
            Err(Error::data(root, "", problem))
        }
    }
}

/// Returns the first image that is not black and white or cannot be read.
fn first_grey(root: &Path, claims: &Claims) -> Option<String> {
    let files: Vec<&str> = claims.files().collect();
    let grey = files.par_iter().find_first(|file| !read_binary(&root.join(file), |_| Ok(())).is_ok_and(|b| b.sharp));
    grey.map(|file| (*file).to_owned())
}

/// Returns the files of each kind. Colour images are grey if all of them are: a single one may be black.
fn kinds<'a>(root: &Path, claims: &'a Claims) -> Result<BTreeMap<Kind, Vec<&'a str>>> {
    let mut kinds: BTreeMap<Kind, Vec<&str>> = BTreeMap::new();
    for file in claims.files() {
        kinds.entry(Kind::from_header(&read_header(&root.join(file))?)).or_default().push(file);
    }
    let colours = kinds.iter().filter(|(kind, _)| kind.as_grey() != **kind);
    let colours: Vec<&str> = colours.flat_map(|(_, files)| files.iter().copied()).collect();
    let other = |file: &&str| is_grey(&root.join(file)).map(|grey| !grey);
    match colours.par_iter().map(other).find_any(|found| !matches!(found, Ok(false))) {
        Some(Err(error)) => return Err(error),
        Some(Ok(_)) => return Ok(kinds),
        None => {}
    }
    let mut grey: BTreeMap<Kind, Vec<&str>> = BTreeMap::new();
    kinds.into_iter().for_each(|(kind, files)| grey.entry(kind.as_grey()).or_default().extend(files));
    Ok(grey)
}

/// Detects the format of id images from their kind.
fn flat_format(root: &Path, claims: &Claims, pred: Option<&Pred>) -> Result<(Format, String)> {
    let kinds = kinds(root, claims)?;
    if kinds.len() > 1 {
        let counts = kinds.iter().map(|(kind, files)| format!("{} {} ({})", files.len(), kind.text(), files[0]));
        let problem = format!(
            "holds images of different kinds, {}; ids of different kinds cannot be matched. Keep the \
             pictures of one kind",
            counts.collect::<Vec<_>>().join(", ")
        );
        return Err(Error::data(root, "", problem));
    }
    let Some((kind, files)) = kinds.into_iter().next() else { return Err(Error::Bug("no mask has a kind".into())) };
    let mut why = format!("{} images named after photos, all {}", files.len(), kind.text());
    if let Some(pred) = pred {
        why += &format!(", with ids of {}", pred.path.display());
    }
    let format = match kind {
        Kind::Grey8 if pred.is_none() && root.file_name().is_some_and(|name| name == "object_mask") => {
            why += ", and the folder is called object_mask";
            Format::ObjectMask
        }
        Kind::Grey8 => Format::DevaShort,
        Kind::Grey16 => Format::Grey16,
        Kind::Palette => Format::Palette,
        Kind::Rgb if pred.is_some() => Format::DevaLong,
        Kind::Rgb => {
            let problem = format!(
                "holds RGB images and no pred.json, so they may be DEVA ids or display colours. Set {} if \
                 R + 256 G + 65536 B is the id, or {} to the pred.json of the run; display colours cannot be read, \
                 so import the id images that they were made from",
                Setting("format").to("deva-long"),
                Setting("pred")
            );
            return Err(Error::data(root, "", problem));
        }
        Kind::Rgb16 => {
            let problem = format!("{} is {}, which cannot hold ids; import the id images", files[0], kind.text());
            return Err(Error::data(root, "", problem));
        }
    };
    Ok((format, why))
}

fn nothing_found(root: &Path, files: &[String], photos: &[&str]) -> Error {
    let photo = photos.first().copied().unwrap_or_default();
    let name = Path::new(photo).with_extension("");
    let name = name.to_string_lossy();
    let there = match files {
        [] => "it is empty".to_owned(),
        files => format!("it holds {}", shortened(files)),
    };
    let problem = format!(
        "no image belongs to a photo of the scene: expected for example {name}.png, OBJECT/{name}.png or \
         {name}/OBJECT.png, and {there}. Masks have the names of the photos and are PNG, because JPEG changes ids"
    );
    Error::data(root, "", problem)
}

/// Notes the classes in 3D-OVS's list that have no mask.
fn classes_without_mask(root: &Path, claims: &Claims) -> Result<Vec<String>> {
    let path = root.join("classes.txt");
    if !path.is_file() {
        return Ok(vec![format!("{} is missing", path.display())]);
    }
    let text = read::text(&path)?;
    let objects = claims.objects();
    let lines = text.lines().map(str::trim).filter(|line| !line.is_empty());
    let without: Vec<&str> = lines.filter(|class| !objects.iter().any(|object| object == class)).collect();
    let note = || format!("classes.txt lists {} without any mask: {}", without.len(), shortened(&without));
    Ok(if without.is_empty() { Vec::new() } else { vec![note()] })
}
