//! A short fuzz test on the stable compiler: each target of `tests::fuzz` on the committed corpus
//! and on seeded mutations of it. The seed is that of the property tests (.cargo/config.toml). A
//! command runs a long one: docs/evidence/fuzz.md.
//!
//! `RENEW_CORPUS=1 cargo test -p tests fuzz_short` writes the seeds again after a change of the
//! messages.

mod seeds;

use proptest::test_runner::{Config as ProptestConfig, RngSeed};
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use tests::fuzz::{self, Campaign, TARGETS, mutation};

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/fuzz");

/// Runs a target's corpus, then mutations of it.
fn run(name: &str) {
    let target = TARGETS
        .iter()
        .find(|target| target.name == name)
        .expect("a target");
    let RngSeed::Fixed(seed) = ProptestConfig::default().rng_seed else {
        panic!("no seed: .cargo/config.toml has one for `cargo test`");
    };
    let corpus = fuzz::corpus(target.corpus);
    for input in &corpus {
        check(name, target.function, input);
    }
    for index in 0..target.short {
        check(name, target.function, &mutation(&corpus, seed, index));
    }
}

/// Runs one input, and saves it as a file if it breaks a promise.
fn check(target: &str, function: fn(&[u8]), input: &[u8]) {
    if std::panic::catch_unwind(|| function(input)).is_err() {
        let folder = Path::new(FOLDER).join("artifacts").join(target);
        let file = folder.join("short");
        std::fs::create_dir_all(&folder).unwrap();
        std::fs::write(&file, input).unwrap();
        panic!("fuzz::{target} broke on {} ({input:02x?})", file.display());
    }
}

#[test]
fn frame() {
    run("frame");
}

#[test]
fn lockstep() {
    run("lockstep");
}

/// A board that skips refills without effect emits the same as one that does not.
#[test]
fn skipping() {
    run("skipping");
}

#[test]
fn device() {
    run("device");
}

#[test]
fn edge_file() {
    run("edge_file");
}

#[test]
fn session_toml() {
    run("session_toml");
}

#[test]
fn wearer() {
    run("wearer");
}

#[test]
fn journal() {
    run("journal");
}

#[test]
fn record() {
    run("record");
}

#[test]
fn report() {
    run("report");
}

#[test]
fn lines() {
    run("lines");
}

#[test]
fn stage_words() {
    run("stage_words");
}

#[test]
fn elf() {
    run("elf");
}

#[test]
fn gdb() {
    run("gdb");
}

#[test]
fn usb() {
    run("usb");
}

#[test]
fn no_target_is_left_out() {
    let run = [
        "frame",
        "lockstep",
        "skipping",
        "device",
        "edge_file",
        "session_toml",
        "wearer",
        "journal",
        "record",
        "report",
        "lines",
        "stage_words",
        "elf",
        "gdb",
        "usb",
    ];
    let names: Vec<_> = TARGETS.iter().map(|target| target.name).collect();
    assert_eq!(names, run);
}

/// A seed that the device refuses at once would not test the code behind.
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
    let mut wrong = Vec::new();
    for (name, steps) in seeds::conversations() {
        let mut session = fuzz::Session::open();
        for step in &steps {
            step.run(&mut session);
        }
        let (acknowledged, refused) = session.answers();
        let has_driven = session.has_driven();
        if refused > 0 || acknowledged <= 5 || !has_driven {
            wrong.push(format!(
                "{name}: {acknowledged}, refused {refused}, drives {has_driven}"
            ));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// A campaign must be able to find something: this one looks for inputs with the byte 0x5A, ends on
/// request, and gives the same result on one core and on two.
#[test]
fn a_campaign_finds_what_is_there_and_goes_on_where_it_ended() {
    static SEEN: AtomicU64 = AtomicU64::new(0);
    let target = fuzz::Target {
        name: "no_0x5a",
        about: "",
        function: |input| {
            SEEN.fetch_add(1, Ordering::Relaxed);
            assert!(!input.contains(&0x5A), "it is there, {}", input.len());
        },
        corpus: &[],
        short: 0,
    };
    let campaign = |inputs| Campaign {
        target: &target,
        corpus: vec![vec![0; 8], vec![1; 30]],
        seed: 7,
        inputs,
    };
    let (done, finds) = campaign(0..20_000).run(|_, _| true);
    assert_eq!((done, SEEN.load(Ordering::Relaxed)), (20_000, 20_000));
    // One place gives one find, the first, whatever the rest of the message.
    let [find] = &finds[..] else {
        panic!("{finds:?}");
    };
    assert!(find.input.contains(&0x5A) && find.told.contains("it is there"));
    assert_eq!(find.input, mutation(&campaign(0..1).corpus, 7, find.index));
    let (done, none) = campaign(0..find.index).run(|_, _| true);
    assert_eq!((done, none), (find.index, vec![]));
    let (stopped, _) = campaign(0..20_000).run(|done, _| done < 100);
    assert!((100..20_000).contains(&stopped), "{stopped}");
}
