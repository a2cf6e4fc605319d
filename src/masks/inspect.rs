//! Checks a mask folder against its scene.

use super::check::{Finding, MaskStats, Problem, findings, held_out};
use super::mask::{read_header, read_mask};
use super::mask_folder::masks_of_photos;
use super::names;
use labelgs_files::label_table::FILE_NAME;
use labelgs_files::names::below;
use labelgs_files::resize::aspect_problem;
use labelgs_scene::sampling::stride;
use labelgs_scene::stage::Stage;
use labelgs_scene::{Dataset, Error, Point, Result, View};
use rayon::prelude::*;
use serde::Serialize;
use std::collections::BTreeSet;
use std::path::Path;

/// The content of a mask folder, and its problems.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Report {
    /// Number of photos in the scene.
    pub photos: usize,
    /// Number of photos with a usable mask.
    pub masks: usize,
    /// Ids in the masks.
    pub ids: Vec<u32>,
    /// Problems, by kind.
    pub findings: Vec<Finding>,
}

/// Checks the masks in `folder` for the photos of `dataset`. An unusable mask is a finding, not an error.
pub fn inspect(dataset: &Dataset, folder: &Path) -> Result<Report> {
    let views = dataset.all();
    let masks = masks_of_photos(folder, &names(&views))?;
    let paths: Vec<Option<&Path>> = views.iter().map(|view| masks.find(&view.name)).collect();
    // A look stores the id at each scene point.
    let points = dataset.points.iter().step_by(stride(dataset.points.len(), views.len()));
    let points: Vec<Point> = points.copied().collect();
    let stage = Stage::new("checking masks", views.len());
    let looks: Vec<Result<MaskStats, Finding>> =
        views.par_iter().zip(&paths).map(|(view, path)| stage.counted(|| look(&points, view, *path))).collect();
    drop(stage);

    let mut found = misnamed(folder, &paths)?;
    let mut usable = Vec::new();
    for (view, look) in views.iter().zip(&looks) {
        match look {
            Ok(look) => usable.push((view.name.as_str(), look)),
            Err(finding) => found.push(finding.clone()),
        }
    }
    let held_out = held_out(dataset, |view| masks.find(&view.name).is_some());
    found.extend(held_out.map(|text| Finding::of_scene(Problem::HeldOut, text)));
    found.extend(findings(&usable));
    found.sort();
    let ids: BTreeSet<u32> = usable.iter().flat_map(|(_, look)| look.ids()).collect();
    Ok(Report { photos: views.len(), masks: usable.len(), ids: ids.into_iter().collect(), findings: found })
}

fn look(points: &[Point], view: &View, path: Option<&Path>) -> Result<MaskStats, Finding> {
    let finding = |problem, text: String| Finding { view: Some(view.name.clone()), ..Finding::of_scene(problem, text) };
    let Some(path) = path else { return Err(finding(Problem::Missing, "has no mask".into())) };
    let unreadable = |error: Error| finding(Problem::Unreadable, error.to_string());
    let size = read_header(path).map_err(unreadable)?.size;
    if let Some(text) = aspect_problem((&path.display().to_string(), size), ("the photo", view.camera.size())) {
        return Err(finding(Problem::Missized, text));
    }
    let map = read_mask(path).map_err(unreadable)?;
    Ok(MaskStats::new(&map, &view.camera, points))
}

fn misnamed(folder: &Path, used: &[Option<&Path>]) -> Result<Vec<Finding>> {
    let used: BTreeSet<&Path> = used.iter().copied().flatten().collect();
    let unused =
        below(folder)?.into_iter().filter(|file| file != FILE_NAME && !used.contains(folder.join(file).as_path()));
    let finding = |file| Finding::of_scene(Problem::Misnamed, format!("{file} does not belong to any photo"));
    Ok(unused.map(finding).collect())
}
