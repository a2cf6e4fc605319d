//! The command line tool.

fn main() -> std::process::ExitCode {
    labelgs::cli::main(std::env::args_os()).into()
}
