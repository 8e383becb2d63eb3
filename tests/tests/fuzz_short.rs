//! A short fuzz on the stable compiler: the functions that the libFuzzer
//! targets run, on the committed corpus and on seeded mutations of it. Their
//! seed is that of the property tests (.cargo/config.toml).
//!
//! `RENEW_CORPUS=1 cargo test -p tests fuzz_short` writes the
//! seeds again after a change of the messages.

mod mutate;
mod seeds;

use mutate::Mutator;
use proptest::test_runner::{Config as ProptestConfig, RngSeed};
use std::panic::catch_unwind;
use std::path::{Path, PathBuf};
use tests::fuzz;

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/fuzz");

/// Every file in `folder`, by name.
fn files(folder: &Path) -> Vec<Vec<u8>> {
    let entries = std::fs::read_dir(folder).expect("the corpus is committed");
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    let files = paths.iter().filter(|path| path.is_file());
    files.map(|path| std::fs::read(path).unwrap()).collect()
}

/// Runs the corpus, then `count` mutations of it.
fn run(target: &str, function: fn(&[u8]), count: u32) {
    let folder = Path::new(FOLDER).join("corpus").join(target);
    run_on(files(&folder), target, function, count);
}

fn run_on(inputs: Vec<Vec<u8>>, target: &str, function: fn(&[u8]), count: u32) {
    let RngSeed::Fixed(seed) = ProptestConfig::default().rng_seed else {
        panic!("no seed: .cargo/config.toml has one for `cargo test`");
    };
    for input in &inputs {
        check(target, function, input);
    }
    let mut mutator = Mutator::new(seed, inputs);
    for _ in 0..count {
        check(target, function, &mutator.next());
    }
}

/// Runs one input; one that breaks a promise is kept as a file.
fn check(target: &str, function: fn(&[u8]), input: &[u8]) {
    if catch_unwind(|| function(input)).is_err() {
        let folder = Path::new(FOLDER).join("artifacts").join(target);
        let file = folder.join("short");
        std::fs::create_dir_all(&folder).unwrap();
        std::fs::write(&file, input).unwrap();
        panic!("fuzz::{target} broke on {} ({input:02x?})", file.display());
    }
}

#[test]
fn frame() {
    run("frame", fuzz::frame, 50_000);
}

#[test]
fn lockstep() {
    run("lockstep", fuzz::lockstep, 50_000);
}

/// A board that leaves out refills that would do nothing is the same board.
#[test]
fn skipping() {
    run("lockstep", fuzz::skipping, 5_000);
}

#[test]
fn edge_file() {
    run("edge_file", fuzz::edge_file, 20_000);
}

/// Its corpus are the session files that the program comes with.
#[test]
fn session_toml() {
    let sessions = concat!(env!("CARGO_MANIFEST_DIR"), "/../host-tool/sessions");
    let inputs = files(Path::new(sessions));
    run_on(inputs, "session_toml", fuzz::session_toml, 20_000);
}

/// A seed that the device refuses at its door would fuzz nothing behind it.
#[test]
fn seeds_are_current_and_carried_out() {
    for (target, name, seed) in seeds::all() {
        let file = Path::new(FOLDER).join("corpus").join(target).join(name);
        if std::env::var_os("RENEW_CORPUS").is_some() {
            std::fs::create_dir_all(file.parent().unwrap()).unwrap();
            std::fs::write(&file, &seed).unwrap();
        }
        let is_current = std::fs::read(&file).is_ok_and(|committed| committed == seed);
        assert!(is_current, "{}: see above for renewal", file.display());
    }
    for (name, steps) in seeds::conversations() {
        let mut session = fuzz::Session::open();
        for step in &steps {
            step.run(&mut session);
        }
        let (acknowledged, refused) = session.answers();
        assert_eq!(refused, 0, "{name}");
        assert!(acknowledged > 5, "{name}: {acknowledged}");
        assert!(session.has_driven(), "{name} drives nothing");
    }
}
