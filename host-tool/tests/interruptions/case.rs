//! One run and its disturbance, decided by a seed.

use super::board::{Board, Order, Wire};
use super::metronome::{Metronome, Stall};
use super::program::Program;
use crate::program::{one_channel, write_file};
use host_core::record::{self, Run};
use host_core::report::{Report, page};
use std::path::Path;
use std::process::ExitStatus;
use std::time::{Duration, Instant};

/// Returns an open-loop session with one channel.
pub fn open_loop() -> String {
    one_channel(3600.0, 2)
}

/// Returns a session with a finger that follows a sine, judged from 10 s on.
fn closed_loop() -> String {
    include_str!("../../sessions/hamana_exp4_two_point_finger.toml")
        .replace("duration_s = 30.0", "duration_s = 3600.0")
        .replace("host_timeout_ms = 100", "host_timeout_ms = 1000")
}

/// Disturbance that ends the run.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Disturbance {
    Interrupt,
    Terminate,
    Kill,
    Cut,
    Freeze,
    /// No file may grow beyond a maximum size.
    FullDisk,
}

impl Disturbance {
    pub const ALL: [Self; 6] = [
        Self::Interrupt,
        Self::Terminate,
        Self::Kill,
        Self::Cut,
        Self::Freeze,
        Self::FullDisk,
    ];

    /// Returns the exit code, and the reason in the record.
    fn expected(self) -> (Option<i32>, &'static str) {
        match self {
            Self::Interrupt => (Some(130), "E580 SIGINT came"),
            Self::Terminate => (Some(143), "E580 SIGTERM came"),
            Self::Kill => (None, "the reason was not recorded"),
            Self::Cut => (Some(1), "E502 lost the device"),
            Self::Freeze => (Some(1), "E501 the device did not answer"),
            Self::FullDisk => (Some(1), "E582 cannot write"),
        }
    }
}

/// A run to be interrupted.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    pub way: Disturbance,
    /// `None` for the simulator in the program, in simulated time.
    wire: Option<Wire>,
    is_closed_loop: bool,
    /// Time from the first message to the device until the disturbance.
    after: Duration,
    /// Maximum file size for [`Disturbance::FullDisk`].
    most_bytes: u64,
}

/// Result of an interrupted run.
#[derive(Clone, Copy, Debug)]
pub struct CaseResult {
    pub rows: usize,
    /// Time from the signal to `Stop` at the board.
    pub until_stop: Option<Duration>,
    /// Stalls of this computer meanwhile.
    pub stall: Stall,
    /// Number of repetitions because something else ended the run early.
    pub again: u32,
}

impl Case {
    pub fn of(seed: u64) -> Self {
        let random = |place: u64, end: u64| hal_sim::random::word(0, seed * 8 + place) % end;
        let way = Disturbance::ALL[(seed % 6) as usize];
        let wire = match (seed / 6 + seed % 6) % 3 {
            0 => Some(Wire::Pty),
            1 if !matches!(way, Disturbance::Cut | Disturbance::Freeze) => None,
            _ => Some(Wire::Tcp),
        };
        let most = if wire.is_some() { 4_000 } else { 100_000 };
        Self {
            way,
            wire,
            is_closed_loop: random(0, 2) == 0,
            after: Duration::from_micros(random(1, 900_000)),
            // Room for the files written before the start: columns.csv has about 3.3 kB.
            most_bytes: 3_500 + random(2, most),
        }
    }
}

/// Runs the case, again if the computer was too slow for the device, and checks the record.
pub fn run_case(case: Case, folder: &Path) -> CaseResult {
    for again in 0..3 {
        let _ = std::fs::remove_dir_all(folder);
        std::fs::create_dir_all(folder).unwrap();
        if let Some(fate) = try_case(case, folder) {
            return CaseResult { again, ..fate };
        }
    }
    let error = std::fs::read_to_string(folder.join("stderr"));
    panic!("{case:?} ended before its time, thrice: {error:?}");
}

fn try_case(case: Case, folder: &Path) -> Option<CaseResult> {
    let text = match case.is_closed_loop {
        true => closed_loop(),
        false => open_loop(),
    };
    let session = write_file(folder, "session.toml", text);
    let board = case.wire.map(|wire| Board::serve(wire, folder, &session));
    let at = board.as_ref().map_or("native", |board| &board.at);
    let most = (case.way == Disturbance::FullDisk).then_some(case.most_bytes);
    let arguments = ["run", "session.toml", "--device", at, "--out", "out"];
    let metronome = Metronome::start(folder);
    let mut program = Program::start(folder, &arguments, most);
    let has_begun = || match &board {
        Some(board) => board.heard().hello.is_some(),
        None => folder.join("out/summary.json").exists(),
    };
    let mut asked = None;
    if case.way != Disturbance::FullDisk {
        if !program.wait_until(has_begun) {
            return None;
        }
        std::thread::sleep(case.after);
        asked = Some(interrupt(case.way, &mut program, board.as_ref()));
    }
    let status = program.wait();
    let heard = board.as_ref().map(Board::heard);
    if let Some(board) = board {
        assert!(board.ends_isolated(), "{case:?}");
    }
    if is_disturbed(case, status, &program.error()) {
        return None;
    }
    let rows = check(case, folder, status, &program.error());
    let stop = heard.and_then(|heard| heard.stop);
    let is_heard = !matches!(
        case.way,
        Disturbance::Kill | Disturbance::Cut | Disturbance::Freeze
    );
    if is_heard && heard.is_some_and(|heard| heard.start.is_some()) {
        let error = program.error();
        assert!(stop.is_some(), "{case:?}: no Stop on the wire: {error}");
    }
    let is_signal = matches!(case.way, Disturbance::Interrupt | Disturbance::Terminate);
    let until_stop = asked.zip(stop).filter(|_| is_signal);
    let stall = until_stop.map(|(asked, stop)| metronome.worst(asked, stop));
    Some(CaseResult {
        rows,
        until_stop: until_stop.map(|(asked, stop)| stop.saturating_duration_since(asked)),
        stall: stall.unwrap_or_default(),
        again: 0,
    })
}

fn interrupt(way: Disturbance, program: &mut Program, board: Option<&Board>) -> Instant {
    match (way, board) {
        (Disturbance::Interrupt, _) => return program.signal("INT"),
        (Disturbance::Terminate, _) => return program.signal("TERM"),
        (Disturbance::Kill, _) => return program.signal("KILL"),
        (Disturbance::Cut, Some(board)) => board.order(Order::Cut),
        (Disturbance::Freeze, Some(board)) => board.order(Order::Freeze),
        (Disturbance::Cut | Disturbance::Freeze | Disturbance::FullDisk, _) => {}
    }
    Instant::now()
}

/// Returns whether the device ended the run because this computer was too slow.
fn is_disturbed(case: Case, status: ExitStatus, error: &str) -> bool {
    let stalled = error.contains("HostSilent")
        || error.contains("E509 this computer did not run")
        || case.way != Disturbance::Freeze && error.contains("E501 the device did not answer");
    status.code() == Some(1) && stalled
}

/// Checks the record in the folder, and returns the number of rows.
fn check(case: Case, folder: &Path, status: ExitStatus, error: &str) -> usize {
    let (code, reason) = case.way.expected();
    assert_eq!(status.code(), code, "{case:?}: {error}");
    let out = folder.join("out");
    let run = record::load(&out).unwrap();
    assert!(run.ending.is_incomplete(), "{case:?}: {:?}", run.ending);
    if case.way != Disturbance::Kill {
        assert_eq!(run.ending.exit_code.map(i32::from), code, "{case:?}");
        assert!(error.contains("is in out"), "{case:?}: {error}");
    }
    let [trial] = run.trials.as_slice() else {
        panic!("{case:?}: {} trials", run.trials.len());
    };
    let rising = trial.samples.iter().is_sorted_by(|a, b| a.t_s < b.t_s);
    assert!(rising, "{case:?}");
    let samples = record::trial_folder(&out, 0, &trial.name).join("samples.csv");
    let text = std::fs::read_to_string(samples).unwrap();
    let complete_lines = text.matches('\n').count();
    assert_eq!(
        trial.samples.len(),
        complete_lines.saturating_sub(1),
        "{case:?}"
    );
    // A write across a page boundary is not atomic when the program is killed; an incomplete last
    // row was not counted above.
    if !matches!(case.way, Disturbance::FullDisk | Disturbance::Kill) {
        assert!(text.ends_with('\n'), "{case:?}: half a row");
    }
    headline_is_true(case, &run, reason, &out);
    trial.samples.len()
}

fn headline_is_true(case: Case, run: &Run, reason: &str, out: &Path) {
    let report = Report {
        run,
        paper: &[],
        assumptions: &[],
        command: "",
    };
    let result = |page: &str| {
        let begin = page.find("<p class=\"result\">").unwrap();
        let end = page[begin..].find("</p>").unwrap();
        page[begin..begin + end].to_owned()
    };
    let headline = result(&page(&report));
    for part in ["Incomplete: ", reason] {
        assert!(headline.contains(part), "{case:?}: {headline}");
    }
    let says_open = headline.contains("Open loop");
    let is_open = !case.is_closed_loop && !run.trials[0].samples.is_empty();
    assert_eq!(says_open, is_open, "{case:?}: {headline}");
    if let Ok(written) = std::fs::read_to_string(out.join("report.html")) {
        assert_eq!(result(&written), headline, "{case:?}");
    } else {
        assert!(
            matches!(case.way, Disturbance::Kill | Disturbance::FullDisk),
            "{case:?}"
        );
    }
}

/// A frozen connection keeps the program waiting for the answer to its stop. Returns the exit code
/// after a second signal.
pub fn signal_twice(folder: &Path) -> Option<i32> {
    let session = write_file(folder, "session.toml", open_loop());
    let board = Board::serve(Wire::Tcp, folder, &session);
    let arguments = ["run", "session.toml", "--device", &board.at, "--out", "out"];
    let mut program = Program::start(folder, &arguments, None);
    let has_started = program.wait_until(|| board.heard().start.is_some());
    assert!(has_started, "{}", program.error());
    board.order(Order::Freeze);
    program.signal("TERM");
    std::thread::sleep(Duration::from_millis(30));
    program.signal("TERM");
    let code = program.wait().code();
    let kept = record::load(&folder.join("out")).unwrap();
    assert!(kept.ending.is_incomplete());
    code
}
