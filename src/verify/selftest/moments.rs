//! Compares packed Adam moments with the reference, word by word.

use super::Judge;
use super::compare::{Summary, Tolerance, Verdict, close};
use super::fixture::{Fixture, MOMENTS_1, MOMENTS_2, PARAMETER_PLANES, PLANE_LAYOUT};
use super::judge;
use super::model::rates_of;
use super::scenes::Scene;
use super::update::partly_frozen;
use crate::error::Result;
use crate::reference::adam::{AdamState, Rates};
use crate::reference::densify::Population;
use crate::reference::model::ROW_FLOATS;
use crate::reference::moments::{draw, pack, unpack};
use crate::reference::{Group, Row, Rules, adam, lazy};

/// Attribute planes: the draws for catching up follow the draws of a step's planes.
const ATTRIBUTE_PLANES: u32 = 7;
/// Smallest share of words that must equal the reference exactly: a logarithm is off by up to 2^-12 of a step.
const EQUAL_SHARE_MIN: f64 = 0.97;

/// The location of a parameter on the device.
struct ParameterSlot {
    plane: usize,
    /// Floats of a row of the plane.
    floats: usize,
    /// Index in that row, and among the floats of a Gaussian.
    offset: usize,
    at: usize,
}

impl ParameterSlot {
    fn every() -> impl Iterator<Item = Self> {
        PLANE_LAYOUT.into_iter().enumerate().flat_map(|(plane, (floats, runs))| {
            runs.iter().flat_map(move |&(from, to, length)| {
                (0..length).map(move |i| Self { plane, floats, offset: from + i, at: to + i })
            })
        })
    }

    /// Returns the draw of its word in a step with this seed; with `late`, the draw for catching up.
    fn draw(&self, seed: u32, row: usize, late: bool) -> u32 {
        let element = row * (self.floats / 4) + self.offset / 4;
        let plane = self.plane as u32 + if late { ATTRIBUTE_PLANES } else { 0 };
        draw(seed, element as u32, plane, self.offset as u32 % 4)
    }
}

/// Unpacks the moments of words.
fn unpacked(rules: &Rules, words: &[u32; ROW_FLOATS]) -> [Row; 2] {
    let both = words.map(|word| unpack(rules, word));
    [Row::from_floats(&both.map(|(m, _)| m)), Row::from_floats(&both.map(|(_, u)| u))]
}

/// Packs moments into words, rounded to nearest.
fn words_of(m: &Row, u: &Row) -> [u32; ROW_FLOATS] {
    let (m, u) = (m.floats(), u.floats());
    std::array::from_fn(|at| pack(&Rules::default(), (m[at], u[at]), 0x7fff_7fff))
}

/// Rounds the moments of a population to values that words represent.
pub fn round(population: &mut Population) {
    for (m, u) in population.m.iter_mut().zip(&mut population.u) {
        [*m, *u] = unpacked(&Rules::default(), &words_of(m, u));
    }
}

impl Fixture {
    /// Words of packed moments of `count` Gaussians.
    fn words(&mut self, count: usize) -> Result<Vec<[u32; ROW_FLOATS]>> {
        let mut words = vec![[0; ROW_FLOATS]; count];
        let planes =
            MOMENTS_1.into_iter().zip(PLANE_LAYOUT).map(|(plane, (floats, _))| self.get(plane, count * floats));
        let planes = planes.collect::<Result<Vec<Vec<u32>>>>()?;
        for place in ParameterSlot::every() {
            let of_row = planes[place.plane].chunks_exact(place.floats);
            words.iter_mut().zip(of_row).for_each(|(row, all)| row[place.at] = all[place.offset]);
        }
        Ok(words)
    }

    /// Both moments of `count` Gaussians.
    pub(super) fn moments(&mut self, count: usize) -> Result<[Vec<Row>; 2]> {
        if !self.engine.size().half_moments {
            return Ok([self.rows(MOMENTS_1, count)?, self.rows(MOMENTS_2, count)?]);
        }
        let both = self.words(count)?.into_iter().map(|words| unpacked(&Rules::default(), &words).into());
        let (m, u) = both.collect::<Vec<(Row, Row)>>().into_iter().unzip();
        Ok([m, u])
    }

    /// Writes both moments; rows must hold f32 values.
    pub(super) fn put_moments(&mut self, m: &[Row], u: &[Row]) -> Result<()> {
        if !self.engine.size().half_moments {
            self.put_rows(MOMENTS_1, m)?;
            return self.put_rows(MOMENTS_2, u);
        }
        let words: Vec<[u32; ROW_FLOATS]> = m.iter().zip(u).map(|(m, u)| words_of(m, u)).collect();
        for (index, (plane, (floats, _))) in MOMENTS_1.into_iter().zip(PLANE_LAYOUT).enumerate() {
            let mut of_plane = vec![0; words.len() * floats];
            for place in ParameterSlot::every().filter(|place| place.plane == index) {
                let rows = of_plane.chunks_exact_mut(floats).zip(&words);
                rows.for_each(|(row, words)| row[place.offset] = words[place.at]);
            }
            self.engine.raw_mut().upload(plane, 0, 0, &of_plane)?;
        }
        Ok(())
    }
}

/// A scene that is half outside of the view, so that some Gaussians miss updates.
pub fn away(seed: u64) -> Scene {
    let mut scene = partly_frozen(seed);
    scene.camera.cx -= 40.0;
    scene
}

/// Parameters, and the words of their moments.
struct MomentState {
    rows: Vec<Row>,
    words: Vec<[u32; ROW_FLOATS]>,
}

impl MomentState {
    /// Reads the state of `count` Gaussians.
    fn read(fixture: &mut Fixture, count: usize) -> Result<Self> {
        Ok(Self { rows: fixture.rows(PARAMETER_PLANES, count)?, words: fixture.words(count)? })
    }

    /// Returns a Gaussian with its moments.
    fn optimised(&self, rules: &Rules, row: usize) -> AdamState {
        let [m, u] = unpacked(rules, &self.words[row]);
        AdamState { row: self.rows[row], m, u }
    }
}

/// A step between two states.
struct StepChange {
    step: u32,
    seed: u32,
    rates: Rates,
    gradients: Vec<Row>,
    states: [MomentState; 2],
}

/// Runs steps with packed moments. With `split`, which provides gradients of the same model, Gaussians may miss
/// updates; in the end all catch up.
pub fn packed(fixture: &mut Fixture, mut split: Option<&mut Fixture>) -> Result<Judge> {
    let count = fixture.scene.gaussians.len() - fixture.scene.frozen as usize;
    let all = fixture.scene.gaussians.len();
    let is_late = split.is_some();
    let mut done = Vec::new();
    fixture.input.update = true;
    for step in 1..=4 {
        (fixture.input.step, fixture.input.updates) = (step, step);
        let before = MomentState::read(fixture, count)?;
        let gradients = match &mut split {
            Some(split) => {
                (split.input.step, split.input.updates) = (step, step);
                let rows = fixture.rows(PARAMETER_PLANES, all)?;
                split.put_rows(PARAMETER_PLANES, &rows)?;
                split.train()?;
                fixture.train()?;
                fixture.engine.catch_up()?;
                split.gradient_rows()?
            }
            None => {
                fixture.train()?;
                fixture.gradient_rows()?
            }
        };
        let (seed, states) = (fixture.uniforms().seed, [before, MomentState::read(fixture, count)?]);
        done.push(StepChange { step, seed, rates: rates_of(fixture), gradients, states });
    }
    Ok(Box::new(move |rules: &Rules| judge::combine(done.iter().map(|step| step.judge(rules, is_late)))))
}

impl StepChange {
    /// Returns a Gaussian after the step, the seed of its draws, and whether it was late.
    fn expected(&self, rules: &Rules, row: usize, is_late: bool) -> (AdamState, u32, bool) {
        let (state, gradient) = (self.states[0].optimised(rules, row), &self.gradients[row]);
        if is_late && *gradient == Row::default() {
            let missed = [lazy::corrected(rules, &self.rates, self.step)];
            // The catch-up list draws by the number of updates.
            (lazy::caught_up(rules, &missed, &state), self.step, true)
        } else {
            (adam::adam(rules, &self.rates, self.step, &state, gradient), self.seed, false)
        }
    }

    fn judge(&self, rules: &Rules, is_late: bool) -> Verdict {
        let [before, after] = &self.states;
        let (mut errors, mut equal, mut words, mut late) = (Vec::new(), 0, 0, 0);
        for row in 0..before.rows.len() {
            let (expected, seed, was_late) = self.expected(rules, row, is_late);
            late += usize::from(was_late);
            let [values, first, second] = [expected.row, expected.m, expected.u].map(|row| row.floats());
            let found = after.rows[row].floats();
            let mut rates = [0.0; ROW_FLOATS];
            Group::ALL.into_iter().zip(self.rates.0).for_each(|(g, rate)| rates[g.range()].fill(rate));
            for place in ParameterSlot::every() {
                let at = place.at;
                let word = pack(rules, (first[at], second[at]), place.draw(seed, row, was_late));
                let (m, u) = unpack(rules, after.words[row][at]);
                let root = second[at].sqrt();
                // One quantisation step of the root, of v, and of the ratio.
                let units = [
                    1e-7 * values[at].abs() + 1e-5 * rates[at],
                    7e-4 * first[at].abs() + 5e-4 * root,
                    1.4e-3 * second[at],
                ];
                let off = [found[at] - values[at], m - first[at], u - second[at]];
                // The smallest root that a word represents, and zero moments.
                errors.extend(off.into_iter().zip(units).map(|(off, unit)| off / (unit + 1e-15)));
                words += usize::from(word != 0);
                equal += usize::from(word != 0 && word == after.words[row][at]);
            }
        }
        let share = f64::from(equal as u32) / f64::from(words.max(1) as u32);
        if share < EQUAL_SHARE_MIN || words == 0 || (is_late && late == 0) {
            return Err(format!("{share:.4} of {words} words equal the reference, {late} Gaussians were late"));
        }
        let worst = close(&errors, &vec![0.0; errors.len()], Tolerance { absolute: 1.0, relative: 0.0 })?;
        Ok(Summary { whole: (1.0 - share) / (1.0 - EQUAL_SHARE_MIN), ..worst })
    }
}
