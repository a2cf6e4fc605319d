//! Detects soft edges of id masks: between two areas lie pixels with intermediate values.
//!
//! Blur, filtered resizing and JPEG cause such pixels. Each of their values counts as an object, and in masks with many
//! ids it is the id of another object.

use labelgs_scene::Setting;
use std::collections::BTreeMap;

/// Shortest run of a value that counts as an area, px.
const AREA_MIN: usize = 3;
/// Most lines of a mask that are examined in each direction.
const LINES_MAX: usize = 128;
/// Fewest edges for a verdict.
const EDGES_MIN: u64 = 16;
/// Masks are soft if the share of soft edges exceeds this value. Sharp masks have up to 0.2, from objects thinner than
/// an area. Soft ones have at least 0.35, because half of the edges fall between pixels.
const SOFT_SHARE_MIN: f64 = 0.3;
/// If one value has more than this share of the pixels between areas, it is an outline drawn on purpose.
const OUTLINE_SHARE_MIN: f64 = 0.9;
/// Longest path from one area to the next through the values between, relative to the direct one: filters and JPEG
/// overshoot on both sides.
const PATH_RATIO_MAX: f64 = 1.5;

/// The edges between the areas of a mask, along lines.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Edges {
    /// Number of edges with space for a value in between.
    all: u64,
    soft: u64,
    /// Number of pixels of each value in soft edges.
    between: BTreeMap<u32, u64>,
}

impl Edges {
    /// Examines some rows and columns of a mask.
    pub fn measure<T: Copy + Into<u32>>(ids: &[T], width: u32, height: u32) -> Self {
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
        if inside.peek().is_some() && way as f64 <= PATH_RATIO_MAX * f64::from(high - low) + 4.0 {
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
            && self.soft as f64 >= SOFT_SHARE_MIN * self.all as f64
            && most as f64 <= OUTLINE_SHARE_MIN * sum as f64
    }
}

/// Returns a message if masks are soft, with the cure. `masks` are names and edges.
pub fn problem(masks: &[(&str, &Edges)]) -> Option<String> {
    let mut soft: Vec<&str> = masks.iter().filter(|(_, edges)| edges.are_soft()).map(|(name, _)| *name).collect();
    // A small mask has too few edges for a verdict of its own.
    if masks.iter().fold(Edges::default(), |sum, (_, edges)| sum.add(edges)).are_soft() {
        soft = masks.iter().filter(|(_, edges)| edges.soft > 0).map(|(name, _)| *name).collect();
    }
    let first = soft.first()?;
    Some(format!(
        "{} of {} examined masks have soft edges, such as that of {first}: pixels at their edges have values between \
         those of both areas, and each counts as an object. Blur, filtered resizing and JPEG cause them. Make the masks \
         again and resize them with the nearest pixel; `masks import` with {} cuts masks of one object at half of the range",
        soft.len(),
        masks.len(),
        Setting("format").to("binary")
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    const MAP_SIDE: usize = 96;

    /// Discs of some radius over each other, with these ids.
    fn discs(radius: f32, ids: &[u32]) -> Vec<u32> {
        let mut map = vec![0; MAP_SIDE * MAP_SIDE];
        for (at, &id) in ids.iter().enumerate() {
            let random = (at as u32 + 1).wrapping_mul(2_654_435_761);
            let centre = [random >> 4, random >> 18].map(|place| (place as usize % MAP_SIDE) as f32 + 0.3);
            for (pixel, value) in map.iter_mut().enumerate() {
                let (x, y) = ((pixel % MAP_SIDE) as f32 - centre[0], (pixel / MAP_SIDE) as f32 - centre[1]);
                if x * x + y * y <= radius * radius {
                    *value = id;
                }
            }
        }
        map
    }

    /// Means of squares of `side` pixels around each pixel.
    fn blurred(map: &[u32], side: usize) -> Vec<u32> {
        let at = |x: usize, y: usize| map[y.min(MAP_SIDE - 1) * MAP_SIDE + x.min(MAP_SIDE - 1)];
        let mean = |pixel: usize| {
            let (x, y) = (pixel % MAP_SIDE, pixel / MAP_SIDE);
            let sum: u32 = (0..side * side).map(|step| at(x + step % side, y + step / side)).sum();
            (f64::from(sum) / (side * side) as f64).round() as u32
        };
        (0..map.len()).map(mean).collect()
    }

    fn is_soft(map: &[u32]) -> bool {
        problem(&[("a", &Edges::measure(map, MAP_SIDE as u32, MAP_SIDE as u32))]).is_some()
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
        assert!(problem(&[("a", &Edges::measure(&line.repeat(10), line.len() as u32, 10))]).is_some());
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
        for at in MAP_SIDE + 1..map.len() {
            if other[at] != other[at - 1] || other[at] != other[at - MAP_SIDE] {
                map[at] = 66;
            }
        }
        assert!(!is_soft(&map));
        assert!(!is_soft(&[0; MAP_SIDE * MAP_SIDE]) && problem(&[]).is_none());
    }

    #[test]
    fn a_soft_mask_among_sharp_ones_is_named() {
        let (sharp, soft) = (discs(14.0, &[255, 100]), blurred(&discs(14.0, &[255]), 3));
        let [sharp, soft] = [&sharp, &soft].map(|map| Edges::measure(map, MAP_SIDE as u32, MAP_SIDE as u32));
        let masks = [("a", &sharp), ("b", &sharp), ("c", &soft), ("d", &sharp), ("e", &sharp), ("f", &sharp)];
        let problem = problem(&masks).expect("soft");
        assert!(problem.starts_with("1 of 6 examined masks have soft edges, such as that of c:"), "{problem}");
    }
}
