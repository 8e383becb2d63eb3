//! Tests of sweeps: the contents of their folders, however they are divided, killed, merged or
//! changed.

use crate::laboratory::{folder, small};
use std::fs;
use std::path::{Path, PathBuf};
use studies::laboratory::{Experiment, Shard, Sweep, merge};

const OPEN: &str = include_str!("../../experiments/open-trains.toml");
const OPEN_SESSION: &str = include_str!("../../sessions/open_finger.toml");

pub(crate) fn swept(shard: Shard, seed: u64, dir: &Path) {
    let experiment = small();
    let sweep = Sweep::new(&experiment, seed, 10, shard);
    sweep.run(&experiment, dir, &[], &mut |_| true).unwrap();
}

/// Returns every file of a folder with its bytes.
pub(crate) fn files(dir: &Path) -> Vec<(String, Vec<u8>)> {
    let entries = fs::read_dir(dir).unwrap().flatten();
    let mut all: Vec<_> = entries
        .map(|entry| {
            (
                entry.file_name().into_string().unwrap(),
                fs::read(entry.path()).unwrap(),
            )
        })
        .collect();
    all.sort();
    all
}

pub(crate) fn shard(text: &str) -> Shard {
    text.parse().unwrap()
}
/// A row that the sweep would not have written is reported by file and line.
#[test]
fn a_row_changed_by_hand_is_told_by_its_line() {
    let dir = folder("by_hand");
    swept(Shard::WHOLE, 3, &dir);
    let rows = dir.join("draws.csv");
    let whole = fs::read_to_string(&rows).unwrap();
    let lines: Vec<&str> = whole.lines().collect();
    let with = |nth: usize, from: &str, to: &str| {
        let mut lines: Vec<String> = lines.iter().map(|&line| line.to_owned()).collect();
        assert!(lines[nth].contains(from), "{}", lines[nth]);
        lines[nth] = lines[nth].replacen(from, to, 1);
        lines.join("\n") + "\n"
    };
    // The lines are the header, then two for each of ten wearers.
    let drawn = lines[5].split(',').nth(2).unwrap();
    let measure = lines[6].rsplit(',').next().unwrap();
    let mut without: Vec<&str> = lines.clone();
    without.remove(3);
    let without = without.join("\n") + "\n";
    for (text, says) in [
        (
            with(6, measure, "NaN"),
            "line 7: `NaN` is not a finite number",
        ),
        (
            with(6, measure, "much"),
            "line 7: `much` is not a finite number",
        ),
        (
            with(5, drawn, "1.25"),
            "line 6: the row of unit 2 does not begin as seed 3 gives it",
        ),
        (
            with(6, "\"bare\"", "\"other\""),
            "line 7: the row of unit 2",
        ),
        (with(5, "2,", "99,"), "line 6: unit 99 is not in this sweep"),
        (without, "line 4: the row of unit 1"),
    ] {
        fs::write(&rows, text).unwrap();
        let refused = merge(
            std::slice::from_ref(&dir),
            &folder("by_hand_merged"),
            &small(),
        );
        let error = refused.unwrap_err().to_string();
        assert!(
            error.starts_with("E608") && error.contains("draws.csv"),
            "{error}"
        );
        assert!(error.contains(says), "{says}: {error}");
    }
}

#[test]
fn shards_merge_to_the_bytes_of_one_sweep() {
    let whole = folder("whole");
    swept(Shard::WHOLE, 3, &whole);
    let names: Vec<String> = files(&whole).into_iter().map(|(name, _)| name).collect();
    let wanted = [
        "declaration.toml",
        "draws.csv",
        "result.html",
        "result.json",
        "sweep.json",
    ];
    assert_eq!(names, wanted);
    let parts: Vec<PathBuf> = (1..=3)
        .map(|n| {
            let dir = folder(&format!("part{n}"));
            swept(shard(&format!("{n}/3")), 3, &dir);
            dir
        })
        .collect();
    let merged = folder("merged");
    let outcome = merge(&parts, &merged, &small()).unwrap();
    // The lock file of the merge is not part of the sweep.
    fs::remove_file(merged.join(".lock")).unwrap();
    assert_eq!(files(&merged), files(&whole));
    let shares: Vec<_> = outcome
        .shares
        .iter()
        .map(|share| (share.holds, share.of))
        .collect();
    assert_eq!(shares, [(10, 10), (0, 10)]);
    // A shard of another sweep, a missing shard, a shard twice, no shard.
    let other = folder("other_seed");
    swept(shard("3/3"), 4, &other);
    let refused = |parts: &[PathBuf], why: &str| {
        let error = merge(parts, &folder("refused"), &small())
            .unwrap_err()
            .to_string();
        assert!(error.starts_with("E604") && error.contains(why), "{error}");
    };
    refused(
        &[parts[0].clone(), parts[1].clone(), other],
        "seed 4 instead of 3",
    );
    refused(&parts[..2], "shard 3/3 is missing");
    refused(&[parts[0].clone(), parts[0].clone()], "are both shard 1/3");
    refused(&[], "no folder was given");
    let rows = fs::read_to_string(parts[2].join("draws.csv")).unwrap();
    let cut: Vec<&str> = rows.lines().take(3).collect();
    fs::write(parts[2].join("draws.csv"), cut.join("\n") + "\n").unwrap();
    refused(&parts, "lacks unit 5;");
}

#[test]
fn a_sweep_killed_at_any_byte_goes_on_to_the_same_bytes() {
    let whole = folder("unbroken");
    swept(Shard::WHOLE, 3, &whole);
    let wanted = files(&whole);
    let rows = fs::read(whole.join("draws.csv")).unwrap();
    let broken = folder("broken");
    for part in [0, 1, 30, 77, 200, 401, rows.len() - 1, rows.len()] {
        let _ = fs::remove_dir_all(&broken);
        fs::create_dir_all(&broken).unwrap();
        let head = rows.iter().position(|byte| *byte == b'\n').unwrap() + 1;
        fs::copy(whole.join("sweep.json"), broken.join("sweep.json")).unwrap();
        fs::write(
            broken.join("draws.csv"),
            &rows[..part.max(head).min(rows.len())],
        )
        .unwrap();
        swept(Shard::WHOLE, 3, &broken);
        assert_eq!(files(&broken), wanted, "cut at {part}");
    }
    // A sweep stopped before its first unit can be resumed.
    let experiment = small();
    let stopped = folder("stopped");
    let sweep = Sweep::new(&experiment, 3, 10, Shard::WHOLE);
    assert!(
        sweep
            .run(&experiment, &stopped, &[], &mut |_| false)
            .unwrap()
            .outcome
            .is_none()
    );
    swept(Shard::WHOLE, 3, &stopped);
    assert_eq!(files(&stopped), wanted);
}

#[test]
fn a_folder_of_something_else_is_left_alone() {
    let dir = folder("somebody");
    fs::create_dir_all(&dir).unwrap();
    fs::write(dir.join("thesis.tex"), "years").unwrap();
    let experiment = small();
    let sweep = |seed| Sweep::new(&experiment, seed, 10, Shard::WHOLE);
    let refused = sweep(3)
        .run(&experiment, &dir, &[], &mut |_| true)
        .err()
        .unwrap();
    assert!(refused.to_string().starts_with("E603"), "{refused}");
    assert_eq!(files(&dir).len(), 1);
    let mine = folder("mine");
    swept(Shard::WHOLE, 3, &mine);
    let refused = sweep(4)
        .run(&experiment, &mine, &[], &mut |_| true)
        .err()
        .unwrap();
    let told = refused.to_string();
    assert!(told.contains("seed 3") && told.contains("seed 4"), "{told}");
    for text in ["0/3", "4/3", "3", "a/b", "1/0", "1/10001", ""] {
        assert!(text.parse::<Shard>().is_err(), "{text}");
    }
}

/// Trains without feedback: simulated limbs without their device, some of them with it as well.
#[test]
fn shards_without_feedback_merge_to_the_bytes_of_one_sweep() {
    let text = OPEN.replace("draws = 400", "draws = 3");
    let texts = |_: &str| Ok(OPEN_SESSION.to_owned());
    let experiment = Experiment::new("open-trains.toml", &text, &texts).unwrap();
    let swept = |name: &str, shard: Shard| {
        let dir = folder(name);
        let sweep = Sweep::new(&experiment, 14, 3, shard);
        let swept = sweep.run(&experiment, &dir, &[], &mut |_| true).unwrap();
        assert_eq!(swept.checked.unwrap().units, 1, "{name}");
        dir
    };
    let whole = swept("open_whole", Shard::WHOLE);
    let parts = ["1/2", "2/2"].map(|text| swept(&format!("open_{}", &text[..1]), shard(text)));
    let merged = folder("open_merged");
    merge(&parts, &merged, &experiment).unwrap();
    fs::remove_file(merged.join(".lock")).unwrap();
    assert_eq!(files(&merged), files(&whole));
}
