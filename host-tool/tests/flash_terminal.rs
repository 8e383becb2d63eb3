//! Tests of `flexor flash` at a terminal, with a breadboard on the chip simulator.

use crate::program::{Board, run_flexor, test_folder};
use crate::seated::{TerminalProgram, size};
use std::path::Path;

/// Serves a breadboard, and returns it with the words of the command that writes into it.
fn breadboard(folder: &Path) -> (Board, String) {
    let wire = [
        "--device",
        "chip",
        "--board",
        "weact",
        "--tcp",
        "127.0.0.1:0",
    ];
    let board = Board::serve(folder, &wire);
    let words = format!("flash --board weact --device {}", board.at);
    (board, words)
}

/// Ctrl-C is an answer to the question: the program ends, and the board was not asked to restart.
#[test]
fn ctrl_c_at_the_question_ends_the_program_and_changes_nothing() {
    let folder = test_folder("flash_terminal");
    let (board, words) = breadboard(&folder);
    let mut seated = TerminalProgram::start(&folder, &words, size(100, 30));
    seated.wait_for_text("y/N");
    // The answer after it must not arrive: the program has ended, by the signal or with its code.
    seated.type_text("\x03n\r");
    let code = seated.wait_for_exit();
    assert!(
        code.is_none() || code == Some(130),
        "{code:?}: {}",
        seated.seen
    );
    // Still the firmware, not the boot loader.
    let mut seated = TerminalProgram::start(&folder, &words, size(100, 30));
    seated.wait_for_text("y/N");
    seated.type_text("n\r");
    assert_eq!(seated.wait_for_exit(), Some(2), "{}", seated.seen);
    assert!(
        seated.seen.contains("nothing was written"),
        "{}",
        seated.seen
    );
    drop(board);
}

#[test]
fn another_board_than_the_named_one_is_not_asked() {
    let folder = test_folder("flash_other");
    let (board, _) = breadboard(&folder);
    let words = [
        "flash", "--yes", "--board", "feather", "--device", &board.at,
    ];
    let (exit, _, error) = run_flexor(&folder, &words);
    assert_ne!(exit, Some(0));
    assert!(error.contains("E808"), "{error}");
}
