//! Numbers, sizes and times as text: one style for all pages.

/// Text for a missing number.
const MISSING_NUMBER: &str = "–";

/// Returns a number with a fixed count of digits, or a dash.
pub fn number(value: Option<f64>, digits: usize) -> String {
    value.filter(|value| value.is_finite()).map_or(MISSING_NUMBER.to_owned(), |value| format!("{value:.digits$}"))
}

/// Digits of decibels.
pub const DECIBEL_DIGITS: usize = 2;
/// Digits of scores from 0 to 1: SSIM, IoU, confidence.
pub const SCORE_DIGITS: usize = 3;

/// Returns a number with three significant digits, and no more than three after the point from 1 on.
pub fn significant(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let digits = (2 - value.abs().log10().floor() as i32).max(0) as usize;
    if value.abs() < 1e-4 { format!("{value:.2e}") } else { format!("{value:.digits$}") }
}

/// Returns a count with commas between thousands.
pub fn count(value: u64) -> String {
    let digits = value.to_string();
    let mut text = String::new();
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// Returns bytes as MiB or GiB.
pub fn bytes(value: u64) -> String {
    let mib = value as f64 / f64::from(1 << 20);
    if mib < 1024.0 { format!("{mib:.1} MiB") } else { format!("{:.2} GiB", mib / 1024.0) }
}

/// Returns seconds as seconds, minutes or hours.
pub fn duration(seconds: f64) -> String {
    let whole = seconds.round().max(0.0) as u64;
    match whole {
        0..120 => format!("{seconds:.1} s"),
        120..7200 => format!("{} min {:02} s", whole / 60, whole % 60),
        _ => format!("{} h {:02} min", whole / 3600, whole % 3600 / 60),
    }
}

/// Returns a time since 1970, s, as date and time in UTC.
pub fn utc(seconds: u64) -> String {
    let (days, rest) = (seconds / 86_400, seconds % 86_400);
    // Years begin in March here, so that the day that may be missing is the last one.
    let shifted = days + 719_468;
    let (era, of_era) = (shifted / 146_097, shifted % 146_097);
    let year_of_era = (of_era - of_era / 1460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let from_march = (5 * of_year + 2) / 153;
    let day = of_year - (153 * from_march + 2) / 5 + 1;
    let month = if from_march < 10 { from_march + 3 } else { from_march - 9 };
    let year = year_of_era + era * 400 + u64::from(month <= 2);
    format!("{year}-{month:02}-{day:02} {:02}:{:02} UTC", rest / 3600, rest % 3600 / 60)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_well() {
        assert_eq!(
            (number(Some(1.25), 1), number(None, 2), number(Some(f64::NAN), 2)),
            ("1.2".into(), "–".into(), "–".into())
        );
        assert_eq!((count(0), count(999), count(1_234_567)), ("0".into(), "999".into(), "1,234,567".into()));
        let texts = [0.0, 1.5e-5, 0.012_345, 0.123_45, 1.2345, 123.45, 12_345.6].map(significant);
        assert_eq!(texts, ["0", "1.50e-5", "0.0123", "0.123", "1.23", "123", "12346"]);
        assert_eq!((bytes(3 << 20), bytes(3 << 29)), ("3.0 MiB".into(), "1.50 GiB".into()));
        assert_eq!(
            (duration(9.04), duration(125.2), duration(7260.0)),
            ("9.0 s".into(), "2 min 05 s".into(), "2 h 01 min".into())
        );
    }

    #[test]
    fn dates_follow_the_calendar() {
        for (seconds, text) in [
            (0, "1970-01-01 00:00 UTC"),
            (951_782_399, "2000-02-28 23:59 UTC"),
            (951_782_400, "2000-02-29 00:00 UTC"),
            (1_709_251_199, "2024-02-29 23:59 UTC"),
            (1_735_689_600, "2025-01-01 00:00 UTC"),
        ] {
            assert_eq!(utc(seconds), text);
        }
    }
}
