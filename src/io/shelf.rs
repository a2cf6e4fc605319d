//! Arrays of one kind for all views, such as depth maps, within a budget of memory.

use super::PHOTO_MEMORY;
use super::scratch::{Place, Scratch};
use crate::error::{Error, Result};
use crate::scene::Pixels;
use crate::scene::pixels::Source;
use std::sync::Arc;

/// Memory of a shelf, bytes. Photos have their own.
const MEMORY: u64 = PHOTO_MEMORY / 4;

/// Takes arrays; from the first one on that does not fit, they wait in a temporary file.
#[derive(Debug)]
pub(crate) struct Shelf {
    left: u64,
    scratch: Arc<Scratch>,
}

impl Shelf {
    /// Makes an empty one.
    pub(crate) fn new() -> Self {
        Self { left: MEMORY, scratch: Arc::new(Scratch::new(&std::env::temp_dir())) }
    }

    /// Takes an array. Without space for the file it stays in memory.
    pub(crate) fn put(&mut self, values: Vec<f32>) -> Pixels<Vec<f32>> {
        let bytes = size_of_val(values.as_slice()) as u64;
        self.left = self.left.saturating_sub(bytes);
        let place = if self.left > 0 {
            None
        } else {
            self.scratch.put(bytemuck::cast_slice(&values), "all of it stays in memory")
        };
        match place {
            Some(place) => {
                let waiting = Waiting { scratch: Arc::clone(&self.scratch), place, count: values.len() };
                Pixels::made(Arc::new(waiting), Default::default())
            }
            None => values.into(),
        }
    }
}

#[derive(Debug)]
struct Waiting {
    scratch: Arc<Scratch>,
    place: Place,
    count: usize,
}

impl Source<Vec<f32>> for Waiting {
    fn make(&self) -> Result<Arc<Vec<f32>>> {
        let mut values = vec![0.0; self.count];
        let read = self.scratch.read(self.place, bytemuck::cast_slice_mut(&mut values));
        read.map_err(Error::read(std::env::temp_dir()))?;
        Ok(Arc::new(values))
    }

    fn at_once(&self) -> usize {
        1
    }
}
