//! `labelgs masks`: masks before training.

pub(crate) mod check;
pub(crate) mod collect;
pub(crate) mod import;
pub(crate) mod make;
pub(crate) mod repair;
pub(crate) mod spoil;
pub(crate) mod track;

use crate::cli::support::{Context, ReadArgs};
use crate::files::image::{write_png_grey8, write_png_grey16};
use crate::files::read;
use crate::masks::mask_folder::png_key;
use crate::scene::{Dataset, LabelMap};
use crate::scenes::window::Window;
use crate::scenes::{self, LoadOptions};
use crate::{Error, Result};
use clap::Subcommand;
use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};

/// The commands for masks.
#[derive(Clone, Debug, Subcommand)]
pub enum MasksVerb {
    /// Find problems in masks: missing, misnamed, inverted, nearly empty or wrongly sized masks, and ids that come and
    /// go. Exits with status 1 if there are any.
    ///
    /// Example: labelgs masks check scene/masks --scene scene
    Check(check::CheckArgs),
    /// Convert masks of trackers and data sets to one id image per photo, with labels.json.
    ///
    /// Example: labelgs masks import scene/masks --scene scene -o imported
    Import(import::ImportArgs),
    /// Make masks of each photo with a segmentation network that you provide. Ids differ from photo to photo.
    ///
    /// Example: labelgs masks make scene --network mobile_sam -o made
    Make(make::MakeArgs),
    /// Make the ids of masks agree in all views, using a trained model.
    ///
    /// Example: labelgs masks repair scene/masks --model out --scene scene -o repaired
    Repair(repair::RepairArgs),
    /// Make the ids of masks agree from frame to frame of a video, by overlap.
    ///
    /// Example: labelgs masks track scene/masks -o tracked
    Track(track::TrackArgs),
    /// Collect the masks of the photos from the output of a tracker on the video of `labelgs frames`.
    ///
    /// Example: labelgs masks collect tracked --frames video/frames.json -o collected
    Collect(collect::CollectArgs),
    /// Add typical tracker faults to masks, for robustness tests.
    ///
    /// Example: labelgs masks spoil scene/masks --fault swap -o spoilt
    Spoil(spoil::SpoilArgs),
}

impl MasksVerb {
    /// Runs the command.
    pub(crate) fn run(&self, context: &Context) -> Result<()> {
        match self {
            Self::Check(args) => check::run(args, context),
            Self::Import(args) => import::run(args, context),
            Self::Make(args) => make::run(args, context),
            Self::Repair(args) => repair::run(args, context),
            Self::Track(args) => track::run(args, context),
            Self::Collect(args) => collect::run(args, context),
            Self::Spoil(args) => spoil::run(args, context),
        }
    }
}

/// Reads the scene that masks belong to: names, sizes and cameras of its photos, and its points.
fn open_photos(scene: &Path, read: &ReadArgs) -> Result<Dataset> {
    let options = LoadOptions { photos: false, undistort: false, ..LoadOptions::default() };
    scenes::open_logged(scene, &read.options(options))
}

/// Returns the mask file of each photo, relative to the folder of masks, and the indices of its views. A view without a
/// window is a photo as it is stored. Two photos with one file are an error in `file`.
fn files_of_photos<'a>(
    names: impl Iterator<Item = &'a str>,
    windows: &BTreeMap<String, Window>,
    file: &Path,
) -> Result<BTreeMap<PathBuf, Vec<usize>>> {
    let mut found: BTreeMap<PathBuf, (&str, Vec<usize>)> = BTreeMap::new();
    for (index, name) in names.enumerate() {
        let photo = windows.get(name).map_or(name, |window| &window.photo);
        let path = Path::new(photo).with_extension("png");
        if !path.components().all(|part| matches!(part, Component::Normal(_))) {
            return Err(Error::data(
                file,
                format!("photo {photo}"),
                "would have its mask outside of the folder of masks",
            ));
        }
        let (other, views) = found.entry(path).or_insert((photo, Vec::new()));
        if *other != photo {
            let problem = format!("would have the same mask file as {other}; rename one of the photos");
            return Err(Error::data(file, format!("photo {photo}"), problem));
        }
        views.push(index);
    }
    Ok(found.into_iter().map(|(path, (_, views))| (path, views)).collect())
}

/// Writes ids as a grey PNG of 8 bits, or of 16 bits if an id needs them.
fn write_mask(path: &Path, mask: &LabelMap) -> Result<()> {
    if mask.ids.iter().all(|&id| id <= u16::from(u8::MAX)) {
        let bytes: Vec<u8> = mask.ids.iter().map(|&id| id as u8).collect();
        return write_png_grey8(path, mask.width, mask.height, &bytes);
    }
    write_png_grey16(path, mask.width, mask.height, &mask.ids)
}

/// Returns the sorted names of the PNGs in a folder.
fn pngs(folder: &Path) -> Result<Vec<String>> {
    let entries = read::folder(folder)?;
    let names = entries.iter().filter_map(|path| path.file_name()?.to_str().map(str::to_owned));
    let mut names: Vec<String> = names.filter(|name| png_key(name).is_some()).collect();
    names.sort();
    if names.is_empty() {
        return Err(Error::data(folder, "", "holds no PNG; expected a folder of id masks"));
    }
    Ok(names)
}
