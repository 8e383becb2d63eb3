//! Writes the sum into a device image, for flashing tools other than `cargo program`, and the commit
//! of a release.

use hal_sim::images::{write_commit, write_sum};
use std::path::Path;
use std::process::ExitCode;

fn main() -> ExitCode {
    let mut arguments = std::env::args_os().skip(1);
    let Some(path) = arguments.next() else {
        eprintln!("usage: image-sum IMAGE [COMMIT]");
        return ExitCode::from(2);
    };
    let path = Path::new(&path);
    let written = match arguments.next() {
        None => write_sum(path),
        Some(hash) => match first_bytes(&hash.to_string_lossy()) {
            Some(commit) => write_commit(path, commit),
            None => {
                eprintln!("COMMIT needs at least 16 hexadecimal digits");
                return ExitCode::from(2);
            }
        },
    };
    match written {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{}: {error}", path.display());
            ExitCode::FAILURE
        }
    }
}

/// Returns the first eight bytes of a commit's hash.
fn first_bytes(hash: &str) -> Option<[u8; 8]> {
    let digits = hash.get(..16)?;
    Some(u64::from_str_radix(digits, 16).ok()?.to_be_bytes())
}
