//! Stores arrays of the same kind for all views, such as depth maps, within a memory budget.

use super::PHOTO_MEMORY;
use labelgs_files::scratch::{Scratch, ScratchOffset, system_folder};
use labelgs_scene::pixels::PixelSource;
use labelgs_scene::{Error, Pixels, Result};
use std::sync::Arc;

/// Memory of a store, bytes. Photos have a separate budget.
const MEMORY_BYTES: u64 = PHOTO_MEMORY / 4;

/// Stores arrays in memory up to the budget. From the first one that does not fit, they go to a temporary file.
#[derive(Debug)]
pub struct ArrayStore {
    left: u64,
    scratch: Arc<Scratch>,
}

impl Default for ArrayStore {
    fn default() -> Self {
        Self::with_memory(MEMORY_BYTES)
    }
}

impl ArrayStore {
    fn with_memory(memory: u64) -> Self {
        Self { left: memory, scratch: Arc::new(Scratch::new(&system_folder())) }
    }

    /// Stores an array. Without space for the file, it stays in memory.
    pub fn put(&mut self, values: Vec<f32>) -> Pixels<Vec<f32>> {
        let bytes = size_of_val(values.as_slice()) as u64;
        self.left = self.left.saturating_sub(bytes);
        let place = if self.left > 0 {
            None
        } else {
            self.scratch.put(bytemuck::cast_slice(&values), "all of it stays in memory")
        };
        match place {
            Some(place) => {
                let waiting = StoredArray { scratch: Arc::clone(&self.scratch), place, count: values.len() };
                Pixels::from_source(Arc::new(waiting), Default::default())
            }
            None => values.into(),
        }
    }
}

#[derive(Debug)]
struct StoredArray {
    scratch: Arc<Scratch>,
    place: ScratchOffset,
    count: usize,
}

impl PixelSource<Vec<f32>> for StoredArray {
    fn make(&self) -> Result<Arc<Vec<f32>>> {
        let mut values = vec![0.0; self.count];
        let read = self.scratch.read(self.place, bytemuck::cast_slice_mut(&mut values));
        read.map_err(Error::read(system_folder()))?;
        Ok(Arc::new(values))
    }

    fn at_once(&self) -> usize {
        1
    }
}

#[cfg(test)]
mod tests {
    use super::ArrayStore;

    #[test]
    fn arrays_that_do_not_fit_come_back_from_a_file() {
        let mut shelf = ArrayStore::with_memory(100);
        let arrays: Vec<Vec<f32>> = (0..4).map(|index| vec![index as f32; 10 + index]).collect();
        let kept: Vec<_> = arrays.iter().map(|array| shelf.put(array.clone())).collect();
        assert_eq!(kept.iter().map(|array| array.is_held()).collect::<Vec<_>>(), [true, true, false, false]);
        for (array, kept) in arrays.iter().zip(kept) {
            assert_eq!(*kept.get().expect("read"), *array);
        }
    }
}
