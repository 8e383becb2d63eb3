//! Tests of every study with random wearers and of a fault campaign: interrupted, resumed, divided
//! into shards and merged, its folder holds the same bytes.

use crate::laboratory::folder;
use crate::sweeps::files;
use host_core::run::DeviceName;
use std::path::{Path, PathBuf};
use studies::catalog::{self, Entry, StudyRequest};
use studies::faults;
use studies::hamana2022::{Cells, CellsRun, TWO_POINTS};
use studies::laboratory::{Runnable, Shard};

/// Name of a class of faults on the native simulator, which is not in the catalog.
const FAULTS: &str = "faults";
/// Studies that are computed for participant P only.
const OF_P: [&str; 3] = ["hamana-4", "hamana-participants", "hamana-mechanisms"];
/// The only cell that is computed.
const CELL: usize = 15;

fn begun(name: &str, draws: u64) -> Box<dyn Runnable> {
    // Another seed than the judged ones.
    let decided = (Some(1_002), Some(draws));
    if name == FAULTS {
        let link = faults::Declaration::for_class(faults::Class::Link).unwrap();
        return Box::new(faults::Run::new(link, None, decided).unwrap());
    }
    if name == TWO_POINTS {
        let cell = Cells::load(Some(CELL)).unwrap().unwrap();
        return Box::new(CellsRun::new(cell, decided));
    }
    let asked = StudyRequest {
        name,
        wearer: OF_P.contains(&name).then_some("P"),
        ablation: None,
        participants: None,
        device: &DeviceName::Native,
        decided: (Some(44), Some(draws)),
    };
    let entry = Entry::find(&asked).unwrap().unwrap();
    assert_eq!(entry.mistakes(&asked), [""; 0]);
    entry.begin(&asked).unwrap()
}

fn whole(study: &dyn Runnable, dir: &Path, shard: Shard) {
    let ran = study.run(Some(dir), shard, &mut |_| true).unwrap();
    assert!(ran.is_whole);
}

/// Runs a study until `looks` looks have passed, and returns whether it is whole.
fn interrupted(study: &dyn Runnable, dir: &Path, looks: usize) -> bool {
    let mut left = looks;
    let ran = study.run(Some(dir), Shard::WHOLE, &mut |_| {
        left = left.saturating_sub(1);
        left > 0
    });
    ran.unwrap().is_whole
}

/// A study in three shards, merged, equals the whole study after three interruptions. For a long
/// study (`is_long`) only the second half of its units is computed again, after the first half and
/// a part of a line, as a kill leaves them.
fn is_the_same_however_cut(name: &str, draws: u64, is_long: bool) {
    let study = begun(name, draws);
    let dir = folder(&format!("runner-{name}"));
    let [resumed, merged] = ["resumed", "merged"].map(|text| dir.join(text));
    let parts: Vec<PathBuf> = (1..=3).map(|n| dir.join(n.to_string())).collect();
    for (part, n) in parts.iter().zip(1..) {
        whole(&*study, part, Shard { number: n, of: 3 });
    }
    study.merge(&parts, &merged).unwrap();
    let files_of_merged = files(&merged);
    let names: Vec<&str> = files_of_merged.iter().map(|(name, _)| &**name).collect();
    let (rows, kept) = match name {
        FAULTS => ("faults.csv", "units.jsonl"),
        TWO_POINTS => ("draws.csv", "draws.csv"),
        "hamana-participants" => ("posterior.csv", "units.jsonl"),
        "hamana-mechanisms" | "hamana-calibration" => ("result.json", "units.jsonl"),
        "hamana-claims" => ("claims.csv", "units.jsonl"),
        _ => ("draws.csv", "units.jsonl"),
    };
    for needed in [rows, kept, "result.json", "result.html"] {
        assert!(names.contains(&needed), "{name}: {names:?}");
    }

    std::fs::create_dir_all(&resumed).unwrap();
    if is_long {
        let units = std::fs::read_to_string(merged.join(kept)).unwrap();
        let lines: Vec<&str> = units.split_inclusive('\n').collect();
        let (before, after) = lines.split_at(lines.len() / 2);
        let begun = before.concat() + &after[0][..after[0].len() / 2];
        std::fs::write(resumed.join(kept), begun).unwrap();
        std::fs::copy(merged.join("sweep.json"), resumed.join("sweep.json")).unwrap();
    } else {
        for looks in [2, 3, 4] {
            interrupted(&*begun(name, draws), &resumed, looks);
        }
    }
    whole(&*begun(name, draws), &resumed, Shard::WHOLE);
    assert_same(name, &files_of_merged, &files(&resumed));
}

fn assert_same(name: &str, one: &[(String, Vec<u8>)], other: &[(String, Vec<u8>)]) {
    let has = |(file, _): &&(String, Vec<u8>)| file != ".lock";
    let (one, other): (Vec<_>, Vec<_>) = (
        one.iter().filter(has).collect(),
        other.iter().filter(has).collect(),
    );
    let names = |all: &[&(String, Vec<u8>)]| -> Vec<String> {
        all.iter().map(|(file, _)| file.clone()).collect()
    };
    assert_eq!(names(&one), names(&other), "{name}");
    for ((file, one), (_, other)) in one.into_iter().zip(other) {
        assert!(one == other, "{name}: {file} differs");
    }
}

#[test]
fn a_unit_that_was_changed_by_hand_is_named_by_its_line() {
    let study = begun("electrode-choice", 2);
    let dir = folder("runner-changed");
    whole(&*study, &dir, Shard::WHOLE);
    let path = dir.join("units.jsonl");
    let text = std::fs::read_to_string(&path).unwrap();
    let at = text.rfind('1').unwrap();
    std::fs::write(&path, format!("{}2{}", &text[..at], &text[at + 1..])).unwrap();
    let error = study.run(Some(&dir), Shard::WHOLE, &mut |_| true);
    let error = error.err().unwrap();
    let error = error.to_string();
    assert!(
        error.contains("E608") && error.contains("line 2: its checksum"),
        "{error}"
    );
}

#[test]
fn a_campaign_of_faults_is_cut() {
    is_the_same_however_cut(FAULTS, 12, false);
}

/// Cases do not depend on their number: a folder can be extended to more cases, but never reduced.
#[test]
fn a_campaign_of_faults_goes_on_to_more() {
    let dir = folder("runner-grown");
    let [grown, once] = ["grown", "once"].map(|text| dir.join(text));
    for count in [3, 8] {
        whole(&*begun(FAULTS, count), &grown, Shard::WHOLE);
    }
    whole(&*begun(FAULTS, 8), &once, Shard::WHOLE);
    assert_same(FAULTS, &files(&grown), &files(&once));
    let fewer = begun(FAULTS, 3).place(&grown, Shard::WHOLE);
    let error = fewer.err().unwrap().to_string();
    assert!(error.starts_with("E603"), "{error}");
    // A study whose draws depend on their number cannot be extended.
    let study = dir.join("study");
    whole(&*begun("electrode-choice", 2), &study, Shard::WHOLE);
    let more = begun("electrode-choice", 3).place(&study, Shard::WHOLE);
    assert!(more.is_err());
}

macro_rules! studies {
    ($($test:ident $name:literal $draws:literal $is_long:literal)*) => {
        $(#[test]
        fn $test() {
            is_the_same_however_cut($name, $draws, $is_long);
        })*

        #[test]
        fn every_study_of_the_catalog_is_cut() {
            let tested = [$($name),*];
            let names: Vec<&str> = catalog::names().collect();
            assert_eq!(names, tested);
        }
    };
}

studies! {
    hamana_1 "hamana-1" 1 false
    hamana_2 "hamana-2" 1 false
    hamana_3 "hamana-3" 3 false
    hamana_4 "hamana-4" 2 true
    hamana_posture "hamana-posture" 1 false
    hamana_hold "hamana-hold" 1 false
    hamana_participants "hamana-participants" 4 false
    hamana_mechanisms "hamana-mechanisms" 1 true
    hamana_calibration "hamana-calibration" 4 false
    hamana_claims "hamana-claims" 1 true
    two_points "two-points" 4 true
    lee "lee" 1 true
    ramps "harris-ramps" 2 false
    sierotowicz "sierotowicz" 3 true
    electrode_choice "electrode-choice" 3 false
    distributed "distributed" 1 true
    buatier "buatier" 1 true
}
