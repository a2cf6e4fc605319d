//! Attempts at poses and points: the usual one, then others for photos that have no pose yet.

use super::options::{Choice, EXTRACTION_GROUPS, MAPPER_GROUPS, MATCHING_GROUPS, Options, READER_GROUPS, give};
use super::progress::{item, pairs, placed};
use super::sources::Photos;
use super::unplaced;
use super::workshop::Workshop;
use crate::colmap::{self, Contents};
use labelgs_files::{atomic, read};
use labelgs_scene::words::counted;
use labelgs_scene::{Error, Result, Setting};
use std::path::PathBuf;
use std::process::Command;

/// One way to find poses.
struct Attempt {
    name: &'static str,
    /// How it differs, for the message before it.
    how: &'static str,
    /// Features and pairs are in a database of this name; one that is there is used.
    database: &'static str,
    extraction: &'static [Choice],
    matching: &'static [Choice],
    mapping: &'static [Choice],
}

const USUAL_ATTEMPT: Attempt =
    Attempt { name: "usual", how: "", database: "usual.db", extraction: &[], matching: &[], mapping: &[] };

/// Many faint features place smooth photos better than few good ones (affine shapes: twice the error of the poses).
const FAINTER_ATTEMPT: Attempt = Attempt {
    name: "fainter",
    how: "with fainter features",
    database: "fainter.db",
    extraction: &[("peak_threshold", "0.0003"), ("max_image_size", "1600")],
    matching: &[("guided_matching", "1")],
    ..USUAL_ATTEMPT
};

/// These limits may place a photo wrongly: only for photos that have no pose otherwise.
const FEWER_COMMON_ATTEMPT: Attempt = Attempt {
    name: "fewer",
    how: "with fewer common features",
    mapping: &[
        ("init_min_num_inliers", "50"),
        ("abs_pose_min_num_inliers", "12"),
        ("abs_pose_min_inlier_ratio", "0.15"),
        ("min_num_matches", "10"),
    ],
    ..FAINTER_ATTEMPT
};

/// Most ordered photos of which all pairs are compared, which closes loops; of more, neighbours.
const PAIRED_MAX: usize = 200;
/// Photos of a side of a block of pairs, COLMAP's default.
const PAIR_BLOCK_PHOTOS: usize = 50;
/// Fewest points of three photos for each placed photo with which the others are left out. A handful of photos has
/// fewer.
const SURE_POINTS_MIN: usize = 10;

/// A model that COLMAP found.
pub(super) struct Found {
    pub(super) folder: PathBuf,
    pub(super) contents: Contents,
    /// Sizes of the other models of the attempt that share no photo with it.
    pub(super) apart: Vec<usize>,
    is_usual: bool,
}

/// Returns the model with the most photos of all attempts. An attempt is made while photos have no pose.
pub(super) fn best_of_all(workshop: &mut Workshop, photos: &Photos) -> Result<Found> {
    let count = photos.names().count();
    let mut best: Option<Found> = None;
    for attempt in [USUAL_ATTEMPT, FAINTER_ATTEMPT, FEWER_COMMON_ATTEMPT] {
        let most = best.as_ref().map_or(0, |best| best.contents.photos.len());
        if most == count {
            break;
        }
        if !attempt.how.is_empty() {
            tracing::info!(
                "{most} of {} have poses; trying again {}, which takes longer",
                counted(count, "photo"),
                attempt.how
            );
        }
        let found = attempt.make(workshop, photos)?;
        if let Some(found) = found.filter(|found| found.contents.photos.len() > most) {
            best = Some(found);
        }
    }
    let best = best.ok_or_else(|| unplaced(&workshop.request.source, count, &workshop.last_lines()))?;
    if best.is_usual { Ok(best) } else { with_sure_points(workshop, best) }
}

impl Attempt {
    /// Returns the largest group of photos that COLMAP can join, if there is one.
    fn make(&self, workshop: &mut Workshop, photos: &Photos) -> Result<Option<Found>> {
        let database = workshop.path(self.database);
        if !database.exists() {
            self.extract(workshop, photos)?;
            self.compare(workshop, photos)?;
        }
        let models = workshop.make_folder(self.name)?;
        let mut command = workshop.command("mapper");
        let options = Options::of(workshop.command("mapper"))?;
        give(&mut command, "database_path", &database);
        give(&mut command, "image_path", workshop.images());
        give(&mut command, "output_path", &models);
        self.mapping.iter().for_each(|&choice| options.set(&mut command, MAPPER_GROUPS, choice));
        // It fails where no photos fit together, which the next attempt may change.
        workshop.run("finding poses and points", photos.names().count(), command, &placed)?;
        let mut found = Vec::new();
        let mut folders = read::folder(&models)?;
        folders.sort();
        for folder in folders.into_iter().filter(|folder| folder.is_dir()) {
            found.extend(colmap::contents(&folder)?.map(|contents| (folder, contents)));
        }
        // The first of equal ones.
        let best = found.iter().rev().max_by_key(|(_, contents)| contents.photos.len()).cloned();
        Ok(best.map(|(folder, contents)| {
            let is_apart =
                |other: &&(PathBuf, Contents)| other.1.photos.iter().all(|photo| !contents.photos.contains(photo));
            let apart = found.iter().filter(is_apart).map(|(_, other)| other.photos.len()).collect();
            Found { folder, contents, apart, is_usual: self.name == USUAL_ATTEMPT.name }
        }))
    }

    /// Finds features. Photos of one size share a camera, and COLMAP refuses photos of another size for that.
    fn extract(&self, workshop: &mut Workshop, photos: &Photos) -> Result<()> {
        let options = Options::of(workshop.command("feature_extractor"))?;
        if workshop.request.gpu && !options.has_cuda {
            let problem = format!("{} was built without CUDA; leave this out", workshop.colmap.display());
            return Err(Error::usage(Setting("gpu"), problem));
        }
        for ((width, height), names) in &photos.by_size {
            let mut command = workshop.command("feature_extractor");
            give(&mut command, "database_path", workshop.path(self.database));
            give(&mut command, "image_path", workshop.images());
            options.set(&mut command, READER_GROUPS, ("single_camera", "1"));
            options.set(&mut command, READER_GROUPS, ("camera_model", workshop.request.model.name));
            set_gpu(workshop, &options, &mut command, EXTRACTION_GROUPS);
            self.extraction.iter().for_each(|&choice| options.set(&mut command, EXTRACTION_GROUPS, choice));
            let mut what = "finding features".to_owned();
            if photos.by_size.len() > 1 {
                let list = workshop.path("photos.txt");
                let lines: String = names.iter().map(|name| format!("{name}\n")).collect();
                atomic::write(&list, |out| out.write_all(lines.as_bytes()))?;
                give(&mut command, "image_list_path", list);
                what += &format!(" of photos of {width} x {height} px");
            }
            workshop.must_run(&what, names.len(), command, &item)?;
        }
        Ok(())
    }

    /// Finds pairs of photos with common features.
    fn compare(&self, workshop: &mut Workshop, photos: &Photos) -> Result<()> {
        let count = photos.names().count();
        let is_sequence = photos.is_ordered && count > PAIRED_MAX;
        let verb = if is_sequence { "sequential_matcher" } else { "exhaustive_matcher" };
        let options = Options::of(workshop.command(verb))?;
        let mut command = workshop.command(verb);
        give(&mut command, "database_path", workshop.path(self.database));
        set_gpu(workshop, &options, &mut command, MATCHING_GROUPS);
        self.matching.iter().for_each(|&choice| options.set(&mut command, MATCHING_GROUPS, choice));
        let what = "comparing photos";
        if is_sequence {
            return workshop.must_run(what, count, command, &item);
        }
        // A single block tells nothing before its end.
        let all = if count > PAIR_BLOCK_PHOTOS { count * (count - 1) / 2 } else { 0 };
        workshop.must_run(what, all, command, &|line| pairs(line, all))
    }
}

fn set_gpu(workshop: &Workshop, options: &Options, command: &mut Command, groups: &[&str]) {
    options.set(command, groups, ("use_gpu", if workshop.request.gpu { "1" } else { "0" }));
}

/// Leaves out points that only two photos share: of faint features these are often wrong, beside the cameras, where
/// they become floaters. Then the poses are found by the rest.
fn with_sure_points(workshop: &mut Workshop, found: Found) -> Result<Found> {
    let (sure, adjusted) = (workshop.make_folder("sure")?, workshop.make_folder("adjusted")?);
    let mut command = workshop.command("point_filtering");
    give(&mut command, "input_path", &found.folder);
    give(&mut command, "output_path", &sure);
    give(&mut command, "min_track_len", "3");
    workshop.must_run("keeping points of three photos", 0, command, &|_| None)?;
    let points = colmap::contents(&sure)?.unwrap_or_default().points;
    if points < SURE_POINTS_MIN * found.contents.photos.len() {
        return Ok(found);
    }
    let mut command = workshop.command("bundle_adjuster");
    give(&mut command, "input_path", &sure);
    give(&mut command, "output_path", &adjusted);
    workshop.must_run("adjusting poses to these points", 0, command, &|_| None)?;
    let contents = colmap::contents(&adjusted)?.unwrap_or_default();
    Ok(Found { folder: adjusted, contents, ..found })
}
