//! Pixels of a view: in memory, or made each time they are asked for.
//!
//! Photos and masks of a large scene do not fit into memory. A view holds [`Pixels`] of each, which are the same bits
//! wherever they come from; what is often asked of all views, such as the objects of a mask, is known without them.

use super::{LabelMap, Photo};
use crate::error::Result;
use std::fmt;
use std::sync::Arc;

/// Where pixels come from that are not in memory.
pub trait Source<T>: fmt::Debug + Send + Sync {
    /// Makes the pixels: the same each time.
    fn make(&self) -> Result<Arc<T>>;

    /// Number of pictures that may be made at the same time, so that all of them have the memory for it.
    fn at_once(&self) -> usize;
}

/// What is known of pixels without having them.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Facts {
    /// CRC-32 of the pixels.
    pub crc: u32,
    /// Ids of a mask, sorted, without 0.
    pub objects: Vec<u16>,
}

/// A photo or a mask.
pub trait Picture {
    /// Returns the pixels as bytes.
    fn bytes(&self) -> &[u8];

    /// Returns the ids of a mask, sorted, without 0; none of a photo.
    fn ids(&self) -> Vec<u16>;

    /// Returns the CRC-32 of the pixels.
    fn crc(&self) -> u32 {
        crc32fast::hash(self.bytes())
    }

    /// Returns what is known of the pixels.
    fn facts(&self) -> Facts {
        Facts { crc: self.crc(), objects: self.ids() }
    }
}

impl Picture for Photo {
    fn bytes(&self) -> &[u8] {
        self.rgba.as_flattened()
    }

    fn ids(&self) -> Vec<u16> {
        Vec::new()
    }
}

impl Picture for LabelMap {
    fn bytes(&self) -> &[u8] {
        bytemuck::cast_slice(&self.ids)
    }

    fn ids(&self) -> Vec<u16> {
        self.objects()
    }
}

/// A photo, a mask, or other pixels of a view. Copies are cheap.
pub struct Pixels<T>(Place<T>);

enum Place<T> {
    Held(Arc<T>),
    Made(Arc<dyn Source<T>>, Arc<Facts>),
}

impl<T> Pixels<T> {
    /// Takes pixels that `source` makes.
    pub fn made(source: Arc<dyn Source<T>>, facts: Facts) -> Self {
        Self(Place::Made(source, Arc::new(facts)))
    }

    /// Returns the pixels. Those that are not in memory are read, and stay in memory as long as the result lives.
    ///
    /// # Errors
    ///
    /// Files that cannot be read any more, or have changed since the scene was opened.
    pub fn get(&self) -> Result<Arc<T>> {
        match &self.0 {
            Place::Held(pixels) => Ok(Arc::clone(pixels)),
            Place::Made(source, _) => source.make(),
        }
    }

    /// Returns true if the pixels are in memory.
    pub fn is_held(&self) -> bool {
        matches!(self.0, Place::Held(_))
    }

    /// Number of such pictures that may be asked for at the same time.
    pub fn at_once(&self) -> usize {
        match &self.0 {
            Place::Held(_) => usize::MAX,
            Place::Made(source, _) => source.at_once().max(1),
        }
    }
}

impl<T: Clone> Pixels<T> {
    /// Changes the pixels of this copy, which are in memory from then on.
    pub fn edit(&mut self, change: impl FnOnce(&mut T)) -> Result<()> {
        if !self.is_held() {
            *self = self.get()?.into();
        }
        if let Place::Held(pixels) = &mut self.0 {
            change(Arc::make_mut(pixels));
        }
        Ok(())
    }
}

impl Pixels<LabelMap> {
    /// Returns the ids of the mask, sorted, without 0.
    pub fn objects(&self) -> Vec<u16> {
        match &self.0 {
            Place::Held(pixels) => pixels.objects(),
            Place::Made(_, facts) => facts.objects.clone(),
        }
    }
}

impl<T: Picture> Pixels<T> {
    /// Returns the CRC-32 of the pixels.
    pub fn crc(&self) -> u32 {
        match &self.0 {
            Place::Held(pixels) => pixels.crc(),
            Place::Made(_, facts) => facts.crc,
        }
    }
}

impl<T> From<Arc<T>> for Pixels<T> {
    fn from(pixels: Arc<T>) -> Self {
        Self(Place::Held(pixels))
    }
}

impl<T> From<T> for Pixels<T> {
    fn from(pixels: T) -> Self {
        Arc::new(pixels).into()
    }
}

impl<T> Clone for Pixels<T> {
    fn clone(&self) -> Self {
        Self(match &self.0 {
            Place::Held(pixels) => Place::Held(Arc::clone(pixels)),
            Place::Made(source, facts) => Place::Made(Arc::clone(source), Arc::clone(facts)),
        })
    }
}

impl<T> fmt::Debug for Pixels<T> {
    fn fmt(&self, out: &mut fmt::Formatter) -> fmt::Result {
        out.write_str(if self.is_held() { "pixels in memory" } else { "pixels in files" })
    }
}
