//! Wording of messages: counts, and suggestions for misspelt names.

use serde::Serialize;
use std::collections::BTreeSet;

/// Most suggestions for a misspelt name.
const OFFERED_MAX: usize = 3;
/// Smallest similarity of a suggestion, 0 to 1.
const SIMILARITY_MIN: f64 = 0.75;

/// Returns a count with its noun: `1 object`, `8 objects`.
pub fn counted(count: impl std::fmt::Display, noun: &str) -> String {
    let count = count.to_string();
    let ending = if count == "1" { "" } else { "s" };
    format!("{count} {noun}{ending}")
}

/// Formats a count in at most five characters: `9120`, `16.8k`, `1.69M`.
pub fn brief(count: u64) -> String {
    let scaled = |unit: f64, letter: &str| {
        let value = count as f64 / unit;
        // One digit less for each before the point.
        let digits = if value >= 99.95 { 0 } else { usize::from(value < 9.995) + 1 };
        format!("{value:.digits$}{letter}")
    };
    match count {
        0..10_000 => count.to_string(),
        10_000..999_500 => scaled(1e3, "k"),
        999_500..999_500_000 => scaled(1e6, "M"),
        _ => scaled(1e9, "G"),
    }
}

/// Returns `name`, with `gap` and the first number appended that make it differ from the names in `taken`, and adds it
/// there.
pub fn unique(name: String, gap: &str, taken: &mut BTreeSet<String>) -> String {
    let numbered = (2..).map(|number| format!("{name}{gap}{number}"));
    let free = std::iter::once(name.clone()).chain(numbered).find(|name| !taken.contains(name)).unwrap_or(name);
    taken.insert(free.clone());
    free
}

/// Returns the serialised name of a variant without content.
pub fn name_of(variant: &impl Serialize) -> String {
    toml::Value::try_from(variant).ok().and_then(|value| value.as_str().map(str::to_owned)).unwrap_or_default()
}

/// Returns `did you mean barrel?` with the known names most similar to `name`; `None` if none is similar.
pub fn did_you_mean<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<String> {
    let typed = name.to_lowercase();
    let similarity = |known: &str| strsim::jaro_winkler(&typed, &known.to_lowercase());
    let rated = known.into_iter().map(|known| (similarity(known), known));
    let mut rated: Vec<(f64, &str)> = rated.filter(|(similarity, _)| *similarity >= SIMILARITY_MIN).collect();
    rated.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(b.1)));
    let names: Vec<&str> = rated.into_iter().map(|(_, name)| name).take(OFFERED_MAX).collect();
    (!names.is_empty()).then(|| format!("did you mean {}?", names.join(" or ")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_thing_is_singular() {
        assert_eq!([0_u32, 1, 2].map(|count| counted(count, "object")), ["0 objects", "1 object", "2 objects"]);
    }

    #[test]
    fn a_brief_count_has_three_digits() {
        let counts =
            [0, 9120, 16_786, 99_960, 123_456, 999_499, 999_500, 1_687_860, 99_960_000, 250_000_000, 2_500_000_000];
        let texts = ["0", "9120", "16.8k", "100k", "123k", "999k", "1.00M", "1.69M", "100M", "250M", "2.50G"];
        assert_eq!(counts.map(brief), texts);
    }

    #[test]
    fn the_nearest_names_are_offered() {
        let known = ["barrel", "basket", "cup", "red table", "barrels"];
        let offered = |name| did_you_mean(name, known);
        assert_eq!(offered("barell").as_deref(), Some("did you mean barrel or barrels?"));
        assert_eq!(offered("CUPS").as_deref(), Some("did you mean cup?"));
        assert_eq!(offered("red tabel").as_deref(), Some("did you mean red table?"));
        assert_eq!(offered("xyz"), None);
    }
}
