//! Tests of `flexor calibrate` at a terminal: keys that come all at once, too early or not at all.

use crate::calibrate_orders::{PLAN, entries};
use crate::program::{run_flexor, test_folder, write_file};
use crate::seated::{TerminalProgram, size};
use std::path::{Path, PathBuf};

fn start_at_terminal(
    test: &str,
    plan: &str,
    columns: u16,
    rows: u16,
) -> (PathBuf, TerminalProgram) {
    let folder = test_folder(test);
    write_file(&folder, "plan.toml", plan);
    let words = "calibrate --electrodes plan.toml --out w.toml";
    let seated = TerminalProgram::start(&folder, words, size(columns, rows));
    (folder, seated)
}

/// Counts the presentations.
fn given_count(folder: &Path) -> usize {
    entries(folder, "given").len()
}

#[test]
fn pasted_keys_raise_nothing_and_do_not_keep_control_c() {
    let ups = "\u{1b}[A".repeat(1300);
    let raises = "+n".repeat(1900);
    for (pasted, most) in [(&ups, 1), (&raises, 1)] {
        let (folder, mut seated) = start_at_terminal("calibrate_pasted", PLAN, 80, 24);
        seated.wait_for_text("READY");
        seated.type_text(&format!("{pasted}\u{3}"));
        assert_eq!(seated.wait_for_exit(), Some(1), "{}", seated.seen);
        let ended = entries(&folder, "ended");
        assert!(ended[0].to_string().contains("E683"), "{ended:?}");
        // The first byte may arrive alone, and is then a key.
        assert!(given_count(&folder) <= most);
    }
}

#[test]
fn a_paste_is_no_order_and_a_key_is_one() {
    let plan = PLAN.replace("10.0", "1.0");
    let (folder, mut seated) = start_at_terminal("calibrate_paste", &plan, 80, 24);
    seated.wait_for_text("\u{1b}[?2004h");
    seated.wait_for_text("READY");
    seated.type_text(&format!("\u{1b}[200~{}\u{1b}[201~", "+n".repeat(100)));
    // Answers before the question do not count.
    seated.type_text("+");
    seated.wait_for_text(" ON");
    seated.type_text("y");
    seated.type_text("y");
    seated.wait_for_text("y / n");
    assert_eq!(given_count(&folder), 1);
    assert!(entries(&folder, "found").is_empty());
    seated.type_text("n");
    seated.wait_for_text("READY");
    seated.type_text("+");
    seated.wait_for_text("ON");
    seated.type_text("\u{1b}");
    assert_eq!(seated.wait_for_exit(), Some(1), "{}", seated.seen);
    assert_eq!(given_count(&folder), 2);
    assert!(seated.seen.contains("E683"), "{}", seated.seen);
}

#[test]
fn a_terminal_that_is_closed_ends_it() {
    let (folder, mut seated) = start_at_terminal("calibrate_closed", PLAN, 80, 24);
    seated.wait_for_text("READY");
    seated.type_text("+");
    seated.wait_for_text(" ON");
    assert_eq!(seated.close().code(), Some(129));
    let ended = entries(&folder, "ended");
    assert!(ended[0].to_string().contains("SIGHUP"), "{ended:?}");
    let again = [
        "calibrate",
        "--electrodes",
        "plan.toml",
        "--auto",
        "--resume",
    ];
    let (exit, output, error) = run_flexor(&folder, &[&again[..], &["--out", "w.toml"]].concat());
    assert_eq!(exit, Some(0), "{output}{error}");
}

#[test]
fn a_terminal_that_is_too_small_raises_nothing() {
    let (folder, mut seated) = start_at_terminal("calibrate_small", PLAN, 60, 10);
    seated.wait_for_text("SILENT");
    seated.wait_for_text("needed");
    while entries(&folder, "armed").is_empty() {
        seated.read();
    }
    seated.type_text("+");
    seated.resize(80, 24);
    // Notes are drawn last.
    seated.wait_for_text("READY");
    seated.wait_for_text("E671");
    assert_eq!(given_count(&folder), 0);
    seated.type_text("+");
    seated.wait_for_text(" ON");
    seated.resize(80, 3);
    seated.wait_for_text("END");
    seated.wait_for_text("needed");
    seated.type_text("\u{1b}");
    assert_eq!(seated.wait_for_exit(), Some(1), "{}", seated.seen);
    assert_eq!(given_count(&folder), 1);
}
