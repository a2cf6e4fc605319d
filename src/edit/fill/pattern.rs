//! A pattern that repeats on a plane, such as tiles or stripes: found by the offsets at which what is seen of the plane
//! is like itself (statistics of offsets, He and Sun, ECCV 2012), and continued where nothing is seen.
//!
//! All places a period apart are asked, and what they agree on is the pattern: the joints of a floor repeat, its stains
//! do not, and no single stain appears twice.

use super::sheet::Sheet;
use glam::{DMat3, DVec2, DVec3};
use rand::SeedableRng;
use rand::seq::index;
use rand_pcg::Pcg64;
use rayon::prelude::*;

/// Most cells that two copies of the plane are compared at: to guess periods, and to know them.
const GUESS_CELLS_MAX: usize = 1000;
const COMPARED_CELLS_MAX: usize = 2500;
/// Seed of the choice of these cells.
const SEED: u64 = 0;
/// Fewest cells, and least share of the compared ones, that are seen in both copies.
const PAIRS_MIN: (usize, f64) = (100, 0.2);
/// Least standard deviation of colours from their trend along the plane; less is no pattern.
const DEVIATION_MIN: f64 = 0.012;
/// Shortest period, in cells, and least likeness of two copies at a first guess.
const PERIOD_MIN: f64 = 4.0;
const GUESS_MIN: f64 = 0.2;
/// Parts of the way to a guess between which the plane is compared too.
const WAY_PARTS: isize = 8;
/// Most guesses.
const GUESSES_MAX: usize = 24;
/// Least angle between two periods, as its sine.
const SINE_MIN: f64 = 0.3;
/// Fewest offsets in a pattern, and their least mean likeness.
const OFFSETS_MIN: usize = 12;
const LIKENESS_MIN: f64 = 0.3;
/// Most periods along a direction.
const PERIODS_MAX: i32 = 12;
/// What the likeness half a period away has to fall by; what is alike at all offsets has no period.
const FALL_MIN: f64 = 0.15;
/// Least share of the variance of what is seen that the pattern foretells.
const FORETOLD_MIN: f64 = 0.15;
/// Steps of the last adjustment of periods, in cells.
const ADJUSTMENT_CELLS: [f64; 4] = [1.0, 0.5, 0.25, 0.125];

/// The detail of a plane's colours in the light, as far as they are seen, on a grid of cells.
struct Seen<'a> {
    sheet: &'a Sheet,
    colours: &'a [Option<DVec3>],
    /// Cells at which copies are compared.
    samples: Vec<usize>,
}

/// Two copies of a plane, one of them moved.
#[derive(Clone, Copy, Debug, Default)]
struct Match {
    /// 1 for the same but for brightness, 0 for what has nothing in common.
    likeness: f64,
    /// Mean of the moved copy minus that of the other, over the cells of both.
    bias: DVec3,
}

impl<'a> Seen<'a> {
    fn new(sheet: &'a Sheet, colours: &'a [Option<DVec3>], samples: usize) -> Self {
        let known: Vec<usize> = (0..colours.len()).filter(|&index| colours[index].is_some()).collect();
        // By chance, because an even step may fall in with the pattern.
        let mut random = Pcg64::seed_from_u64(SEED);
        let chosen = index::sample(&mut random, known.len(), samples.min(known.len()));
        Self { sheet, colours, samples: chosen.into_iter().map(|at| known[at]).collect() }
    }

    fn cell(&self, index: usize) -> DVec2 {
        DVec2::new((index % self.sheet.width) as f64, (index / self.sheet.width) as f64)
    }

    /// Returns the colour between four cells; `None` where one of them is not seen.
    fn colour(&self, at: DVec2) -> Option<DVec3> {
        let low = at.floor();
        if low.min_element() < 0.0 {
            return None;
        }
        let (x, y, part) = (low.x as usize, low.y as usize, at - low);
        let get = |dx: usize, dy: usize| {
            let (x, y) = (x + dx, y + dy);
            if x < self.sheet.width && y < self.sheet.height { self.colours[y * self.sheet.width + x] } else { None }
        };
        // Whole offsets need no neighbours.
        let [right, below] = [usize::from(part.x > 0.0), usize::from(part.y > 0.0)];
        let above = get(0, 0)?.lerp(get(right, 0)?, part.x);
        Some(above.lerp(get(0, below)?.lerp(get(right, below)?, part.x), part.y))
    }

    /// Compares the plane with a copy moved by an offset in cells; `None` if too little is seen of both.
    fn compare(&self, offset: DVec2) -> Option<Match> {
        let (mut count, mut sums, mut squares, mut apart) = (0.0, [DVec3::ZERO; 2], [0.0; 2], 0.0);
        for &index in &self.samples {
            let (Some(here), Some(there)) = (self.colours[index], self.colour(self.cell(index) + offset)) else {
                continue;
            };
            count += 1.0;
            for ((sum, square), colour) in sums.iter_mut().zip(&mut squares).zip([here, there]) {
                *sum += colour;
                *square += colour.length_squared();
            }
            apart += (there - here).length_squared();
        }
        if count < (PAIRS_MIN.1 * self.samples.len() as f64).max(PAIRS_MIN.0 as f64) {
            return None;
        }
        let bias = (sums[1] - sums[0]) / count;
        let variance: f64 = (0..2).map(|copy| squares[copy] - sums[copy].length_squared() / count).sum();
        let apart = apart - bias.length_squared() * count;
        Some(Match { likeness: if variance > 1e-9 * count { 1.0 - apart / variance } else { 0.0 }, bias })
    }

    /// Returns the offsets at which the plane is like itself more than at those beside them, the most alike first.
    fn guesses(&self) -> Vec<DVec2> {
        let (across, down) = ((self.sheet.width / 2) as isize, (self.sheet.height / 2) as isize);
        let width = 2 * across + 1;
        let offset = |index: isize| [index % width - across, index / width];
        let likeness = |index: isize| {
            let [x, y] = offset(index);
            self.compare(DVec2::new(x as f64, y as f64)).map_or(f64::NEG_INFINITY, |found| found.likeness)
        };
        // An offset and its opposite are alike, so half of them are enough.
        let all: Vec<f64> = (0..width * (down + 1)).into_par_iter().map(likeness).collect();
        let value = |[x, y]: [isize; 2]| {
            let [x, y] = if y < 0 { [-x, -y] } else { [x, y] };
            let is_inside = x.abs() <= across && y <= down;
            if is_inside { all[(y * width + x + across) as usize] } else { f64::NEG_INFINITY }
        };
        let is_peak = |[x, y]: [isize; 2]| {
            let own = value([x, y]);
            let around = (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| [x + dx, y + dy]));
            own >= GUESS_MIN && around.into_iter().all(|beside| value(beside) <= own)
        };
        let is_far = |[x, y]: [isize; 2]| DVec2::new(x as f64, y as f64).length() >= PERIOD_MIN;
        // What is alike all the way there is so for its slow changes alone.
        let is_beyond = |[x, y]: [isize; 2]| {
            let between = (1..WAY_PARTS).map(|part| value([x * part / WAY_PARTS, y * part / WAY_PARTS]));
            value([x, y]) - between.fold(f64::INFINITY, f64::min) >= FALL_MIN
        };
        let mut found: Vec<[isize; 2]> =
            (0..all.len() as isize).map(offset).filter(|&at| is_far(at) && is_peak(at) && is_beyond(at)).collect();
        found.sort_by(|&a, &b| value(b).total_cmp(&value(a)).then(a.cmp(&b)));
        found.truncate(GUESSES_MAX);
        found.into_iter().map(|[x, y]| DVec2::new(x as f64, y as f64)).collect()
    }

    /// Returns the matches at all whole numbers of two periods, but for none of both.
    fn matches(&self, periods: [DVec2; 2]) -> Vec<(DVec2, Match)> {
        let most = DVec2::new(self.sheet.width as f64, self.sheet.height as f64);
        let numbers = -PERIODS_MAX..=PERIODS_MAX;
        let pairs = numbers.clone().flat_map(|m| numbers.clone().map(move |n| (m, n))).filter(|&pair| pair != (0, 0));
        let offsets = pairs.map(|(m, n)| f64::from(m) * periods[0] + f64::from(n) * periods[1]);
        let near: Vec<DVec2> = offsets.filter(|offset| offset.abs().cmplt(most).all()).collect();
        near.into_par_iter().filter_map(|offset| self.compare(offset).map(|found| (offset, found))).collect()
    }

    /// Returns how much more alike than half of `best` the plane is at all offsets of two periods together: more
    /// offsets are better, as long as they are alike.
    fn score(&self, periods: [DVec2; 2], best: f64) -> f64 {
        self.matches(periods).iter().map(|(_, found)| found.likeness - 0.5 * best).sum()
    }

    /// Returns the mean square of what is left of the colours without a trend along the plane (least squares).
    fn roughness(&self) -> f64 {
        let row = |index: usize| self.cell(index).extend(1.0);
        let known = || self.samples.iter().filter_map(|&index| Some((row(index), self.colours[index]?)));
        let matrix = known().fold(DMat3::ZERO, |sum, (row, _)| sum + DMat3::from_cols(row * row.x, row * row.y, row));
        if matrix.determinant().abs() < 1e-9 {
            return 0.0;
        }
        let right = known().fold(DMat3::ZERO, |sum, (row, colour)| {
            sum + DMat3::from_cols(row * colour.x, row * colour.y, row * colour.z)
        });
        let trend = matrix.inverse() * right;
        let left = known().map(|(row, colour)| (colour - trend.transpose() * row).length_squared() / 3.0);
        left.sum::<f64>() / self.samples.len().max(1) as f64
    }

    /// Halves periods as long as the plane is as much like itself half a period away, as it is along stripes.
    fn shortest(&self, mut periods: [DVec2; 2]) -> [DVec2; 2] {
        let likeness = |offset: DVec2| self.compare(offset).map_or(f64::NEG_INFINITY, |found| found.likeness);
        let whole = likeness(periods[0]).min(likeness(periods[1]));
        let is_one = |[half, other]: &[DVec2; 2]| {
            half.length() >= PERIOD_MIN && is_wide(&[*half, *other]) && likeness(*half) > whole - FALL_MIN
        };
        // The area between them halves too, which ends this.
        while let [a, b] = periods
            && 0.5 * a.perp_dot(b).abs() >= PERIOD_MIN * PERIOD_MIN
            && let Some(halved) = [[0.5 * a, b], [0.5 * b, a], [0.5 * (a + b), a]].into_iter().find(is_one)
        {
            periods = halved;
        }
        periods
    }

    /// Returns the two periods that explain most; `None` without any.
    fn periods(&self) -> Option<[DVec2; 2]> {
        let guesses = self.guesses();
        let best = self.compare(*guesses.first()?)?.likeness;
        let pairs = (0..guesses.len()).flat_map(|a| (0..a).map(move |b| [a, b]));
        let pairs = pairs.map(|pair| pair.map(|index| guesses[index]));
        let scored: Vec<(f64, [DVec2; 2])> =
            pairs.filter(is_wide).map(|periods| (self.score(periods, best), periods)).collect();
        let (_, periods) = scored.into_iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
        let mut periods = self.shortest(periods);
        let mut score = self.score(periods, best);
        for step in ADJUSTMENT_CELLS {
            for (which, by) in [0, 1]
                .into_iter()
                .flat_map(|which| [DVec2::X, DVec2::NEG_X, DVec2::Y, DVec2::NEG_Y].map(|by| (which, step * by)))
            {
                let mut tried = periods;
                tried[which] += by;
                let found = self.score(tried, best);
                if found > score && is_wide(&tried) {
                    (score, periods) = (found, tried);
                }
            }
        }
        Some(periods)
    }
}

/// Returns true for periods that are not along one line.
fn is_wide([a, b]: &[DVec2; 2]) -> bool {
    a.perp_dot(*b).abs() >= SINE_MIN * a.length() * b.length()
}

/// A pattern on a plane.
pub(super) struct Pattern<'a> {
    seen: Seen<'a>,
    offsets: Vec<(DVec2, Match)>,
    likeness: f64,
    mean: DVec3,
}

impl<'a> Pattern<'a> {
    /// Finds the pattern of a plane by its colours in the light, `lit`, and their detail; `None` if it has none that
    /// foretells what is seen.
    pub(super) fn of(sheet: &'a Sheet, lit: &[Option<DVec3>], colours: &'a [Option<DVec3>]) -> Option<Self> {
        if Seen::new(sheet, lit, GUESS_CELLS_MAX).roughness() < DEVIATION_MIN * DEVIATION_MIN {
            return None;
        }
        let rough = Seen::new(sheet, colours, GUESS_CELLS_MAX);
        let periods = rough.periods()?;
        let seen = Seen::new(sheet, colours, COMPARED_CELLS_MAX);
        let offsets = seen.matches(periods);
        let likeness = offsets.iter().map(|(_, found)| found.likeness).sum::<f64>() / offsets.len() as f64;
        let halves = [periods[0], periods[1], periods[0] + periods[1]].map(|period| seen.compare(0.5 * period));
        let least = halves.into_iter().flatten().map(|found| found.likeness).fold(f64::INFINITY, f64::min);
        let known: Vec<DVec3> = seen.samples.iter().filter_map(|&index| colours[index]).collect();
        let mean = known.iter().sum::<DVec3>() / known.len() as f64;
        let pattern = Self { seen, offsets, likeness, mean };
        let foretold = pattern.foretold();
        let [first, second] = periods.map(|period| period * sheet.cell);
        tracing::debug!(
            "pattern of label {}: periods {first:.3} and {second:.3}, likeness {likeness:.2} at {} offsets, {least:.2} between \
             them; it foretells {foretold:.2}",
            sheet.label,
            pattern.offsets.len()
        );
        let is_one = pattern.offsets.len() >= OFFSETS_MIN
            && likeness >= LIKENESS_MIN
            && least <= likeness - FALL_MIN
            && foretold >= FORETOLD_MIN;
        is_one.then_some(pattern)
    }

    /// Returns the colours by which it was found.
    pub(super) fn colours(&self) -> &'a [Option<DVec3>] {
        self.seen.colours
    }

    /// Returns its offsets, in cells.
    pub(super) fn offsets(&self) -> impl Iterator<Item = DVec2> {
        self.offsets.iter().map(|&(offset, _)| offset)
    }

    /// Returns the colour at an offset from a cell; `None` if nothing is seen there.
    pub(super) fn seen_at(&self, index: usize, offset: DVec2) -> Option<DVec3> {
        self.seen.colour(self.seen.cell(index) + offset)
    }

    /// Returns the share of the variance of what is seen that is gone without the pattern.
    fn foretold(&self) -> f64 {
        let seen = &self.seen;
        let (mut all, mut left) = (0.0, 0.0);
        for &index in &seen.samples {
            let Some(colour) = seen.colours[index] else { continue };
            let own = colour - self.mean;
            all += own.length_squared();
            left += (own - self.deviation(seen.cell(index))).length_squared();
        }
        if all > 0.0 { 1.0 - left / all } else { 0.0 }
    }

    /// Returns what the pattern adds to the mean colour at a world position: the mean of the middle half of the places
    /// a number of periods away, as far as so many of them can be trusted.
    pub(super) fn at(&self, world: DVec3) -> DVec3 {
        // Cell (0, 0) has its middle half a cell from the corner.
        self.deviation(DVec2::from_array(self.seen.sheet.at(world)) - 0.5)
    }

    fn deviation(&self, at: DVec2) -> DVec3 {
        let there = |(offset, found): &(DVec2, Match)| Some(self.seen.colour(at + *offset)? - found.bias - self.mean);
        let found: Vec<DVec3> = self.offsets.iter().filter_map(there).collect();
        if found.is_empty() {
            return DVec3::ZERO;
        }
        let middle = |axis: usize| {
            let mut values: Vec<f64> = found.iter().map(|colour| colour[axis]).collect();
            values.sort_unstable_by(f64::total_cmp);
            let inner = &values[values.len() / 4..values.len() - values.len() / 4];
            inner.iter().sum::<f64>() / inner.len() as f64
        };
        // The best linear estimate from so many values whose correlation with each other is the likeness (Wiener).
        let (count, likeness) = (found.len() as f64, self.likeness.clamp(0.0, 1.0));
        DVec3::from_array([0, 1, 2].map(middle)) * (count * likeness / (1.0 + (count - 1.0) * likeness))
    }
}
