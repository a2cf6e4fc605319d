//! Axes with round ticks.

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
        Self { low, high, ticks, digits }
    }

    /// Returns the place of a value: 0 at the start, 1 at the end.
    pub fn place(&self, value: f64) -> f64 {
        (value - self.low) / (self.high - self.low)
    }

    /// Returns the text of a tick, with the digits that tell ticks apart.
    pub fn text(&self, tick: f64) -> String {
        let size = tick.abs();
        let short = |value: f64, unit: &str| {
            let text = format!("{value:.2}");
            format!("{}{unit}", text.trim_end_matches('0').trim_end_matches('.'))
        };
        if size >= 1e6 && self.digits == 0 {
            short(tick / 1e6, "M")
        } else if size >= 1e4 && self.digits == 0 {
            short(tick / 1e3, "k")
        } else {
            let digits = self.digits;
            format!("{:.digits$}", if size == 0.0 { 0.0 } else { tick })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Axis;

    #[test]
    fn ticks_are_round_and_few() {
        for (low, high) in [(0.0, 1.0), (0.031, 0.27), (1.0, 30_000.0), (-3.0, 17.0), (27.99, 28.01), (0.0, 1e-7)] {
            for is_rounded in [false, true] {
                let axis = Axis::new(low, high, is_rounded);
                assert!((2..=8).contains(&axis.ticks.len()), "{axis:?}");
                assert!(axis.low <= low && axis.high >= high, "{axis:?}");
                let texts: std::collections::BTreeSet<String> =
                    axis.ticks.iter().map(|&tick| axis.text(tick)).collect();
                assert_eq!(texts.len(), axis.ticks.len(), "{texts:?}");
            }
        }
        let axis = Axis::new(0.031, 0.27, true);
        assert_eq!(
            axis.ticks.iter().map(|&tick| axis.text(tick)).collect::<Vec<_>>(),
            ["0.00", "0.05", "0.10", "0.15", "0.20", "0.25", "0.30"]
        );
        assert_eq!(Axis::new(0.0, 30_000.0, false).text(30_000.0), "30k");
    }

    #[test]
    fn a_constant_has_an_axis() {
        for value in [0.0, 1.0, 1e9, -5.0] {
            let axis = Axis::new(value, value, true);
            assert!(axis.low < axis.high && !axis.ticks.is_empty() && axis.place(value).is_finite(), "{axis:?}");
        }
    }
}
