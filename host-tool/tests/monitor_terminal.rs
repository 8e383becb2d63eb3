//! `flexor monitor` at a terminal.

use crate::program::{SESSION, folder, written};
use crate::seated::{TerminalProgram, size};

#[test]
fn a_terminal_that_is_closed_ends_it() {
    let folder = folder("monitor_closed");
    written(&folder, "session.toml", SESSION);
    let words = "monitor --session session.toml";
    let mut seated = TerminalProgram::start(&folder, words, size(100, 30));
    seated.sees("STIMULATING");
    assert_eq!(seated.close().code(), Some(129));
}

#[test]
fn its_keys_are_taken() {
    let folder = folder("monitor_keys");
    written(&folder, "session.toml", SESSION);
    let words = "monitor --session session.toml";
    let mut seated = TerminalProgram::start(&folder, words, size(100, 30));
    seated.sees("STIMULATING");
    seated.types("q");
    assert_eq!(seated.ended(), Some(0), "{}", seated.seen);
}
