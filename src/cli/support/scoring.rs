//! Shared by commands with scores: options, progress, the page of `--page`, minimum scores.

use crate::Result;
use crate::cli::support::context::Context;
use crate::cli::support::json_file::JsonFileArg;
use crate::cli::support::log::Progress;
use crate::cli::support::model_drawer::MemoryArg;
use crate::cli::support::model_edit::MinConfidenceArg;
use crate::cli::support::parsers::near;
use crate::cli::support::tables::Parts;
use crate::eval::compared::{PictureObserver, ScoredPicture};
use crate::eval::page::Page;
use clap::Args;
use std::path::{Path, PathBuf};

/// How a model is scored.
#[derive(Args, Clone, Debug)]
pub struct ScoreArgs {
    /// Near plane, world units; closer Gaussians are not drawn. Default: the value of the model's run, else 0.2. Other
    /// viewers often use 0.01; a lower score with that value means floaters in front of the cameras.
    #[arg(long, value_name = "Z", value_parser = near, help_heading = "Rendering")]
    pub near: Option<f32>,
    /// Gaussians of an object that is rendered alone.
    #[command(flatten)]
    pub sure: MinConfidenceArg,
    /// Also compute LPIPS, with the weights of LPIPS v0.1 (VGG16) in this safetensors file (see the guide, page
    /// benchmarks). Takes seconds to minutes per image.
    #[arg(long, value_name = "WEIGHTS", help_heading = "Scores")]
    pub lpips: Option<PathBuf>,
    /// Write a web page to this new folder, with ground truth, prediction and difference of every image.
    #[arg(long, value_name = "DIR", help_heading = "Output")]
    pub page: Option<PathBuf>,
    /// Exit with status 1 if the mean PSNR is below this, dB.
    #[arg(long, value_name = "DB", help_heading = "Checks")]
    pub min_psnr: Option<f64>,
    /// Exit with status 1 if the mean IoU is below this.
    #[arg(long, value_name = "IOU", help_heading = "Checks")]
    pub min_iou: Option<f64>,
    #[command(flatten)]
    pub memory: MemoryArg,
    #[command(flatten)]
    pub json: JsonFileArg,
}

/// Counts images and adds them to the page.
pub(crate) struct Watcher {
    progress: Progress,
    done: u64,
    page: Option<Page>,
}

impl Watcher {
    /// Starts a watcher of `total` images with a page in `folder`.
    pub(crate) fn new(total: u64, folder: Option<&Path>, context: &Context) -> Result<Self> {
        let page = folder.map(Page::new).transpose()?;
        Ok(Self { progress: Progress::new(total, "images", &context.global), done: 0, page })
    }

    /// Writes the page.
    pub(crate) fn finish(self, summary: &Parts) -> Result<()> {
        drop(self.progress);
        if let Some(page) = self.page {
            let path = page.finish(&summary.markup())?;
            tracing::info!("page: {}", path.display());
        }
        Ok(())
    }
}

impl PictureObserver for Watcher {
    fn observe(&mut self, picture: &ScoredPicture) -> Result<()> {
        self.skip()?;
        self.page.as_mut().map_or(Ok(()), |page| page.observe(picture))
    }

    fn skip(&mut self) -> Result<()> {
        self.done += 1;
        self.progress.set(self.done, String::new);
        Ok(())
    }
}
