//! The program for Windows, checked without linking.

use super::Workspace;
use super::command::cargo;
use super::console::Console;
use super::report::Report;
use super::setup::obtain_target;

/// Windows, with the GNU tools.
pub(super) const TARGET: &str = "x86_64-pc-windows-gnu";

/// Checks the parts of `flexor.exe`; skipped if the compiler has no library for [`TARGET`] and
/// rustup cannot fetch it.
pub(super) fn run(at: &Workspace, console: &mut Console) -> anyhow::Result<Report> {
    if !obtain_target(at, console, TARGET)? {
        return Ok(skipped());
    }
    cargo(
        at,
        console,
        &["check", "-p", "host-tool", "--target", TARGET],
    )
}

fn skipped() -> Report {
    Report::skip(format!(
        "windows: `rustup target add {TARGET}` failed; the program was not checked for Windows"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_target_that_cannot_be_had_is_skipped_by_name() {
        let report = skipped();
        assert_eq!((report.passed, report.failed, report.skipped), (0, 0, 1));
        assert!(report.lines[0].starts_with("skipped windows: "));
        assert!(report.lines[0].contains(TARGET));
    }
}
