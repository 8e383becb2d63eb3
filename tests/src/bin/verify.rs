//! `cargo verify`: runs every check. See [`tests::verify`].

use std::process::ExitCode;

fn main() -> ExitCode {
    let wanted: Vec<String> = std::env::args().skip(1).collect();
    tests::verify::main(&wanted)
}
