//! Writes manual pages and shell completions, generated from the program's flags and commands.
//!
//!     cargo run --example manual -- FOLDER
//!
//! FOLDER/man gets a page per command, FOLDER/completions a file per shell.

use clap_complete::Shell;
use std::io;
use std::path::Path;

/// Shells with completions.
pub const COMPLETION_SHELLS: [Shell; 3] = [Shell::Bash, Shell::Zsh, Shell::Fish];

/// Writes all pages and completions.
pub fn write(folder: &Path) -> io::Result<()> {
    // The pages of a version are the same for every commit and feature set.
    let mut command = labelgs::cli::command::command().long_version(None::<&'static str>);
    let (pages, completions) = (folder.join("man"), folder.join("completions"));
    std::fs::create_dir_all(&pages)?;
    std::fs::create_dir_all(&completions)?;
    clap_mangen::generate_to(command.clone(), &pages)?;
    for shell in COMPLETION_SHELLS {
        clap_complete::generate_to(shell, &mut command, "labelgs", &completions)?;
    }
    Ok(())
}

#[allow(dead_code, reason = "a test uses the function above alone")]
fn main() -> io::Result<()> {
    match std::env::args_os().nth(1) {
        Some(folder) => write(Path::new(&folder)),
        None => Err(io::Error::other("name a folder for the pages and completions")),
    }
}
