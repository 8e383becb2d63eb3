//! `cargo program`: builds the stimulator's image, writes its sum, flashes it with probe-rs and
//! shows its log.
//!
//! probe-rs is looked for before the build, which takes minutes. Arguments are passed on to it.

use hal_sim::images::{Image, Places};
use std::ffi::OsString;
use std::path::Path;
use std::process::{Command, ExitCode, Stdio};

const MISSING: &str = "probe-rs is not installed: get it with 'cargo install probe-rs-tools \
    --locked' or from https://probe.rs, then run 'cargo program' again.";

/// Arguments of probe-rs. The board resets itself after a fault; without `--no-catch-reset` the
/// probe would halt the core at each reset.
const ARGUMENTS: [&str; 4] = ["run", "--no-catch-reset", "--chip", "STM32F405RGTx"];

fn main() -> ExitCode {
    let given: Vec<OsString> = std::env::args_os().skip(1).collect();
    let tried = Command::new("probe-rs")
        .arg("--version")
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status();
    if !tried.is_ok_and(|status| status.success()) {
        eprintln!("{MISSING}");
        return ExitCode::FAILURE;
    }
    let checkout = Path::new(env!("CARGO_MANIFEST_DIR")).parent();
    let places = Places {
        program: None,
        checkout: checkout.map(Path::to_owned),
    };
    let image = match Image::Stimulator.find(&places, &mut |line| eprintln!("{line}")) {
        Ok(image) => image,
        Err(error) => {
            eprintln!("{error}");
            return ExitCode::FAILURE;
        }
    };
    let mut command = Command::new("probe-rs");
    match command.args(ARGUMENTS).args(given).arg(image).status() {
        Ok(status) if status.success() => ExitCode::SUCCESS,
        Ok(_) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("probe-rs: {error}");
            ExitCode::FAILURE
        }
    }
}
