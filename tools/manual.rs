//! Writes manual pages and completions for shells, made from the flags and commands of the program.
//!
//!     cargo run --example manual -- FOLDER
//!
//! FOLDER/man has a page for each command, FOLDER/completions a file for each shell.

use clap_complete::Shell;
use std::io;
use std::path::Path;

/// Shells that have completions.
pub const SHELLS: [Shell; 3] = [Shell::Bash, Shell::Zsh, Shell::Fish];

/// Writes all of them.
pub fn write(folder: &Path) -> io::Result<()> {
    // Pages of one version are the same for every commit and set of features.
    let mut command = labelgs::cli::command::command().long_version(None::<&'static str>);
    let (pages, completions) = (folder.join("man"), folder.join("completions"));
    std::fs::create_dir_all(&pages)?;
    std::fs::create_dir_all(&completions)?;
    clap_mangen::generate_to(command.clone(), &pages)?;
    for shell in SHELLS {
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
