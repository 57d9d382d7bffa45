//! The `cittert` program: parse, run, print, exit.

use std::process::ExitCode;

fn main() -> ExitCode {
    match cittert::cli::run(std::env::args_os()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            failure.print();
            ExitCode::from(failure.exit_code())
        }
    }
}
