//! Axes with round ticks.

use super::text::count;

/// The scale of an axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scale {
    /// In proportion.
    #[default]
    Linear,
    /// In proportion, from 0 on.
    FromZero,
    /// By their logarithm. Values that are not positive have no place.
    Logarithmic,
}

/// The range of an axis, and its ticks.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// Value at the start.
    pub low: f64,
    /// Value at the end.
    pub high: f64,
    /// Values of the ticks.
    pub ticks: Vec<f64>,
    digits: usize,
    is_logarithmic: bool,
}

impl Axis {
    /// Makes an axis for values from `low` to `high`. A rounded axis ends at ticks.
    pub fn new(low: f64, high: f64, is_rounded: bool) -> Self {
        const TICKS: f64 = 5.0;
        // A constant needs some room, also beside large numbers.
        let room = (high - low).max(1e-9 * low.abs().max(high.abs())).max(1e-12);
        let (low, high) = if high - low < room { (low - room, high + room) } else { (low, high) };
        let rough = (high - low) / TICKS;
        let power = 10_f64.powf(rough.log10().floor());
        let step = [1.0, 2.0, 5.0, 10.0].into_iter().find(|factor| factor * power >= rough).unwrap_or(10.0) * power;
        let (first, last) = ((low / step - 1e-9).ceil() as i64, (high / step + 1e-9).floor() as i64);
        let (first, last) = if is_rounded {
            ((low / step + 1e-9).floor() as i64, (high / step - 1e-9).ceil() as i64)
        } else {
            (first, last)
        };
        let ticks: Vec<f64> = (first..=last).map(|tick| tick as f64 * step).collect();
        // A tick may lie beside its round number by a rounding error, and the values have to be on the axis.
        let (low, high) =
            if is_rounded { (low.min(first as f64 * step), high.max(last as f64 * step)) } else { (low, high) };
        let digits = (-step.log10().floor()).clamp(0.0, 12.0) as usize;
        Self { low, high, ticks, digits, is_logarithmic: false }
    }

    /// Makes a logarithmic axis for positive values from `low` to `high`, which ends at ticks: powers of ten, and where
    /// these are few also twice and five times those.
    pub fn logarithmic(low: f64, high: f64) -> Self {
        const DECADES: i32 = 2;
        let low = low.max(f64::MIN_POSITIVE);
        let decade = |value: f64| value.log10().floor() as i32;
        let (first, last) = (decade(low), decade(high.max(low)));
        let factors: &[f64] = if last - first < DECADES { &[1.0, 2.0, 5.0] } else { &[1.0] };
        // By division below one: 2 / 1000 is the nearest number to 0.002, and 2 times a power is not.
        let tick = |power: i32, factor: f64| {
            if power < 0 { factor / 10_f64.powi(-power) } else { factor * 10_f64.powi(power) }
        };
        let all: Vec<f64> = (first..=last + 1).flat_map(|power| factors.iter().map(move |&f| tick(power, f))).collect();
        let start = all.iter().rposition(|&tick| tick <= low).unwrap_or(0);
        let end = all.iter().position(|&tick| tick >= high && tick > all[start]).unwrap_or(all.len() - 1);
        let ticks = all[start..=end].to_vec();
        Self { low: low.min(ticks[0]), high: high.max(ticks[ticks.len() - 1]), ticks, digits: 0, is_logarithmic: true }
    }

    /// Returns the place of a value: 0 at the start, 1 at the end.
    pub fn place(&self, value: f64) -> f64 {
        let of = |value: f64| if self.is_logarithmic { value.max(f64::MIN_POSITIVE).ln() } else { value };
        (of(value) - of(self.low)) / (of(self.high) - of(self.low))
    }

    /// Returns the text of a tick, with the digits that tell ticks apart.
    pub fn text(&self, tick: f64) -> String {
        let size = tick.abs();
        if self.is_logarithmic {
            return if (1e-4..1e6).contains(&size) { format!("{tick}") } else { format!("{tick:e}") };
        }
        if size >= 1e6 && self.digits == 0 {
            let text = format!("{:.2}", tick / 1e6);
            return format!("{}M", text.trim_end_matches('0').trim_end_matches('.'));
        }
        if size >= 1e3 && self.digits == 0 {
            let sign = if tick < 0.0 { "-" } else { "" };
            return format!("{sign}{}", count(size.round() as u64));
        }
        let digits = self.digits;
        format!("{:.digits$}", if size == 0.0 { 0.0 } else { tick })
    }
}

#[cfg(test)]
mod tests {
    use super::Axis;

    fn texts(axis: &Axis) -> Vec<String> {
        axis.ticks.iter().map(|&tick| axis.text(tick)).collect()
    }

    #[test]
    fn ticks_are_round_and_few() {
        for (low, high) in [(0.0, 1.0), (0.031, 0.27), (1.0, 30_000.0), (-3.0, 17.0), (27.99, 28.01), (0.0, 1e-7)] {
            for is_rounded in [false, true] {
                let axis = Axis::new(low, high, is_rounded);
                assert!((2..=8).contains(&axis.ticks.len()), "{axis:?}");
                assert!(axis.low <= low && axis.high >= high, "{axis:?}");
                let apart: std::collections::BTreeSet<String> = texts(&axis).into_iter().collect();
                assert_eq!(apart.len(), axis.ticks.len(), "{apart:?}");
            }
        }
        let axis = Axis::new(0.031, 0.27, true);
        assert_eq!(texts(&axis), ["0.00", "0.05", "0.10", "0.15", "0.20", "0.25", "0.30"]);
        assert_eq!(Axis::new(0.0, 30_000.0, false).text(30_000.0), "30,000");
        assert_eq!(Axis::new(0.0, 3e6, false).text(2.5e6), "2.5M");
    }

    #[test]
    fn a_logarithmic_axis_has_powers_of_ten() {
        assert_eq!(texts(&Axis::logarithmic(0.003, 0.4)), ["0.001", "0.01", "0.1", "1"]);
        assert_eq!(texts(&Axis::logarithmic(0.011, 0.13)), ["0.01", "0.02", "0.05", "0.1", "0.2"]);
        assert_eq!(texts(&Axis::logarithmic(0.02, 0.02)), ["0.02", "0.05"]);
        let axis = Axis::logarithmic(1e-7, 1e3);
        assert!((axis.place(1e-2) - 0.5).abs() < 1e-12 && axis.ticks.len() == 11, "{axis:?}");
        assert!(axis.place(0.0).is_finite());
    }

    #[test]
    fn a_constant_has_an_axis() {
        for value in [0.0, 1.0, 1e9, -5.0] {
            let axis = Axis::new(value, value, true);
            assert!(axis.low < axis.high && !axis.ticks.is_empty() && axis.place(value).is_finite(), "{axis:?}");
        }
    }
}
