//! Finds the first and last use of each buffer in a list.

use super::barrier::BufferUse;
use super::buffers::{Class, Table};
use crate::error::{Error, Result};

/// The range of items in which a buffer's contents matter, both ends inclusive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lifetime {
    /// First item that uses the buffer.
    pub first: usize,
    /// Last item that uses the buffer.
    pub last: usize,
}

impl Lifetime {
    /// Returns true if both are alive during at least one item.
    pub fn overlaps(self, other: Self) -> bool {
        self.first <= other.last && other.first <= self.last
    }
}

pub(super) fn lives(buffers: usize, uses: &[Vec<BufferUse>]) -> Vec<Option<Lifetime>> {
    let mut lives = vec![None::<Lifetime>; buffers];
    for (item, uses) in uses.iter().enumerate() {
        for touched in uses {
            let life = lives[touched.buf.index()].get_or_insert(Lifetime { first: item, last: item });
            life.last = item;
        }
    }
    lives
}

/// Fails if the first use of a scratch buffer only reads it: its contents would be undefined, so a pass is missing.
pub(super) fn check_written_first(table: &'static Table, labels: &[String], uses: &[Vec<BufferUse>]) -> Result<()> {
    let mut written = vec![false; table.len()];
    for (item, uses) in uses.iter().enumerate() {
        for touched in uses.iter().filter(|touched| touched.kind.writes()) {
            written[touched.buf.index()] = true;
        }
        for touched in uses {
            let decl = &table[touched.buf.index()];
            if decl.class == Class::Step && !written[touched.buf.index()] {
                let (label, name) = (&labels[item], decl.name);
                return Err(Error::Bug(format!("{label} reads the scratch buffer {name} before anything writes it")));
            }
        }
    }
    Ok(())
}
