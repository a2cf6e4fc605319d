//! What packages hold besides the program, made from its flags and commands; the version that the program tells.

#[path = "../../tools/manual.rs"]
mod manual;

use std::process::Command;

const PROGRAM_PATH: &str = env!("CARGO_BIN_EXE_labelgs");

/// What a command prints, without the line's end; none if it fails or is not there.
fn said(command: &mut Command) -> Option<String> {
    let output = command.output().ok().filter(|output| output.status.success())?;
    Some(String::from_utf8(output.stdout).expect("UTF-8").trim_end().to_owned())
}

/// Commands with all of their own, each with its words joined by `-`, as pages are named.
fn commands(parent: &clap::Command, name: &str, found: &mut Vec<(String, clap::Command)>) {
    found.push((name.to_owned(), parent.clone()));
    for inner in parent.get_subcommands().filter(|inner| inner.get_name() != "help") {
        commands(inner, &format!("{name}-{}", inner.get_name()), found);
    }
}

#[test]
fn every_command_has_a_page_and_completions() {
    let folder = tempfile::tempdir().expect("a folder");
    manual::write(folder.path()).expect("pages");
    let read = |name: String| {
        let path = folder.path().join(name);
        std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
    };
    let mut root = labelgs::cli::command::command();
    root.build();
    let mut all = Vec::new();
    commands(&root, "labelgs", &mut all);
    assert!(all.len() > 26, "{} commands", all.len());
    let completions =
        ["labelgs.bash", "_labelgs", "labelgs.fish"].map(|name| (name, read(format!("completions/{name}"))));
    assert_eq!(completions.len(), manual::COMPLETION_SHELLS.len());
    for (name, command) in &all {
        let page = read(format!("man/{name}.1"));
        assert!(page.contains(&format!(".TH {name} 1 ")), "{name}: {page}");
        for arg in command.get_arguments().filter(|arg| !arg.is_hide_set()) {
            let Some(flag) = arg.get_long() else { continue };
            assert!(page.contains(&format!("--{flag}").replace('-', "\\-")), "{name}: no --{flag} in the page");
            for (file, text) in &completions {
                // fish writes `-l flag`.
                let is_there = text.contains(&format!("--{flag}")) || text.contains(&format!("-l {flag}"));
                assert!(is_there, "{file}: no --{flag} of {name}");
            }
        }
        for (file, text) in &completions {
            assert!(text.contains(command.get_name()), "{file}: no {name}");
        }
    }
    let pages = std::fs::read_dir(folder.path().join("man")).expect("a folder").count();
    assert_eq!(pages, all.len(), "a page of no command");
    let bash = folder.path().join("completions/labelgs.bash");
    let loaded = Command::new("bash").args(["-c", "source \"$0\" && complete -p labelgs"]).arg(&bash).output();
    if let Ok(output) = loaded {
        assert!(output.status.success(), "bash: {}", String::from_utf8_lossy(&output.stderr));
    }
}

#[test]
fn the_version_tells_commit_and_features() {
    let version = env!("CARGO_PKG_VERSION");
    assert_eq!(said(Command::new(PROGRAM_PATH).arg("-V")), Some(format!("labelgs {version}")));
    let text = said(Command::new(PROGRAM_PATH).arg("--version")).expect("a version");
    let rest = text.strip_prefix(&format!("labelgs {version} (commit ")).unwrap_or_else(|| panic!("{text}"));
    let (commit, features) = rest.split_once(", features ").unwrap_or_else(|| panic!("{text}"));
    let features: Vec<&str> = features.trim_end_matches(')').split(' ').collect();
    assert!(features.contains(&"cli") && features.contains(&"viewer"), "{text}");
    assert_eq!(features.contains(&"lab"), cfg!(feature = "lab"), "{text}");
    // Cargo compiles `main.rs` anew when the variable changes, so this run of cargo built it with the same.
    assert_eq!(commit, std::env::var("LABELGS_COMMIT").as_deref().unwrap_or("unknown"));
}
