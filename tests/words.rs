//! Words that are not ours, and names that say nothing. `typos` checks the spelling.

use std::fs;
use std::path::{Path, PathBuf};

const REPOSITORY: &str = env!("CARGO_MANIFEST_DIR");

/// What a reader sees, from the root.
const READ_PATHS: [&str; 7] = ["README.md", ".github", "src", "glsl", "tools", "tests/README.md", "build.rs"];
/// Extensions of files with text.
const TEXT_EXTENSIONS: [&str; 8] = ["md", "rs", "comp", "glsl", "js", "html", "css", "yml"];
/// Names of one word that the field uses for exactly this.
const FIELD_TERMS: &[&str] = &[
    "BOM",
    "COEFFICIENTS",
    "COLMAP",
    "EPSILON",
    "FFMPEG",
    "FFPROBE",
    "HEADER",
    "HELP",
    "IDENTITY",
    "LICENCE",
    "MAGIC",
    "NAME",
    "NAMES",
    "ON",
    "PI",
    "SEED",
    "SPZ",
    "UNLABELLED",
    "VERSION",
];

/// All text files below a path.
fn texts(path: &Path, found: &mut Vec<(PathBuf, String)>) {
    if path.is_dir() {
        let mut entries: Vec<PathBuf> =
            fs::read_dir(path).expect("a folder").flatten().map(|entry| entry.path()).collect();
        entries.sort();
        entries.iter().for_each(|entry| texts(entry, found));
    } else if path.extension().is_some_and(|found| TEXT_EXTENSIONS.iter().any(|known| found == *known)) {
        found.push((path.to_owned(), fs::read_to_string(path).expect("text")));
    }
}

/// Words in small letters with their lines. Marks of comments are no words, so that a phrase may go over the end of a
/// line.
fn words(text: &str) -> Vec<(String, usize)> {
    let split = |line: &str| -> Vec<String> {
        // What dots or colons join is code, and no phrase goes on after a mark.
        let ends = |word: &str| word.ends_with([',', ';', '.', ')', ':']);
        let words = line.split_whitespace().flat_map(|word| {
            let trimmed = word.trim_matches(|c: char| !c.is_alphanumeric()).to_lowercase();
            [trimmed, if ends(word) { "|".to_owned() } else { String::new() }]
        });
        words.filter(|word| !word.is_empty()).collect()
    };
    text.lines().enumerate().flat_map(|(at, line)| split(line).into_iter().map(move |word| (word, at + 1))).collect()
}

/// A page without code.
fn prose(page: &str) -> String {
    let mut is_code = false;
    let lines = page.lines().map(|line| {
        let is_fence = line.trim_start().starts_with("```");
        is_code ^= is_fence;
        let outside: String = line.split('`').step_by(2).collect::<Vec<_>>().join(" | ");
        if is_code || is_fence { String::new() } else { outside }
    });
    lines.collect::<Vec<_>>().join("\n")
}

/// The phrases of a part of the list, each with what to say instead.
fn banned(part: &str) -> Vec<(Vec<String>, String)> {
    let list = fs::read_to_string(Path::new(REPOSITORY).join("tests/words.txt")).expect("the list");
    let lines = list
        .split(&format!("\n[{part}]\n"))
        .nth(1)
        .expect("the part")
        .lines()
        .take_while(|line| !line.starts_with('['));
    let rows = lines.filter(|line| !line.is_empty()).map(|line| line.split_once(" = ").expect("PHRASE = BETTER"));
    rows.map(|(phrase, better)| (words(phrase).into_iter().map(|(word, _)| word).collect(), better.to_owned()))
        .collect()
}

/// Places of the phrases in a text.
fn places(path: &Path, text: &str, banned: &[(Vec<String>, String)]) -> Vec<String> {
    let words = words(text);
    let find = |(phrase, better): &(Vec<String>, String)| -> Vec<String> {
        let hits = words.windows(phrase.len()).filter(|found| found.iter().map(|(word, _)| word).eq(phrase));
        let name = path.strip_prefix(REPOSITORY).unwrap_or(path).display();
        hits.map(|hit| format!("{name}:{}: \"{}\"; say {better}", hit[0].1, phrase.join(" "))).collect()
    };
    banned.iter().flat_map(find).collect()
}

#[test]
fn a_phrase_is_found_across_lines_and_not_in_code() {
    let phrase = [(vec!["broken".to_owned(), "off".to_owned()], "interrupted".to_owned())];
    let comment = "/// A run that was Broken\n/// off, and goes";
    assert_eq!(places(Path::new("a.rs"), comment, &phrase), ["a.rs:1: \"broken off\"; say interrupted"]);
    assert!(places(Path::new("a.rs"), "broken.off_set", &phrase).is_empty());
    assert_eq!(prose("a `b c` d\n```sh\ne\n```\nf"), "a  |  d\n\n\n\nf");
}

#[test]
fn texts_say_what_readers_know() {
    let mut found = Vec::new();
    READ_PATHS.iter().for_each(|path| texts(&Path::new(REPOSITORY).join(path), &mut found));
    let [everywhere, pages] = ["text", "pages"].map(banned);
    let mut wrong: Vec<String> = found.iter().flat_map(|(path, text)| places(path, text, &everywhere)).collect();
    let is_page =
        |path: &Path| path.ends_with("README.md") || path.starts_with(Path::new(REPOSITORY).join("src/guide"));
    for (path, text) in found.iter().filter(|(path, _)| is_page(path) && path.extension().is_some_and(|e| e == "md")) {
        wrong.extend(places(path, &prose(text), &pages));
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn constants_say_what_they_bound() {
    let mut found = Vec::new();
    texts(&Path::new(REPOSITORY).join("src"), &mut found);
    let mut short = Vec::new();
    for (path, text) in found.iter().filter(|(path, _)| path.extension().is_some_and(|found| found == "rs")) {
        // Tests of a crate may be terse.
        if path.components().any(|part| part.as_os_str() == "tests") {
            continue;
        }
        for line in text.lines().filter(|line| line.starts_with("const ") || line.starts_with("pub")) {
            let Some(name) = line.split("const ").nth(1).and_then(|rest| rest.split(':').next()) else { continue };
            let is_word = name.len() > 1 && name.chars().all(|c| c.is_ascii_uppercase());
            if is_word && !FIELD_TERMS.contains(&name) {
                short.push(format!("{}: {name}", path.strip_prefix(REPOSITORY).unwrap_or(path).display()));
            }
        }
    }
    assert!(short.is_empty(), "one word says nothing of a constant:\n{}", short.join("\n"));
}
