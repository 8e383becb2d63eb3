//! Writes the sum into a device image, for flashing tools other than `cargo program`.

use hal_sim::images::write_sum;
use std::path::Path;
use std::process::ExitCode;

fn main() -> ExitCode {
    let Some(path) = std::env::args_os().nth(1) else {
        eprintln!("usage: image-sum IMAGE");
        return ExitCode::from(2);
    };
    match write_sum(Path::new(&path)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{}: {error}", Path::new(&path).display());
            ExitCode::FAILURE
        }
    }
}
