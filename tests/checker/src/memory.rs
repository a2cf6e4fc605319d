//! Device memory: words, which of them were written, and who touched them last.

use crate::races::Shadow;

/// What a word holds that nobody has written.
pub const POISON: u32 = 0xdead_beef;

const PAGE_UNITS: usize = 1024;

/// One allocation. The host may map it, so its words have a fixed place and are accessed through a pointer.
#[derive(Debug)]
pub struct Memory {
    words: *mut u32,
    count: usize,
    /// A bit for each word that was written; `None` if the host can write.
    written: Option<Vec<u64>>,
    shadows: Vec<Option<Box<[Shadow]>>>,
}

// SAFETY: the pointer owns its words.
unsafe impl Send for Memory {}

impl Memory {
    /// Allocates zeros. The words of memory that the host sees count as written.
    pub fn new(bytes: u64, is_host_visible: bool) -> Self {
        let count = bytes.div_ceil(4) as usize;
        let words = Box::into_raw(vec![0_u32; count].into_boxed_slice()).cast::<u32>();
        let written = (!is_host_visible).then(|| vec![0; count.div_ceil(64)]);
        Self { words, count, written, shadows: Vec::new() }
    }

    /// First byte, for the host.
    pub fn pointer(&self) -> *mut u8 {
        self.words.cast()
    }

    /// Size in bytes.
    pub fn bytes(&self) -> u64 {
        self.count as u64 * 4
    }

    /// The word at a byte offset, which is inside.
    pub fn word(&self, byte: u64) -> u32 {
        let place = (byte / 4) as usize;
        assert!(place < self.count);
        // SAFETY: inside of the allocation.
        unsafe { self.words.add(place).read() }
    }

    /// Writes a word.
    pub fn set_word(&mut self, byte: u64, value: u32) {
        let place = (byte / 4) as usize;
        assert!(place < self.count);
        // SAFETY: inside of the allocation.
        unsafe { self.words.add(place).write(value) };
        if let Some(written) = &mut self.written {
            written[place / 64] |= 1 << (place % 64);
        }
    }

    /// Reads 4 or 2 bytes.
    pub fn read(&self, byte: u64, width: u32) -> u32 {
        match width {
            4 => self.word(byte),
            _ => self.word(byte) >> (8 * (byte & 2)) & 0xffff,
        }
    }

    /// Writes 4 or 2 bytes.
    pub fn write(&mut self, byte: u64, width: u32, value: u32) {
        match width {
            4 => self.set_word(byte, value),
            _ => {
                let shift = 8 * (byte & 2);
                let old = self.word(byte) & !(0xffff << shift);
                self.set_word(byte, old | (value & 0xffff) << shift);
            }
        }
    }

    /// True if the word was written.
    pub fn is_written(&self, byte: u64) -> bool {
        let place = (byte / 4) as usize;
        self.written.as_ref().is_none_or(|written| written[place / 64] >> (place % 64) & 1 == 1)
    }

    /// Copies a word of another memory: it is as written as that.
    pub fn copy_word(&mut self, byte: u64, (value, is_written): (u32, bool)) {
        self.set_word(byte, if is_written { value } else { POISON });
        if let (false, Some(written)) = (is_written, &mut self.written) {
            let place = (byte / 4) as usize;
            written[place / 64] &= !(1 << (place % 64));
        }
    }

    /// Last accesses of a unit.
    pub fn shadow(&mut self, unit: u64) -> &mut Shadow {
        let (page, place) = (unit as usize / PAGE_UNITS, unit as usize % PAGE_UNITS);
        if page >= self.shadows.len() {
            self.shadows.resize_with(page + 1, || None);
        }
        let page = self.shadows[page].get_or_insert_with(|| vec![Shadow::default(); PAGE_UNITS].into());
        &mut page[place]
    }
}

impl Drop for Memory {
    fn drop(&mut self) {
        // SAFETY: made from such a box in `new`.
        drop(unsafe { Box::from_raw(std::ptr::slice_from_raw_parts_mut(self.words, self.count)) });
    }
}
