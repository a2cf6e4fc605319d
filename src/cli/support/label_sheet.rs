//! `--sheet`: which label is what, on one page or image.

use crate::Result;
use crate::cli::support::args::SceneArgs;
use crate::cli::support::context::{Context, open_model};
use crate::cli::support::model_edit::require_labels;
use crate::cli::support::parsers::sheet_file;
use crate::cli::support::scene::{near_plane, open_gpu, open_scene};
use crate::edit::catalogue::Catalogue;
use crate::edit::select::LabelSummary;
use crate::engine::Engine;
use crate::files::atomic;
use crate::files::image::write_png_rgb8;
use crate::render::portrait::portrait;
use crate::report::sheet::{TILE_SIDE, Tile, page, picture};
use crate::run::models::first_view;
use crate::scene::overview::likely_up;
use crate::scene::{Camera, Overview, UNLABELLED};
use crate::scenes::camera_json::views_of_model;
use crate::stage::Stage;
use clap::Args;
use std::path::{Path, PathBuf};

/// A sheet of all labels.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Sheet")]
pub struct SheetArgs {
    /// Write an overview of all labels, each drawn alone from its best view: OUT.html with names and numbers, or
    /// OUT.png with ids.
    #[arg(long, value_name = "OUT", value_parser = sheet_file())]
    pub sheet: Option<PathBuf>,
    /// Scene with the views for --sheet. Default: the cameras of the model's run, else a side view of each label.
    #[arg(long, value_name = "SCENE", requires = "sheet")]
    pub scene: Option<PathBuf>,
}

impl SheetArgs {
    /// Writes the sheet of a model with these labels, if one was asked for.
    pub(crate) fn write(&self, path: &Path, rows: &[LabelSummary], known: &Catalogue, to: &Context) -> Result<()> {
        let Some(sheet) = &self.sheet else { return Ok(()) };
        let model = open_model(path)?;
        let labels: Vec<&LabelSummary> = rows.iter().filter(|row| row.label != UNLABELLED).collect();
        require_labels(path, !labels.is_empty())?;
        let cameras = self.cameras(path)?;
        let cameras: Vec<&Camera> = cameras.iter().collect();
        let of_file = || Ok(first_view(path)?.map(|view| view.up));
        let up = Overview::from_cameras(cameras.iter().copied()).map_or_else(of_file, |all| Ok(Some(all.up)))?;
        let up = up.unwrap_or_else(|| likely_up((0..model.len()).map(|row| model.world(row))));
        let near = near_plane(path, None)?;
        let mut engine = Engine::for_model(open_gpu(to)?, &model, std::iter::once((TILE_SIDE, TILE_SIDE)))?;
        let stage = Stage::new("drawing labels", labels.len());
        let mut tile = |row: &&LabelSummary| -> Result<Tile> {
            let pixels = portrait(&mut engine, (&model, row.label), (&cameras, up), (TILE_SIDE, near))?;
            stage.count();
            let size = [0, 1, 2].map(|axis| row.max[axis] - row.min[axis]);
            let name = known.name(row.label).map(str::to_owned);
            Ok(Tile { id: row.label, name, gaussians: row.count, size, pixels })
        };
        let tiles: Vec<Tile> = labels.iter().map(&mut tile).collect::<Result<_>>()?;
        if sheet.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("png")) {
            let ((width, height), pixels) = picture(&tiles);
            return write_png_rgb8(sheet, width, height, &pixels);
        }
        let text = page(&path.display().to_string(), &tiles)?;
        atomic::write(sheet, |out| out.write_all(text.as_bytes()))
    }

    /// The cameras to see labels from; none without a scene and a run.
    fn cameras(&self, model: &Path) -> Result<Vec<Camera>> {
        let Some(scene) = &self.scene else {
            return Ok(views_of_model(model)?.into_iter().map(|view| view.camera).collect());
        };
        let dataset = open_scene(scene, &SceneArgs::default().of_run(model)?, None, [0.0; 3], false)?;
        Ok(dataset.all().into_iter().map(|view| view.camera.clone()).collect())
    }
}
