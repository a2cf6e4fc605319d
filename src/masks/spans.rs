//! The pixels of an object as runs, because a photo may have hundreds of masks.

/// Pixels of an object: runs of indices, row-major.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Spans {
    runs: Vec<(u32, u32)>,
}

impl Spans {
    /// Collects the runs of pixels that are inside.
    pub(super) fn from_mask(inside: &[bool]) -> Self {
        let mut runs = Vec::new();
        let mut at = 0;
        for part in inside.chunk_by(|a, b| a == b) {
            if part[0] {
                runs.push((at, at + part.len() as u32));
            }
            at += part.len() as u32;
        }
        Self { runs }
    }

    /// Returns the number of pixels.
    pub(super) fn area(&self) -> u64 {
        self.runs.iter().map(|(start, end)| u64::from(end - start)).sum()
    }

    /// Returns the runs.
    pub(super) fn runs(&self) -> impl Iterator<Item = std::ops::Range<usize>> + '_ {
        self.runs.iter().map(|&(start, end)| start as usize..end as usize)
    }
}

/// Returns the first of `to` cells whose centre lies at or beyond the start of cell `at` of `from` cells along the same
/// line.
pub(super) fn first_beyond(at: u64, from: u32, to: u32) -> usize {
    let (from, to) = (u64::from(from), u64::from(to));
    ((2 * at * to + from - 1) / (2 * from)).min(to) as usize
}

/// Returns the cell among `to` cells that contains the centre of cell `at` of `from` cells.
pub(super) fn cell_of(at: u32, from: u32, to: u32) -> u64 {
    (2 * u64::from(at) + 1) * u64::from(to) / (2 * u64::from(from))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_are_those_of_the_pixels() {
        let inside = [false, true, true, false, true];
        let spans = Spans::from_mask(&inside);
        assert_eq!((spans.area(), spans.runs().collect::<Vec<_>>()), (3, vec![1..3, 4..5]));
        assert_eq!(Spans::from_mask(&[]), Spans::default());
    }

    #[test]
    fn both_ways_along_a_line_agree() {
        for (from, to) in [(1, 1), (7, 7), (12, 5), (5, 12), (3, 1000)] {
            for at in 0..=from {
                let first = (0..to).find(|&place| cell_of(place, to, from) >= u64::from(at)).unwrap_or(to);
                assert_eq!(first_beyond(u64::from(at), from, to), first as usize, "{at} of {from} in {to}");
            }
        }
    }
}
