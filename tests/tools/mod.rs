//! Scripts and packages.

mod arguments; // help of scripts, arguments that they have not
mod package; // manual pages and completions of every command, and the version
