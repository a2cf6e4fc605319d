//! Soft edges of id masks: between two areas lie pixels with values between theirs.
//!
//! A blur, a filter that resizes, and JPEG make such pixels. Each of their values counts as an object, and those of masks
//! with many ids belong to others.

use labelgs_scene::Setting;
use std::collections::BTreeMap;

/// Shortest run of one value that counts as an area, px.
const AREA_MIN: usize = 3;
/// Most lines of a mask that are looked at, in each direction.
const LINES_MAX: usize = 128;
/// Fewest edges that tell anything.
const EDGES_MIN: u64 = 16;
/// Share of soft ones among the edges above which masks are soft. Sharp masks have up to 0.2, of objects thinner than an
/// area; soft ones from 0.35, where half of the edges fall between pixels.
const SOFT_SHARE: f64 = 0.3;
/// Share of one value among those between areas above which it is an outline that was drawn.
const ONE_VALUE: f64 = 0.9;
/// Length of the way from one area to the next through the values between, relative to the straight one: filters and JPEG
/// swing beyond both sides.
const WAY_MAX: f64 = 1.5;

/// The edges between the areas of a mask, along lines.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Edges {
    /// Edges with room for a value between.
    all: u64,
    soft: u64,
    /// Number of pixels of each value in soft edges.
    between: BTreeMap<u32, u64>,
}

impl Edges {
    /// Looks at some rows and columns of a mask.
    pub fn of<T: Copy + Into<u32>>(ids: &[T], width: u32, height: u32) -> Self {
        let mut edges = Self::default();
        let (width, height) = (width as usize, height as usize);
        let mut line: Vec<u32> = Vec::new();
        let mut look = |start: usize, step: usize, count: usize| {
            line.clear();
            line.extend((0..count).map(|at| ids[start + at * step].into()));
            edges.add_line(&line);
        };
        (0..height).step_by(height.div_ceil(LINES_MAX)).for_each(|y| look(y * width, 1, width));
        (0..width).step_by(width.div_ceil(LINES_MAX)).for_each(|x| look(x, width, height));
        edges
    }

    fn add_line(&mut self, line: &[u32]) {
        // The value of the last area, and where it ended.
        let mut last: Option<(u32, usize)> = None;
        let mut at = 0;
        for run in line.chunk_by(|a, b| a == b) {
            if run.len() >= AREA_MIN {
                if let Some((value, end)) = last {
                    self.add_edge(value, &line[end..at], run[0]);
                }
                last = Some((run[0], at + run.len()));
            }
            at += run.len();
        }
    }

    fn add_edge(&mut self, from: u32, between: &[u32], to: u32) {
        let (low, high) = (from.min(to), from.max(to));
        if high - low < 2 {
            return;
        }
        self.all += 1;
        let (mut way, mut before) = (0, from);
        for &value in between.iter().chain([&to]) {
            way += u64::from(value.abs_diff(before));
            before = value;
        }
        let mut inside = between.iter().filter(|&&value| low < value && value < high).peekable();
        if inside.peek().is_some() && way as f64 <= WAY_MAX * f64::from(high - low) + 4.0 {
            self.soft += 1;
            inside.for_each(|&value| *self.between.entry(value).or_default() += 1);
        }
    }

    fn add(mut self, other: &Self) -> Self {
        self.all += other.all;
        self.soft += other.soft;
        other.between.iter().for_each(|(value, pixels)| *self.between.entry(*value).or_default() += pixels);
        self
    }

    fn are_soft(&self) -> bool {
        let (most, sum) = (self.between.values().max().copied().unwrap_or(0), self.between.values().sum::<u64>());
        self.all >= EDGES_MIN
            && self.soft as f64 >= SOFT_SHARE * self.all as f64
            && most as f64 <= ONE_VALUE * sum as f64
    }
}

/// Says what is wrong if masks are soft, and what to do. `masks` are names and edges.
pub fn problem(masks: &[(&str, &Edges)]) -> Option<String> {
    let mut soft: Vec<&str> = masks.iter().filter(|(_, edges)| edges.are_soft()).map(|(name, _)| *name).collect();
    // A small mask has too few edges to tell alone.
    if masks.iter().fold(Edges::default(), |sum, (_, edges)| sum.add(edges)).are_soft() {
        soft = masks.iter().filter(|(_, edges)| edges.soft > 0).map(|(name, _)| *name).collect();
    }
    let first = soft.first()?;
    Some(format!(
        "{} of {} masks looked at have soft edges, such as that of {first}: values between those of two areas lie at their \
         edges, and each counts as an object. A blur, a filter that resizes, and JPEG make them. Make the masks again and \
         resize them with the nearest pixel; `masks import` with {} cuts masks of one object at half of the range",
        soft.len(),
        masks.len(),
        Setting("format").to("binary")
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: usize = 96;

    /// Discs of some radius over each other, with these ids.
    fn discs(radius: f32, ids: &[u32]) -> Vec<u32> {
        let mut map = vec![0; SIZE * SIZE];
        for (at, &id) in ids.iter().enumerate() {
            let random = (at as u32 + 1).wrapping_mul(2_654_435_761);
            let centre = [random >> 4, random >> 18].map(|place| (place as usize % SIZE) as f32 + 0.3);
            for (pixel, value) in map.iter_mut().enumerate() {
                let (x, y) = ((pixel % SIZE) as f32 - centre[0], (pixel / SIZE) as f32 - centre[1]);
                if x * x + y * y <= radius * radius {
                    *value = id;
                }
            }
        }
        map
    }

    /// Means of squares of `side` pixels around each pixel.
    fn blurred(map: &[u32], side: usize) -> Vec<u32> {
        let at = |x: usize, y: usize| map[y.min(SIZE - 1) * SIZE + x.min(SIZE - 1)];
        let mean = |pixel: usize| {
            let (x, y) = (pixel % SIZE, pixel / SIZE);
            let sum: u32 = (0..side * side).map(|step| at(x + step % side, y + step / side)).sum();
            (f64::from(sum) / (side * side) as f64).round() as u32
        };
        (0..map.len()).map(mean).collect()
    }

    fn is_soft(map: &[u32]) -> bool {
        problem(&[("a", &Edges::of(map, SIZE as u32, SIZE as u32))]).is_some()
    }

    #[test]
    fn blurred_masks_are_soft_whatever_their_ids() {
        for ids in [&[255][..], &[3, 7, 1, 5, 8, 2], &[40, 200, 90, 10, 65]] {
            let sharp = discs(14.0, ids);
            assert!(!is_soft(&sharp), "{ids:?}");
            for side in [2, 3, 6] {
                assert!(is_soft(&blurred(&sharp, side)), "{ids:?} {side}");
            }
        }
    }

    #[test]
    fn values_that_swing_as_those_of_jpeg_are_soft() {
        let line = [0, 0, 0, 0, 2, 0, 5, 251, 255, 248, 255, 255, 255, 255, 253, 249, 3, 0, 4, 0, 0, 0_u32];
        assert!(problem(&[("a", &Edges::of(&line.repeat(10), line.len() as u32, 10))]).is_some());
    }

    #[test]
    fn many_small_objects_are_not_soft() {
        for (radius, count) in [(1.5, 600_u32), (3.0, 300), (6.0, 150)] {
            let mixed: Vec<u32> = (0..count).map(|at| at * 7919 % 4001 + 1).collect();
            assert!(!is_soft(&discs(radius, &mixed)), "{radius}");
            assert!(!is_soft(&discs(radius, &(1..=count).collect::<Vec<_>>())), "{radius}");
        }
        // Outlines that were drawn between the objects.
        let mut map = discs(14.0, &[90, 200, 40, 120, 250]);
        let other = map.clone();
        for at in SIZE + 1..map.len() {
            if other[at] != other[at - 1] || other[at] != other[at - SIZE] {
                map[at] = 66;
            }
        }
        assert!(!is_soft(&map));
        assert!(!is_soft(&[0; SIZE * SIZE]) && problem(&[]).is_none());
    }

    #[test]
    fn a_soft_mask_among_sharp_ones_is_named() {
        let (sharp, soft) = (discs(14.0, &[255, 100]), blurred(&discs(14.0, &[255]), 3));
        let [sharp, soft] = [&sharp, &soft].map(|map| Edges::of(map, SIZE as u32, SIZE as u32));
        let masks = [("a", &sharp), ("b", &sharp), ("c", &soft), ("d", &sharp), ("e", &sharp), ("f", &sharp)];
        let problem = problem(&masks).expect("soft");
        assert!(problem.starts_with("1 of 6 masks looked at have soft edges, such as that of c:"), "{problem}");
    }
}
