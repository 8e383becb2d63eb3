//! Entry point of the `flexor` program.

use std::process::ExitCode;

fn main() -> ExitCode {
    host_tool::cli::main()
}
