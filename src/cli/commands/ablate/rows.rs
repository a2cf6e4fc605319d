//! The variants of an ablation.

use crate::{Error, Result};

/// Which masks a variant trains with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Masks {
    /// None: plain 3D Gaussian Splatting.
    None,
    /// `--masks`.
    Given,
    /// `--masks-without-dov`: tracked on the photos alone.
    WithoutDov,
}

/// A variant.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Row {
    /// Name, also of its folder.
    pub name: String,
    /// Masks.
    pub masks: Masks,
    /// Flags of `labelgs train`.
    pub flags: Vec<String>,
}

/// Name, masks and flags of the known variants, in the order of the table.
const KNOWN_VARIANTS: [(&str, Masks, &[&str]); 8] = [
    ("no-labels", Masks::None, &[]),
    ("paper", Masks::Given, &["--preset", "paper"]),
    ("paper-no-dov", Masks::WithoutDov, &["--preset", "paper"]),
    ("paper-no-gpf", Masks::Given, &["--preset", "paper", "--set", "gpf=off"]),
    ("paper-no-oam", Masks::Given, &["--preset", "paper", "--set", "occlusion=none"]),
    ("paper-votes", Masks::Given, &["--preset", "paper", "--set", "label_rule=votes"]),
    ("ours", Masks::Given, &[]),
    ("ours-no-oam", Masks::Given, &["--set", "occlusion=none"]),
];

/// Returns the variants of `names`, then those of `own`, each `NAME=FLAGS`. Without both, returns all that can run.
pub(super) fn rows(names: &[String], own: &[String], has_without_dov: bool) -> Result<Vec<Row>> {
    let known = |&(name, masks, flags): &(&str, Masks, &[&str])| Row {
        name: name.to_owned(),
        masks,
        flags: flags.iter().map(|&flag| flag.to_owned()).collect(),
    };
    let mut rows: Vec<Row> = Vec::new();
    for name in names {
        let Some(row) = KNOWN_VARIANTS.iter().find(|row| row.0 == name) else {
            let all: Vec<&str> = KNOWN_VARIANTS.iter().map(|row| row.0).collect();
            return Err(Error::usage("--rows", format!("no variant is called {name}; known are {}", all.join(", "))));
        };
        rows.push(known(row));
    }
    if names.is_empty() && own.is_empty() {
        rows.extend(KNOWN_VARIANTS.iter().filter(|row| has_without_dov || row.1 != Masks::WithoutDov).map(known));
    }
    if !has_without_dov && let Some(row) = rows.iter().find(|row| row.masks == Masks::WithoutDov) {
        return Err(Error::usage("--rows", format!("{} needs --masks-without-dov DIR", row.name)));
    }
    for text in own {
        let wrong = || {
            Error::usage(
                "--row",
                format!(
                    "`{text}` is not a variant; expected NAME=FLAGS, such as \
                                                      t03=--preset paper --set label_threshold=0.3"
                ),
            )
        };
        let (name, flags) = text.split_once('=').ok_or_else(wrong)?;
        let usable = !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || "-_.".contains(c));
        if !usable || name.starts_with('.') || rows.iter().any(|row| row.name == name) {
            return Err(wrong());
        }
        let flags = flags.split_whitespace().map(str::to_owned).collect();
        rows.push(Row { name: name.to_owned(), masks: Masks::Given, flags });
    }
    Ok(rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn variants_are_chosen_by_name_and_made_from_flags() {
        let names = |rows: &[Row]| rows.iter().map(|row| row.name.clone()).collect::<Vec<_>>();
        let all = rows(&[], &[], false).expect("rows");
        assert!(names(&all).contains(&"ours".to_owned()) && !names(&all).contains(&"paper-no-dov".to_owned()));
        assert_eq!(rows(&[], &[], true).expect("rows").len(), KNOWN_VARIANTS.len());
        let own =
            rows(&["ours".into()], &["t03=--preset paper --set label_threshold=0.3".into()], false).expect("rows");
        assert_eq!(names(&own), ["ours", "t03"]);
        assert_eq!(own[1].flags, ["--preset", "paper", "--set", "label_threshold=0.3"]);
        for (name, own) in [("theirs", ""), ("paper-no-dov", ""), ("", "=x"), ("", "../x=--y"), ("ours", "ours=--z")] {
            let list = |text: &str| if text.is_empty() { vec![] } else { vec![text.to_owned()] };
            let error = rows(&list(name), &list(own), false).expect_err("refused");
            assert!(matches!(error, Error::Usage { .. }), "{name} {own}");
        }
    }
}
