//! Tests of runs that end early, by seed: signals, a connection that is cut or freezes, a disk that
//! becomes full. In every case the record can be read, is complete to its last row, states that it
//! is incomplete and why, and the outputs are disconnected.
//!
//! `cargo test -p host-tool --test suite interruptions -- --ignored --nocapture` runs 200 of them
//! and prints the time from a signal to `Stop` on the wire.

mod board;
mod case;
mod clock;
mod disk;
mod metronome;
mod program;

use crate::program::{one_channel, test_folder, write_file};
use crate::steady::retry_after_stalls;
use board::{Board, Wire};
use case::{Case, CaseResult, Disturbance, run_case};
use hal_sim::wire::pty::PtyWire;
use program::Program;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

/// Bound for half of the stops. `Stop` is on the wire within 20 ms if the computer has time. Tests
/// share it with compilers, and a program that is not scheduled is late; the bound still excludes
/// waiting for an answer or for the next setpoint (500 ms).
const HALF_WITHIN: Duration = Duration::from_millis(100);

/// Runs the cases of these seeds, two at a time, and prints a summary.
fn campaign(name: &str, count: u64) -> Vec<(Case, CaseResult)> {
    let next = AtomicU64::new(0);
    let fates = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| {
                loop {
                    let seed = next.fetch_add(1, Ordering::Relaxed);
                    if seed >= count {
                        return;
                    }
                    let case = Case::of(seed);
                    let fate =
                        run_case(case, &test_folder(&format!("interruptions/{name}/{seed}")));
                    fates.lock().unwrap().push((case, fate));
                }
            });
        }
    });
    fates.into_inner().unwrap()
}

fn print_fates(fates: &[(Case, CaseResult)]) {
    for way in Disturbance::ALL {
        let own = fates.iter().filter(|(case, _)| case.way == way);
        let own: Vec<&CaseResult> = own.map(|(_, fate)| fate).collect();
        let rows: usize = own.iter().map(|fate| fate.rows).sum();
        let again: u32 = own.iter().map(|fate| fate.again).sum();
        let runs = own.len();
        println!("{way:?}: {runs} runs, {rows} rows kept, {again} begun again");
    }
    let mut times: Vec<f64> = fates
        .iter()
        .filter_map(|(_, fate)| Some(fate.until_stop?.as_secs_f64() * 1e3))
        .collect();
    times.sort_by(f64::total_cmp);
    let at = |part: f64| times[((times.len() - 1) as f64 * part) as usize];
    println!(
        "from the signal to Stop on the wire, {} times, ms: least {:.2}, median {:.2}, 9 of 10 \
         within {:.2}, worst {:.2}",
        times.len(),
        at(0.0),
        at(0.5),
        at(0.9),
        at(1.0)
    );
    let late = times.iter().filter(|time| **time > 20.0).count();
    println!("later than 20 ms: {late}");
    for (case, fate) in fates {
        if fate.until_stop.is_some_and(|time| time.as_millis() >= 20) {
            let stall = fate.stall;
            println!("{case:?}: {fate:?}; a thread of this test in that time: {stall:?}");
        }
    }
}

#[test]
fn a_run_that_is_cut_short_says_so_and_keeps_its_rows() {
    let name = "a_run_that_is_cut_short_says_so_and_keeps_its_rows";
    retry_after_stalls(name, are_cut_short);
}

fn are_cut_short() {
    let fates = campaign("short", 18);
    assert_eq!(fates.len(), 18);
    print_fates(&fates);
    let mut times: Vec<Duration> = fates.iter().filter_map(|f| f.1.until_stop).collect();
    times.sort();
    assert!(times[times.len() / 2] < HALF_WITHIN, "{times:?}");
}

#[test]
#[ignore = "takes minutes: the 200 random interruptions"]
fn two_hundred_random_interruptions() {
    let fates = campaign("long", 200);
    assert_eq!(fates.len(), 200);
    print_fates(&fates);
}

/// Checks how a signal ends a command that was started with these arguments in its own folder.
fn check_command_ends(name: &str, words: &str, ready: Option<&str>, signal: &str, code: i32) {
    let folder = test_folder(&format!("interruptions/{name}-{signal}"));
    write_file(&folder, "session.toml", case::open_loop());
    let arguments: Vec<&str> = words.split_whitespace().collect();
    let mut program = Program::start(&folder, &arguments, None);
    let out = folder.join("stdout");
    let is_ready = || match ready {
        Some(file) => folder.join(file).exists(),
        None => std::fs::metadata(&out).is_ok_and(|file| file.len() > 0),
    };
    assert!(program.wait_until(is_ready), "{name}: {}", program.error());
    program.signal(signal);
    let status = program.wait();
    assert_eq!(status.code(), Some(code), "{name}: {}", program.error());
    let error = program.error();
    let came = format!("SIG{signal} came");
    assert!(error.contains(&came), "{name}: {error}");
    if ready.is_some() {
        let record = host_core::record::load(&folder.join("out")).unwrap();
        let reason = record.ending.reason.expect(name);
        assert!(reason.contains(&came), "{name}: {reason}");
        let kept = "the record, marked incomplete, is in out";
        assert!(error.contains(kept), "{name}: {error}");
        assert!(folder.join("out/report.html").is_file(), "{name}");
    }
}

#[test]
fn every_command_that_stimulates_ends_in_order() {
    let record = Some("out/summary.json");
    for (signal, code) in [("INT", 130), ("TERM", 143), ("HUP", 129)] {
        check_command_ends("run", "run session.toml --out out", record, signal, code);
        check_command_ends("demo", "demo --out out", record, signal, code);
        let harris = "experiment harris-wall --out out";
        check_command_ends("experiment", harris, record, signal, code);
        let monitor = "monitor --session session.toml";
        check_command_ends("monitor", monitor, None, signal, code);
        check_command_ends("serve", "serve --tcp 127.0.0.1:0", None, signal, code);
    }
}

/// Returns a declaration with two trials of 0.3 s; `protocol` adds a prompt or a long rest.
fn two_trials(protocol: &str) -> String {
    format!(
        "name = \"two\"\ntitle = \"Two\"\nsource = \"nobody\"\nsession = \"session.toml\"\n\
         seed = 3\ndraws = 1\nmeasures = [\"charge_mc\"]\n[protocol]\nrepetitions = 2\n{protocol}\n"
    )
}

/// During a prompt or a rest nothing is stimulated: a signal ends the protocol there, and the
/// record states how far it came.
#[cfg(unix)]
#[test]
fn a_signal_at_a_prompt_or_in_a_rest_ends_the_protocol() {
    for (name, protocol, asked, how_far, trials) in [
        (
            "prompt",
            "prompt = \"Ready?\"",
            "Press Enter to continue",
            "before the first of 2",
            0,
        ),
        (
            "rest",
            "rest_s = 600.0",
            "600 s of rest",
            "after trial 1 of 2",
            1,
        ),
    ] {
        let folder = test_folder(&format!("interruptions/at-{name}"));
        let session = write_file(&folder, "session.toml", one_channel(0.3, 50));
        write_file(&folder, "two.toml", two_trials(protocol));
        let board = Board::serve(Wire::Tcp, &folder, &session);
        let terminal = folder.join("terminal");
        let _other_end = PtyWire::open(&terminal).unwrap();
        let line = format!("experiment two.toml --device {} --out out", board.at);
        let words: Vec<&str> = line.split_whitespace().collect();
        let mut program = Program::start_at(&terminal, &folder, &words);
        let error = folder.join("stderr");
        let is_asked = || std::fs::read_to_string(&error).is_ok_and(|error| error.contains(asked));
        assert!(program.wait_until(is_asked), "{name}: {}", program.error());
        program.signal("INT");
        let code = program.wait().code();
        assert_eq!(code, Some(130), "{name}: {}", program.error());
        assert!(board.ends_isolated(), "{name}");
        let record = host_core::record::load(&folder.join("out")).unwrap();
        assert_eq!(record.trials.len(), trials, "{name}");
        let reason = record.ending.reason.unwrap();
        for phrase in [how_far, "SIGINT came", "nothing was stimulated"] {
            assert!(reason.contains(phrase), "{name}: {phrase}: {reason}");
        }
        assert_eq!(record.ending.exit_code, Some(130), "{name}");
        let page = std::fs::read_to_string(folder.join("out/result.html")).unwrap();
        let mark = format!("Cut short: {trials} of 2 trials began");
        assert!(page.contains(&mark), "{name}");
    }
}

/// Commands that only run a simulator and record nothing have only their exit code.
#[cfg(target_os = "linux")]
#[test]
fn what_records_nothing_ends_at_once() {
    for (signal, number, code) in [("INT", 2, 130), ("TERM", 15, 143)] {
        for words in ["selftest", "bench"] {
            let folder = test_folder(&format!("interruptions/{words}-{signal}"));
            let mut program = Program::start(&folder, &[words], None);
            let begin = std::time::Instant::now();
            while !program.handles_signal(number) && begin.elapsed() < Duration::from_secs(60) {
                assert!(program.is_running(), "{words}: {}", program.error());
                std::thread::sleep(Duration::from_millis(2));
            }
            program.signal(signal);
            let exit = program.wait().code();
            assert_eq!(exit, Some(code), "{words}: {}", program.error());
        }
    }
}

#[test]
fn a_second_signal_ends_the_program_at_once() {
    let folder = test_folder("interruptions/second");
    let fate = case::signal_twice(&folder);
    assert_eq!(fate, Some(143));
}
