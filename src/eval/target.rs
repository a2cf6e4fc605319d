//! The photo that a render is compared with.

use crate::error::Result;
use crate::scene::view::ALPHA_CLEAR;
use crate::scene::{Photo, View};
use std::sync::Arc;

/// The photo of a view, over the background of the render.
pub(crate) struct Target {
    /// The photo, with the background behind transparent pixels.
    pub(crate) photo: Arc<Photo>,
    /// The same with only opaque pixels valid, if it is a photo of objects alone.
    objects: Option<Photo>,
}

impl Target {
    /// Reads the photo of a view.
    pub(crate) fn for_view(view: &View, background: [f32; 3]) -> Result<Self> {
        let photo = view.photo()?;
        let Some(rgba) = photo.over(background) else { return Ok(Self { photo, objects: None }) };
        let shown = |(over, own): (&[u8; 4], &[u8; 4])| if own[3] == ALPHA_CLEAR { [0; 4] } else { *over };
        let objects = rgba.iter().zip(&photo.rgba).map(shown).collect();
        let (width, height) = (photo.width, photo.height);
        let objects = Photo { width, height, rgba: objects };
        Ok(Self { photo: Photo { rgba, width, height }.into(), objects: Some(objects) })
    }

    /// Returns the photo for colour scores. Clear pixels of a photo of objects alone do not count, because any empty
    /// render is right there.
    pub(crate) fn coloured(&self) -> &Photo {
        self.objects.as_ref().unwrap_or(&self.photo)
    }
}
