//! Tests of `flexor monitor` at a terminal.

use crate::program::{SESSION, test_folder, write_file};
use crate::seated::{TerminalProgram, size};

#[test]
fn a_terminal_that_is_closed_ends_it() {
    let folder = test_folder("monitor_closed");
    write_file(&folder, "session.toml", SESSION);
    let words = "monitor --session session.toml";
    let mut seated = TerminalProgram::start(&folder, words, size(100, 30));
    seated.wait_for_text("STIMULATING");
    assert_eq!(seated.close().code(), Some(129));
}

#[test]
fn its_keys_are_taken() {
    let folder = test_folder("monitor_keys");
    write_file(&folder, "session.toml", SESSION);
    let words = "monitor --session session.toml";
    let mut seated = TerminalProgram::start(&folder, words, size(100, 30));
    seated.wait_for_text("STIMULATING");
    seated.type_text("q");
    assert_eq!(seated.wait_for_exit(), Some(0), "{}", seated.seen);
}
