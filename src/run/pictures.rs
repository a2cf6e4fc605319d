//! Small copies of the worst held-out views, for the report.

use super::info::PicturedView;
use super::thumbnails::{self, Thumbnails};
use crate::error::{Error, Result};
use crate::eval::compared::{PictureObserver, ScoredPicture};
use crate::eval::metrics::label_iou;
use crate::files::atomic;
use crate::report::panels::{Kind, PANEL_SIDE_MAX, encoded, heat};
use crate::scene::LabelMap;
use crate::scene::colour::to_byte;
use crate::scene::labels::label_colours;
use std::path::{Path, PathBuf};

/// Folder of the pictures.
pub(super) const PICTURES_FOLDER: &str = "report";
/// Most views with pictures.
const VIEWS_MAX: usize = 6;
/// Most bytes of all pictures.
const BYTES_MAX: usize = 6 << 20;

/// File of the error map.
pub(crate) const HEAT_MAP_FILE: &str = "error.jpg";

/// The picture kinds of a view: name in the page, file name.
pub(crate) const PICTURE_KINDS: [(&str, &str); 5] = [
    ("photo", "photo.jpg"),
    ("render", "render.jpg"),
    ("labels", "labels.png"),
    ("masks", "masks.png"),
    ("error", HEAT_MAP_FILE),
];

/// Returns the path of a picture.
pub(crate) fn path(out: &Path, number: u32, file: &str) -> PathBuf {
    out.join(PICTURES_FOLDER).join(format!("{number}-{file}"))
}

/// The worst views so far, and the objects of all views.
#[derive(Default)]
pub(super) struct WorstViews {
    views: Vec<(PicturedView, Vec<Option<Vec<u8>>>)>,
    objects: Thumbnails,
}

impl PictureObserver for WorstViews {
    fn observe(&mut self, picture: &ScoredPicture) -> Result<()> {
        let Some(psnr) = picture.number("PSNR").filter(|_| picture.object.is_none()) else { return Ok(()) };
        self.objects.observe(picture)?;
        let worse = |view: &(PicturedView, _)| view.0.psnr.is_some_and(|other| other <= psnr);
        let place = self.views.iter().take_while(|view| worse(view)).count();
        if place >= VIEWS_MAX {
            return Ok(());
        }
        let size = (picture.photo.width, picture.photo.height);
        let copy = |pixels: &[[u8; 3]], kind| encoded(size, pixels, kind, PANEL_SIDE_MAX).map(Some);
        let map = |map: Option<&LabelMap>| map.map_or(Ok(None), |map| copy(&label_colours(&map.ids), Kind::Flat));
        let render: Vec<[u8; 3]> = picture.rgb.iter().map(|colour| colour.map(to_byte)).collect();
        let files = vec![
            copy(&picture.photo.rgb(), Kind::Smooth)?,
            copy(&render, Kind::Smooth)?,
            map(picture.labels)?,
            map(picture.truth)?,
            copy(&heat(picture.photo, picture.rgb), Kind::Smooth)?,
        ];
        let iou = picture.labels.zip(picture.truth).and_then(|(found, truth)| label_iou(&found.ids, truth));
        let (view, ssim) = (picture.view.to_owned(), picture.number("SSIM"));
        self.views.insert(place, (PicturedView { view, psnr: Some(psnr), ssim, iou, number: 0 }, files));
        self.views.truncate(VIEWS_MAX);
        Ok(())
    }
}

impl WorstViews {
    /// Writes as many pictures to the run folder as the limit allows. Returns their views, worst first.
    pub(super) fn write(self, out: &Path) -> Result<Vec<PicturedView>> {
        remove_old(out)?;
        thumbnails::remove_old(out)?;
        self.objects.write(out)?;
        let mut written = Vec::new();
        let mut bytes = 0;
        for (number, (view, files)) in (1..).zip(self.views) {
            bytes += files.iter().flatten().map(Vec::len).sum::<usize>();
            if bytes > BYTES_MAX {
                break;
            }
            for ((_, file), content) in PICTURE_KINDS.iter().zip(&files) {
                if let Some(content) = content {
                    atomic::write(path(out, number, file), |out| out.write_all(content))?;
                }
            }
            written.push(PicturedView { number, ..view });
        }
        Ok(written)
    }
}

/// Deletes pictures that an earlier end of the run wrote.
fn remove_old(out: &Path) -> Result<()> {
    for number in 1..=VIEWS_MAX as u32 {
        for (_, file) in PICTURE_KINDS {
            let path = path(out, number, file);
            if path.is_file() {
                std::fs::remove_file(&path).map_err(Error::write(&path))?;
            }
        }
    }
    Ok(())
}
