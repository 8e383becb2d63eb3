//! `flexor run --watch`: shows a running session on the screen and takes keys.

use super::interrupt;
use crate::live::{Model, Shared, Watch, discard_unread_output, run_screen};
use anyhow::Context;
use host_core::link::{Interruption, Port};
use host_core::record::Recorder;
use host_core::run::{Control, Outcome, Outputs, SessionFile, run_with_outputs};
use std::io::{self, IsTerminal};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Time for which a terminal that accepts no output may delay the program after the session.
const FAREWELL: Duration = Duration::from_secs(1);

/// Returns whether there is a terminal for output and for keys.
pub fn has_terminal() -> bool {
    io::stdin().is_terminal() && io::stdout().is_terminal()
}

/// Runs a session through `port` with the controls of the keyboard, shows it, and streams it to
/// `recorder` and `outputs`. Also returns whether the terminal worked to the end; if it fails, the
/// session is stopped.
pub fn play<P: Port>(
    (session, device): (&SessionFile, &str),
    port: P,
    recorder: &mut Recorder,
    outputs: &mut (dyn Outputs + Send),
    interruption: &Interruption,
) -> (Outcome, anyhow::Result<()>) {
    let model = Model::new(device, Some(session)).with_hands();
    let shared = Arc::new(Shared::new(model, interruption.clone()));
    let is_over = Arc::new(AtomicBool::new(false));
    let drawing = std::thread::spawn({
        let (shared, is_over) = (Arc::clone(&shared), Arc::clone(&is_over));
        move || {
            let shown = run_screen(&shared, || is_over.load(Ordering::Acquire), || false);
            // Nobody can stop the session by hand any more.
            shared.push_control(Control::Stop);
            shown
        }
    });
    let watch = Watch::new(&shared);
    let (outcome, _) = run_with_outputs(session, port, Some(recorder), watch, outputs);
    is_over.store(true, Ordering::Release);
    let begin = Instant::now();
    while !drawing.is_finished() && begin.elapsed() < FAREWELL {
        std::thread::sleep(Duration::from_millis(1));
    }
    let shown = match drawing.is_finished() {
        true => drawing
            .join()
            .unwrap_or_else(|panic| std::panic::resume_unwind(panic)),
        // The thread is blocked in a write, and every further write would block, too.
        false => {
            let _ = crossterm::terminal::disable_raw_mode();
            discard_unread_output(Duration::ZERO);
            Err(io::ErrorKind::TimedOut.into())
        }
    };
    // A closed terminal also sends a signal.
    let shown = match (shown, interruption.received_signal()) {
        (Err(_), Some(signal)) => {
            let ended = "and the terminal closed; the session was stopped".to_owned();
            return (outcome, Err(interrupt::EndedBySignal(signal, ended).into()));
        }
        (shown, _) => shown,
    };
    let shown = shown.context(
        "E571 the terminal has closed or accepts no output, so the session was stopped; its \
         record is kept",
    );
    (outcome, shown)
}
