//! Progress, and the web page of `--page`.

use crate::Result;
use crate::cli::context::Context;
use crate::cli::log::Progress;
use crate::eval::compared::{Compared, Watch};
use crate::eval::page::Page;
use std::path::Path;

/// Counts pictures and adds them to the page.
pub(super) struct Watcher {
    progress: Progress,
    done: u64,
    page: Option<Page>,
}

impl Watcher {
    /// Starts a watcher of `total` pictures with a page in `folder`.
    pub(super) fn new(total: u64, folder: Option<&Path>, context: &Context) -> Result<Self> {
        let page = folder.map(Page::new).transpose()?;
        Ok(Self { progress: Progress::new(total, "pictures", &context.global), done: 0, page })
    }

    /// Writes the page.
    pub(super) fn finish(self, summary: &str) -> Result<()> {
        drop(self.progress);
        if let Some(page) = self.page {
            let path = page.finish(summary)?;
            tracing::info!("page: {}", path.display());
        }
        Ok(())
    }
}

impl Watch for Watcher {
    fn see(&mut self, picture: &Compared) -> Result<()> {
        self.skip()?;
        self.page.as_mut().map_or(Ok(()), |page| page.see(picture))
    }

    fn skip(&mut self) -> Result<()> {
        self.done += 1;
        self.progress.set(self.done, String::new);
        Ok(())
    }
}
