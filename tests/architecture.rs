//! Floors of modules, lengths of files and places of unsafe code; `clippy.toml` has the rules that a lint can check.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

const REPOSITORY_ROOT: &str = env!("CARGO_MANIFEST_DIR");

/// Columns of the names in the table of floors.
const NAMES: usize = 23;

/// Modules by floor, the lowest first, as `src/guide/inside.md` lists them. A module may use modules of lower floors
/// only; modules of one floor do not use each other.
fn floors() -> &'static [Vec<String>] {
    static FLOORS: LazyLock<Vec<Vec<String>>> = LazyLock::new(|| {
        let text = fs::read_to_string(Path::new(REPOSITORY_ROOT).join("src/guide/inside.md")).expect("inside.md");
        let floors = text.split("## Floors").nth(1).expect("a part about floors");
        let table = floors.split("```text\n").nth(1).and_then(|rest| rest.split("```").next()).expect("a table");
        let names = |line: &str| line.chars().take(NAMES).collect::<String>();
        let words = |line| names(line).split_whitespace().map(str::to_owned).collect::<Vec<_>>();
        let mut floors: Vec<Vec<String>> = table.lines().rev().map(words).collect();
        floors[0].push("lib".to_owned());
        floors.push(vec!["main".to_owned()]);
        floors
    });
    &FLOORS
}

/// Exceptions from the rule: (module, the module above that it may use).
const EXCEPTIONS: [(&str, &str); 1] = [
    // The table of required features is generated from the shaders.
    ("gpu", "shaders"),
];

fn files(folder: &str, extension: &[&str]) -> Vec<(PathBuf, String)> {
    fn walk(folder: &Path, found: &mut Vec<PathBuf>) {
        for entry in fs::read_dir(folder).expect("folder") {
            let path = entry.expect("entry").path();
            // Tests of a crate are not its sources.
            match (path.is_dir(), path.ends_with("tests")) {
                (true, true) => {}
                (true, false) => walk(&path, found),
                (false, _) => found.push(path),
            }
        }
    }
    let mut found = Vec::new();
    walk(&Path::new(REPOSITORY_ROOT).join(folder), &mut found);
    found.retain(|path| path.extension().is_some_and(|found| extension.iter().any(|wanted| found == *wanted)));
    found.sort();
    found.into_iter().map(|path| (path.clone(), fs::read_to_string(path).expect("text"))).collect()
}

/// Top module of a file of `src`.
fn module(path: &Path) -> String {
    let inside = path.strip_prefix(Path::new(REPOSITORY_ROOT).join("src")).expect("in src");
    let first = inside.components().next().expect("a component").as_os_str().to_string_lossy().into_owned();
    first.trim_end_matches(".rs").to_owned()
}

fn floor(module: &str) -> usize {
    let found = floors().iter().position(|modules| modules.iter().any(|name| name == module));
    found.unwrap_or_else(|| panic!("{module} is on no floor of src/guide/inside.md"))
}

/// Modules of this crate that a source file names outside of its unit tests: `crate::name` and `crate::{name, ..}`.
fn used(text: &str) -> Vec<String> {
    let code = text.split("#[cfg(test)]").next().unwrap_or_default();
    let code: String = code.lines().filter(|line| !line.trim_start().starts_with("//")).collect::<Vec<_>>().join("\n");
    let mut names = Vec::new();
    for (at, found) in code.match_indices("crate::") {
        let rest = &code[at + found.len()..];
        let word = |text: &str| text.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect::<String>();
        match rest.strip_prefix('{') {
            Some(list) => {
                let list = &list[..list.find("};").unwrap_or(list.len())];
                let mut depth = 0;
                for part in list.split_inclusive([',', '{', '}']) {
                    if depth == 0 {
                        names.push(word(part.trim_start()));
                    }
                    depth += i32::from(part.ends_with('{')) - i32::from(part.ends_with('}'));
                }
            }
            None => names.push(word(rest)),
        }
    }
    // Upper case: types and macros at the root of the crate.
    names.retain(|name| name.chars().next().is_some_and(char::is_lowercase));
    names
}

#[test]
fn imports_are_found_in_any_form() {
    let text = "use crate::gpu::Gpu;\nuse crate::{Error, Result, plan::{Buf, Limits}, io};\n// crate::cli\ncrate::sched::x();\n\
                #[cfg(test)]\nmod tests { use crate::train::X; }";
    assert_eq!(used(text), ["gpu", "plan", "io", "sched"]);
}

#[test]
fn modules_use_lower_floors_only() {
    let mut breaches = Vec::new();
    for (path, text) in files("src", &["rs"]) {
        let own = module(&path);
        // The compiler checks crates.
        if Path::new(REPOSITORY_ROOT).join("src").join(&own).join("Cargo.toml").exists() {
            continue;
        }
        for other in used(&text) {
            // A macro of the scheduler, which Rust exports at the root.
            let allowed = other == "buffers"
                || other == own
                || floor(&own) > floor(&other)
                || EXCEPTIONS.contains(&(own.as_str(), other.as_str()));
            if !allowed {
                breaches.push(format!("{} uses {other}", path.display()));
            }
        }
    }
    assert_eq!(breaches, Vec::<String>::new());
}

#[test]
fn files_stay_short() {
    let sources = files("src", &["rs"]).into_iter().map(|file| (file, 400));
    let shaders = files("glsl", &["comp", "glsl"]).into_iter().map(|file| (file, 250));
    let page = files("src", &["js", "css", "html"]).into_iter().map(|file| (file, 400));
    let long = sources.chain(shaders).chain(page).filter_map(|((path, text), most)| {
        let lines = text.lines().count();
        (lines > most).then(|| format!("{}: {lines} lines, at most {most}", path.display()))
    });
    assert_eq!(long.collect::<Vec<_>>(), Vec::<String>::new());
}

/// Files that have a word outside of comments and inner attributes.
fn with_word(word: &str) -> Vec<String> {
    let has = |text: &str| {
        let mut lines = text.lines().map(|line| line.split("//").next().unwrap_or_default());
        lines.any(|line| line.contains(word) && !line.trim_start().starts_with("#!["))
    };
    let found = files("src", &["rs"]).into_iter().filter(|(_, text)| has(text));
    let name = |path: PathBuf| path.strip_prefix(REPOSITORY_ROOT).expect("inside").to_string_lossy().into_owned();
    found.map(|(path, _)| name(path)).collect()
}

#[test]
fn unsafe_code_has_three_places() {
    let elsewhere = with_word("unsafe ")
        .into_iter()
        .filter(|file| !file.starts_with("src/gpu/") && file != "src/scheduler/recorder.rs" && file != "src/main.rs");
    assert_eq!(elsewhere.collect::<Vec<_>>(), Vec::<String>::new());
    assert!(with_word("unsafe ").contains(&"src/scheduler/recorder.rs".to_owned()), "the search finds a known place");
}

/// Above the engine, only the modules that verify it use its scheduler.
#[test]
fn the_scheduler_is_the_engines_own() {
    let above = |path: &Path| floor(&module(path)) > floor("engine") && module(path) != "verify";
    let touches =
        |text: &str| [".raw()", ".raw_mut()", "Scheduler::", "ListId", "Ticket"].iter().any(|w| text.contains(w));
    let found = files("src", &["rs"]).into_iter().filter(|(path, text)| above(path) && touches(text));
    assert_eq!(found.map(|(path, _)| path).collect::<Vec<_>>(), Vec::<PathBuf>::new());
}

/// The command line alone knows flags and commands; a message of the library has a [`labelgs::Setting`], or a
/// `Verb`.
#[test]
fn the_library_speaks_of_no_flags() {
    let root = labelgs::cli::command::command();
    let commands: Vec<String> =
        root.get_subcommands().map(|command| format!("labelgs {}", command.get_name())).collect();
    let has_flag = |line: &str| {
        line.match_indices("--").any(|(at, _)| {
            let (before, after) = (line[..at].chars().next_back(), line[at + 2..].chars().next());
            after.is_some_and(|c| c.is_ascii_lowercase()) && before.is_some_and(|c| " \"`({".contains(c))
        })
    };
    assert!(has_flag("say(\"use --near\")") && has_flag("\"--near\"") && !has_flag("a --> b") && !has_flag("x---y"));
    let has_command = |line: &str, name: &str| {
        let mut ends = line.match_indices(name).map(|(at, _)| line[at + name.len()..].chars().next());
        ends.any(|next| !next.is_some_and(|c| c.is_ascii_lowercase()))
    };
    let mut found = Vec::new();
    for (path, text) in files("src", &["rs"]) {
        if ["cli", "main"].contains(&module(&path).as_str()) {
            continue;
        }
        let code = text.split("#[cfg(test)]").next().unwrap_or_default();
        let lines = code.lines().enumerate().filter(|(_, line)| !line.trim_start().starts_with("//"));
        let wrong = lines.filter(|(_, line)| has_flag(line) || commands.iter().any(|name| has_command(line, name)));
        found.extend(wrong.map(|(at, line)| format!("{}:{}: {}", path.display(), at + 1, line.trim())));
    }
    assert_eq!(found, Vec::<String>::new());
}

/// Words of messages that name keys of files or data, although a flag of some command has the same name.
const PLAIN: [&str; 8] = ["camera", "images", "labels", "model", "name", "scene", "size", "view"];

/// A message gets a flag by a [`labelgs::Setting`] only; each of these has a flag somewhere.
#[test]
fn settings_in_messages_are_typed() {
    fn fields(command: &clap::Command, found: &mut std::collections::BTreeSet<String>) {
        found.extend(command.get_arguments().filter_map(|arg| arg.get_long()).map(|long| long.replace('-', "_")));
        command.get_subcommands().for_each(|command| fields(command, found));
    }
    let mut flags = std::collections::BTreeSet::new();
    fields(&labelgs::cli::command::command(), &mut flags);
    flags.extend(labelgs::run::Settings::keys().map(|key| key.name.to_owned()));
    let commands = labelgs::cli::command::command();
    let mut wrong = Vec::new();
    for (path, text) in files("src", &["rs"]) {
        let code = text.split("#[cfg(test)]").next().unwrap_or_default();
        let lines = code.lines().enumerate().filter(|(_, line)| !line.trim_start().starts_with("//"));
        for (at, line) in lines {
            let place = |what: &str| format!("{}:{}: {what}", path.display(), at + 1);
            let typed = line.split("Setting(\"").skip(1).filter_map(|rest| rest.split('"').next());
            wrong.extend(typed.filter(|name| !flags.contains(*name)).map(|name| place(&format!("no flag is {name}"))));
            let verbs = line.split("Verb(\"").skip(1).filter_map(|rest| rest.split('"').next());
            let unknown = verbs.filter(|name| commands.find_subcommand(name).is_none());
            wrong.extend(unknown.map(|name| place(&format!("no command is {name}"))));
            let plain = line.split("usage(\"").skip(1).filter_map(|rest| rest.split('"').next());
            let quoted = line.split('`').skip(1).step_by(2).map(|words| words.split(" = ").next().unwrap_or_default());
            let plain = plain.chain(quoted).filter(|name| flags.contains(*name) && !PLAIN.contains(name));
            wrong.extend(plain.map(|name| place(&format!("{name} is a setting: Setting(\"{name}\")"))));
        }
    }
    assert_eq!(wrong, Vec::<String>::new());
}
