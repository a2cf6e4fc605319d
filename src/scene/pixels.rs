//! Pixels of a view: in memory, or made on demand.
//!
//! Photos and masks of a large scene do not fit into memory. A view has [`Pixels`] of each, whose bits do not depend on
//! where they are stored. Facts that are often needed for all views, such as the objects of a mask, are available
//! without the pixels.

use super::{LabelMap, Photo};
use crate::error::Result;
use std::fmt;
use std::sync::Arc;

/// Makes pixels that are not in memory.
pub trait PixelSource<T>: fmt::Debug + Send + Sync {
    /// Makes the pixels; the result is the same each time.
    fn make(&self) -> Result<Arc<T>>;

    /// Returns how many images may be made at the same time within the available memory.
    fn at_once(&self) -> usize;
}

/// What is known about pixels without loading them.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PixelFacts {
    /// CRC-32 of the pixels.
    pub crc: u32,
    /// Ids of a mask, sorted, without 0.
    pub objects: Vec<u16>,
}

/// A photo or a mask.
pub trait PixelBuffer {
    /// Returns the pixels as bytes.
    fn bytes(&self) -> &[u8];

    /// Returns the ids of a mask, sorted, without 0; empty for a photo.
    fn ids(&self) -> Vec<u16>;

    /// Returns the CRC-32 of the pixels.
    fn crc(&self) -> u32 {
        crc32fast::hash(self.bytes())
    }

    /// Returns the facts about the pixels.
    fn facts(&self) -> PixelFacts {
        PixelFacts { crc: self.crc(), objects: self.ids() }
    }
}

impl PixelBuffer for Photo {
    fn bytes(&self) -> &[u8] {
        self.rgba.as_flattened()
    }

    fn ids(&self) -> Vec<u16> {
        Vec::new()
    }
}

impl PixelBuffer for LabelMap {
    fn bytes(&self) -> &[u8] {
        bytemuck::cast_slice(&self.ids)
    }

    fn ids(&self) -> Vec<u16> {
        self.objects()
    }
}

/// A photo, a mask, or other pixels of a view. Clones are cheap.
pub struct Pixels<T>(Storage<T>);

enum Storage<T> {
    Held(Arc<T>),
    Made(Arc<dyn PixelSource<T>>, Arc<PixelFacts>),
}

impl<T> Pixels<T> {
    /// Creates pixels that `source` makes on demand.
    pub fn from_source(source: Arc<dyn PixelSource<T>>, facts: PixelFacts) -> Self {
        Self(Storage::Made(source, Arc::new(facts)))
    }

    /// Returns the pixels. If they are not in memory, loads them and keeps them for as long as the result lives.
    ///
    /// # Errors
    ///
    /// Files that can no longer be read, or have changed since the scene was opened.
    pub fn get(&self) -> Result<Arc<T>> {
        match &self.0 {
            Storage::Held(pixels) => Ok(Arc::clone(pixels)),
            Storage::Made(source, _) => source.make(),
        }
    }

    /// Returns true if the pixels are in memory.
    pub fn is_held(&self) -> bool {
        matches!(self.0, Storage::Held(_))
    }

    /// Returns how many such images may be loaded at the same time.
    pub fn at_once(&self) -> usize {
        match &self.0 {
            Storage::Held(_) => usize::MAX,
            Storage::Made(source, _) => source.at_once().max(1),
        }
    }
}

impl<T: Clone> Pixels<T> {
    /// Changes the pixels of this copy, which then stay in memory.
    pub fn edit(&mut self, change: impl FnOnce(&mut T)) -> Result<()> {
        if !self.is_held() {
            *self = self.get()?.into();
        }
        if let Storage::Held(pixels) = &mut self.0 {
            change(Arc::make_mut(pixels));
        }
        Ok(())
    }
}

impl Pixels<LabelMap> {
    /// Returns the ids of the mask, sorted, without 0.
    pub fn objects(&self) -> Vec<u16> {
        match &self.0 {
            Storage::Held(pixels) => pixels.objects(),
            Storage::Made(_, facts) => facts.objects.clone(),
        }
    }
}

impl<T: PixelBuffer> Pixels<T> {
    /// Returns the CRC-32 of the pixels.
    pub fn crc(&self) -> u32 {
        match &self.0 {
            Storage::Held(pixels) => pixels.crc(),
            Storage::Made(_, facts) => facts.crc,
        }
    }
}

impl<T> From<Arc<T>> for Pixels<T> {
    fn from(pixels: Arc<T>) -> Self {
        Self(Storage::Held(pixels))
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
            Storage::Held(pixels) => Storage::Held(Arc::clone(pixels)),
            Storage::Made(source, facts) => Storage::Made(Arc::clone(source), Arc::clone(facts)),
        })
    }
}

impl<T> fmt::Debug for Pixels<T> {
    fn fmt(&self, out: &mut fmt::Formatter) -> fmt::Result {
        out.write_str(if self.is_held() { "pixels in memory" } else { "pixels in files" })
    }
}
