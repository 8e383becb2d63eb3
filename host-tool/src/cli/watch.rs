//! `flexor run --watch`: the session on the screen, hands on the controls.

use crate::live::{Model, Shared, Watch, screen};
use anyhow::Context;
use host_core::link::{Interruption, Port};
use host_core::record::Recorder;
use host_core::run::{Control, Outcome, Outputs, SessionFile, run_taken};
use std::io::{self, IsTerminal};
use std::sync::atomic::{AtomicBool, Ordering};

/// Whether there is a terminal to show a session on and to take keys from.
pub fn has_terminal() -> bool {
    io::stdin().is_terminal() && io::stdout().is_terminal()
}

/// Plays a session through `port` as the keys ask, shows it, and streams it to `recorder` and
/// `outputs`. Beside the outcome: whether the terminal was there to the end. If it goes, the
/// session is stopped.
pub fn play<P: Port>(
    (session, device): (&SessionFile, &str),
    port: P,
    recorder: &mut Recorder,
    outputs: &mut dyn Outputs,
    interruption: &Interruption,
) -> (Outcome, anyhow::Result<()>) {
    let model = Model::new(device, Some(session)).with_hands();
    let shared = Shared::new(model, interruption.clone());
    let is_over = AtomicBool::new(false);
    let (outcome, shown) = std::thread::scope(|scope| {
        let screen = scope.spawn(|| {
            let shown = screen(&shared, || is_over.load(Ordering::Acquire), || false);
            // Nobody can stop it by hand any more.
            shared.control(Control::Stop);
            shown
        });
        let watch = Watch::new(&shared);
        let (outcome, _) = run_taken(session, port, Some(recorder), watch, outputs);
        is_over.store(true, Ordering::Release);
        (outcome, screen.join())
    });
    let shown = shown.unwrap_or_else(|panic| std::panic::resume_unwind(panic));
    let shown = shown.context("E546 the terminal has gone: the session was stopped then");
    (outcome, shown)
}
