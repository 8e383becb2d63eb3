//! Tests of the two-point study as a sweep: the same bytes however it is divided, and every share
//! follows from its rows.

use crate::laboratory::folder;
use crate::sweeps::{files, shard};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use studies::hamana2022::Cells;
use studies::laboratory::{Drawing, Shard, Sweep, merge_shards};

/// Another seed than the judged one. One of its first draws in this cell has no voltages.
const SEED: u64 = 1_002;
const DRAWS: u64 = 6;
/// Curvature, with a return electrode by its area, as searched.
const CELL: usize = 15;

fn cells() -> Cells {
    Cells::load(Some(CELL)).unwrap().unwrap()
}

/// Computes the draws of this part that `dir` lacks.
fn drawn(dir: &Path, seed: u64, part: &str) {
    let (cells, shard) = (cells(), shard(part));
    let sweep = Sweep::from_drawing(&cells, (seed, DRAWS), shard);
    let computed = sweep.compute(&cells, Some(dir), &mut |_| true).unwrap();
    assert!(computed.is_whole);
    if shard == Shard::WHOLE {
        sweep.close(&cells, dir, &computed.units).unwrap();
    }
}

/// The whole study, computed by one test for all.
fn whole() -> &'static Path {
    static WHOLE: std::sync::OnceLock<PathBuf> = std::sync::OnceLock::new();
    WHOLE.get_or_init(|| {
        let dir = folder("points_whole");
        drawn(&dir, SEED, "1/1");
        dir
    })
}

/// Makes a folder of this part with its rows of the whole study.
fn part(name: &str, part: &str) -> PathBuf {
    let dir = folder(name);
    let (cells, shard) = (cells(), shard(part));
    let sweep = Sweep::from_drawing(&cells, (SEED, DRAWS), shard);
    drop(sweep.place(&dir).unwrap());
    sweep.begin(&dir).unwrap();
    let rows = fs::read_to_string(whole().join("draws.csv")).unwrap();
    let is_own = |(n, _): &(usize, &str)| *n == 0 || (n - 1) as u64 % shard.of == shard.number - 1;
    let own = rows.split_inclusive('\n').enumerate().filter(is_own);
    let own: String = own.map(|(_, row)| row).collect();
    fs::write(dir.join("draws.csv"), own).unwrap();
    dir
}

#[test]
fn shards_of_a_cell_join_to_the_bytes_of_one() {
    let parts = ["1/2", "2/2"].map(|part| {
        let dir = folder(&format!("points_{}", &part[..1]));
        drawn(&dir, SEED, part);
        dir
    });
    let joined = folder("points_joined");
    let (units, _) = merge_shards(&parts, &joined, &cells()).unwrap();
    assert_eq!(units.len() as u64, DRAWS);
    fs::remove_file(joined.join(".lock")).unwrap();
    assert_eq!(files(&joined), files(whole()));
}

#[test]
fn a_study_cut_anywhere_goes_on_to_the_same_bytes() {
    let rows = fs::read(whole().join("draws.csv")).unwrap();
    let dir = folder("points_cut");
    let lines = rows.split_inclusive(|byte| *byte == b'\n');
    let ends = lines.scan(0, |end, line| {
        *end += line.len();
        Some(*end)
    });
    let ends: Vec<usize> = ends.collect();
    for cut in [ends[3] + 1, ends[5] - 1, ends[6]] {
        let _ = fs::remove_dir_all(&dir);
        fs::create_dir_all(&dir).unwrap();
        fs::copy(whole().join("sweep.json"), dir.join("sweep.json")).unwrap();
        fs::write(dir.join("draws.csv"), &rows[..cut]).unwrap();
        drawn(&dir, SEED, "1/1");
        assert_eq!(files(&dir), files(whole()), "cut at {cut}");
    }
    // The program was killed before there was a row, or any complete file.
    let cells = cells();
    let sweep = Sweep::from_drawing(&cells, (SEED, DRAWS), Shard::WHOLE);
    for left in ["sweep.json", "sweep.json.partial", ".lock"] {
        let _ = fs::remove_dir_all(&dir);
        fs::create_dir_all(&dir).unwrap();
        let has = left == "sweep.json";
        let text = fs::read(whole().join("sweep.json")).unwrap();
        fs::write(dir.join(left), if has { text } else { Vec::new() }).unwrap();
        drop(sweep.place(&dir).unwrap());
        let computed = sweep.compute(&cells, Some(&dir), &mut |_| false).unwrap();
        assert!(computed.units.is_empty() && !computed.is_whole, "{left}");
    }
}

/// A row that the study would not have written is reported by file and line, with the remedy.
#[test]
fn rows_that_no_study_writes_are_refused() {
    let dir = part("points_by_hand", "1/1");
    let rows = dir.join("draws.csv");
    let text = fs::read_to_string(&rows).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    let columns: Vec<&str> = lines[0].split(',').collect();
    let nth = lines
        .iter()
        .position(|line| line.contains(",whole,"))
        .unwrap();
    let with = |column: &str, value: &str| {
        let place = columns.iter().position(|text| *text == column).unwrap();
        let mut fields: Vec<&str> = lines[nth].split(',').collect();
        fields[place] = value;
        let row = fields.join(",");
        let mut lines = lines.clone();
        lines[nth] = &row;
        lines.join("\n") + "\n"
    };
    let mut twice = lines.clone();
    twice[2] = lines[1];
    for (text, says) in [
        (with("two_nm", "NaN"), "`NaN` is not a finite number"),
        (with("two_nm", "inf"), "`inf` is not a finite number"),
        (with("two_nm", ""), "two_nm is missing"),
        (with("va_th", "45"), "va_th is 45; allowed: 0 to 44"),
        (with("ii_500", "1.5"), "ii_500 is 1.5; allowed: 0 to 1"),
        (
            with("left_out", "146"),
            "left_out is `146`; allowed: 0 to 145",
        ),
        (with("left_out", "-1"), "left_out is `-1`"),
        (with("became", "lost"), "became is `lost`; allowed: "),
        (
            with("became", "no points"),
            "its numbers should be written as",
        ),
        (
            with("electrodes", "square"),
            "electrodes is `square`; allowed: ",
        ),
        (with("two-stronger", ""), "its numbers should be written as"),
        (with("fat_mm", "3"), "the row of unit"),
        (with("cell", "curvature 5 searched"), "the row of unit"),
        (with("unit", "6"), "unit 6 is not in this sweep"),
        (
            with("posture", "true,"),
            "fields after the random parameters; expected: ",
        ),
        (twice.join("\n") + "\n", "unit 0 appears twice"),
    ] {
        fs::write(&rows, text).unwrap();
        let sweep = Sweep::from_drawing(&cells(), (SEED, DRAWS), Shard::WHOLE);
        let refused = sweep.compute(&cells(), Some(&dir), &mut |_| false);
        let error = refused.err().unwrap().to_string();
        let is = error.starts_with("E608") && error.contains("draws.csv is damaged: line ");
        assert!(is && error.contains(says), "{says}: {error}");
        assert!(
            error.contains("delete this line and all lines after it"),
            "{error}"
        );
    }
    let other = text.replacen("unit,", "number,", 1);
    fs::write(&rows, other).unwrap();
    let refused = merge_shards(&[dir], &folder("points_refused"), &cells());
    let error = refused.err().unwrap().to_string();
    assert!(
        error.contains("E608") && error.contains("its columns are not"),
        "{error}"
    );
}

#[test]
fn what_is_no_whole_is_not_joined() {
    let [one, two] = ["1/2", "2/2"].map(|text| part(&format!("points_part{}", &text[..1]), text));
    let refused = |parts: &[&PathBuf], why: &str| {
        let parts: Vec<PathBuf> = parts.iter().map(|path| (*path).clone()).collect();
        let out = folder("points_no_whole");
        let error = merge_shards(&parts, &out, &cells())
            .err()
            .unwrap()
            .to_string();
        assert!(
            error.starts_with("E604") && error.contains(why),
            "{why}: {error}"
        );
        assert!(!out.join("draws.csv").exists(), "{why}");
    };
    refused(&[&one], "shard 2/2 is missing");
    refused(&[&one, &one], "are both shard 1/2");
    refused(&[], "no folder was given");
    let nothing = folder("points_nothing");
    fs::create_dir_all(&nothing).unwrap();
    refused(&[&one, &nothing], "has no sweep.json");
    // Folders of another seed, count or program.
    let about = two.join("sweep.json");
    let text = fs::read_to_string(&about).unwrap();
    for (from, to, why) in [
        ("1002", "1003", "seed 1003 instead of 1002"),
        ("\"draws\": 6", "\"draws\": 7", "draws 7 instead of 6"),
        ("\"of\": 2", "\"of\": 3", "shards 3 instead of 2"),
        (
            "cell 15",
            "cell 14",
            "part cell 14 (curvature 1 searched) instead of cell 15",
        ),
        ("\"version\": \"0", "\"version\": \"9", "version 9"),
        (".toml\": \"", ".toml\": \"0", "a different declaration"),
    ] {
        assert!(text.contains(from), "{from}: {text}");
        fs::write(&about, text.replacen(from, to, 1)).unwrap();
        refused(&[&one, &two], why);
        // Nor can it be resumed.
        let sweep = Sweep::from_drawing(&cells(), (SEED, DRAWS), shard("2/2"));
        let error = sweep.place(&two).err().unwrap().to_string();
        assert!(error.starts_with("E603"), "{error}");
    }
    fs::write(&about, text.replacen("\"name\"", "name", 1)).unwrap();
    let error = merge_shards(std::slice::from_ref(&two), &folder("points_torn"), &cells());
    assert!(error.err().unwrap().to_string().starts_with("E608"));
    fs::write(&about, &text).unwrap();
    // All parts agree, but not with the draws of this program.
    let other = Cells::load(Some(CELL + 1)).unwrap().unwrap();
    let error = merge_shards(&[one.clone(), two.clone()], &folder("points_other"), &other);
    let error = error.err().unwrap().to_string();
    assert!(error.contains("does not fit this program"), "{error}");
    let rows = fs::read_to_string(two.join("draws.csv")).unwrap();
    let cut: Vec<&str> = rows.lines().take(2).collect();
    fs::write(two.join("draws.csv"), cut.join("\n") + "\n").unwrap();
    refused(&[&one, &two], "lacks unit 3;");
    fs::remove_file(two.join("draws.csv")).unwrap();
    refused(&[&one, &two], "lacks unit 1;");
}

/// Computes every share again from the numbers of `draws.csv` alone, as `population.toml` defines
/// them.
#[test]
fn rows_give_every_share() {
    let rows = fs::read_to_string(whole().join("draws.csv")).unwrap();
    let (head, rows) = rows.split_once('\n').unwrap();
    let columns: Vec<&str> = head.split(',').collect();
    let wearers: Vec<BTreeMap<&str, &str>> = rows
        .lines()
        .map(|row| columns.iter().copied().zip(row.split(',')).collect())
        .collect();
    assert_eq!(wearers.len() as u64, DRAWS, "none is dropped");
    let found: Vec<_> = wearers
        .iter()
        .filter(|map| map["became"] == "whole")
        .collect();
    assert!(
        found.len() < wearers.len(),
        "a draw without voltages is there"
    );
    let judged = found.iter().map(|map| claims(map));
    let judged: Vec<[Option<bool>; 8]> = judged.collect();
    let result = fs::read_to_string(whole().join("result.json")).unwrap();
    let result: Value = serde_json::from_str(&result).unwrap();
    let shares = result["shares"].as_array().unwrap();
    let of = |nth: usize| (shares[nth]["holds"].as_u64(), shares[nth]["of"].as_u64());
    let counted = |holds: usize, of: usize| (Some(holds as u64), Some(of as u64));
    for nth in 0..8 {
        let own: Vec<bool> = judged.iter().filter_map(|values| values[nth]).collect();
        let holds = own.iter().filter(|flag| **flag).count();
        assert_eq!(of(nth), counted(holds, own.len()), "{}", shares[nth]["id"]);
    }
    let jointly = judged
        .iter()
        .filter(|values| values.iter().all(|flag| *flag == Some(true)));
    assert_eq!(shares[8]["id"], "all");
    assert_eq!(of(8), counted(jointly.count(), found.len()));
    assert_eq!(shares[9]["id"], "found");
    assert_eq!(of(9), counted(found.len(), wearers.len()));
    for row in result["rows"].as_array().unwrap() {
        assert!(row["paper"].is_null() && row["n"].as_u64() <= Some(found.len() as u64));
        let [low, ours, high] = ["low", "ours", "high"].map(|text| row[text].as_f64().unwrap());
        assert!(low <= ours && ours <= high, "{row}");
    }
}

/// Returns the claims of `population.toml` for a row, in their order.
fn claims(row: &BTreeMap<&str, &str>) -> [Option<bool>; 8] {
    let of = |name: &str| row[name].parse::<f64>().ok();
    let must = |name: &str| of(name).unwrap();
    let late = [500, 1_000, 2_000, 5_000, 10_000].map(|us| of(&format!("ii_{us}")));
    let late: Option<Vec<f64>> = late.into_iter().collect();
    let ratio = |a: &str, b: &str| must(a) / must(b);
    let alike = |ratio: f64| (0.9..=1.15).contains(&ratio);
    let lower = |point: &str| {
        let least = must(&format!("v{point}_th"));
        of("r_th").is_some_and(|r| r * must(&format!("v{point}_max")) < least)
    };
    let lost = |points: &str| must(&format!("{points}_0_deg")) - must(&format!("{points}_90_deg"));
    [
        of("ii_0").zip(of("ii_2000")).map(|(a, b)| a < b),
        late.map(|all| all.iter().all(|value| *value > 0.8)),
        Some(ratio("two_nm", "one_nm") > 1.05),
        Some(ratio("two_nm", "apart_nm") > 1.05),
        Some(alike(ratio("apart_nm", "one_nm"))),
        Some(alike(ratio("one_nm", "one_isolated_nm"))),
        Some(lower("a") && lower("b")),
        Some(lost("two") < lost("one")),
    ]
}

#[test]
fn all_cells_have_their_own_rows_and_no_other_number() {
    assert!(Cells::load(Some(49)).unwrap().is_none());
    let all = Cells::load(None).unwrap().unwrap();
    assert_eq!((all.count(), all.units(200)), (49, 9_800));
    assert_eq!(all.subset(), None);
    let sweep = Sweep::from_drawing(&all, (SEED, 200), Shard::WHOLE);
    let last = all.row_prefixes(&sweep, 8_199);
    assert!(last[0].starts_with("8199,no summation,199,"), "{last:?}");
    let one = Sweep::from_drawing(&cells(), (SEED, 200), Shard::WHOLE);
    assert_eq!(Cells::from_sweep(&one).unwrap().subset(), one.only);
    let unknown = Sweep {
        only: Some("cell 99".to_owned()),
        ..one
    };
    let error = Cells::from_sweep(&unknown).err().unwrap().to_string();
    assert!(
        error.starts_with("E604") && error.contains("cell 99"),
        "{error}"
    );
}
