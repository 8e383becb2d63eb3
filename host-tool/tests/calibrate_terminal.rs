//! `flexor calibrate` at a terminal: keys that come all at once, too early or not at all.

use crate::calibrate_orders::{PLAN, entries};
use crate::program::{folder, ran, written};
use crate::seated::{TerminalProgram, size};
use std::path::{Path, PathBuf};

fn seated(test: &str, plan: &str, columns: u16, rows: u16) -> (PathBuf, TerminalProgram) {
    let folder = folder(test);
    written(&folder, "plan.toml", plan);
    let words = "calibrate --electrodes plan.toml --out w.toml";
    let seated = TerminalProgram::start(&folder, words, size(columns, rows));
    (folder, seated)
}

/// How often something was given.
fn given(folder: &Path) -> usize {
    entries(folder, "given").len()
}

#[test]
fn pasted_keys_raise_nothing_and_do_not_keep_control_c() {
    let ups = "\u{1b}[A".repeat(1300);
    let raises = "+n".repeat(1900);
    for (pasted, most) in [(&ups, 1), (&raises, 1)] {
        let (folder, mut seated) = seated("calibrate_pasted", PLAN, 80, 24);
        seated.sees("READY");
        seated.types(&format!("{pasted}\u{3}"));
        assert_eq!(seated.ended(), Some(1), "{}", seated.seen);
        let ended = entries(&folder, "ended");
        assert!(ended[0].to_string().contains("E683"), "{ended:?}");
        // The first byte may come alone, and is a key then.
        assert!(given(&folder) <= most);
    }
}

#[test]
fn a_paste_is_no_order_and_a_key_is_one() {
    let plan = PLAN.replace("10.0", "1.0");
    let (folder, mut seated) = seated("calibrate_paste", &plan, 80, 24);
    seated.sees("\u{1b}[?2004h");
    seated.sees("READY");
    seated.types(&format!("\u{1b}[200~{}\u{1b}[201~", "+n".repeat(100)));
    // Answers before the question are none.
    seated.types("+");
    seated.sees(" ON");
    seated.types("y");
    seated.types("y");
    seated.sees("y / n");
    assert_eq!(given(&folder), 1);
    assert!(entries(&folder, "found").is_empty());
    seated.types("n");
    seated.sees("READY");
    seated.types("+");
    seated.sees("ON");
    seated.types("\u{1b}");
    assert_eq!(seated.ended(), Some(1), "{}", seated.seen);
    assert_eq!(given(&folder), 2);
    assert!(seated.seen.contains("E683"), "{}", seated.seen);
}

#[test]
fn a_terminal_that_is_closed_ends_it() {
    let (folder, mut seated) = seated("calibrate_closed", PLAN, 80, 24);
    seated.sees("READY");
    seated.types("+");
    seated.sees(" ON");
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
    let (exit, told, error) = ran(&folder, &[&again[..], &["--out", "w.toml"]].concat());
    assert_eq!(exit, Some(0), "{told}{error}");
}

#[test]
fn a_terminal_that_is_too_small_raises_nothing() {
    let (folder, mut seated) = seated("calibrate_small", PLAN, 60, 10);
    seated.sees("SILENT");
    seated.sees("needed");
    while entries(&folder, "armed").is_empty() {
        seated.read();
    }
    seated.types("+");
    seated.resize(80, 24);
    // Notes come last on the screen.
    seated.sees("READY");
    seated.sees("E671");
    assert_eq!(given(&folder), 0);
    seated.types("+");
    seated.sees(" ON");
    seated.resize(80, 3);
    seated.sees("END");
    seated.sees("needed");
    seated.types("\u{1b}");
    assert_eq!(seated.ended(), Some(1), "{}", seated.seen);
    assert_eq!(given(&folder), 1);
}
