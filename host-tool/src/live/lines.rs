//! The dashboard without a terminal: prints one line per second.

use super::{Model, Order, Shared};
use std::io::{self, Write};
use std::time::{Duration, Instant};

/// Time between two printed lines.
const PERIOD: Duration = Duration::from_secs(1);

/// Time between checks for the end.
const LOOK: Duration = Duration::from_millis(10);

/// Writes one line per second, and a last one, until `is_over`. Calls `must_quit` often. A closed
/// pipe also ends the output.
///
/// # Errors
/// Fails if `out` cannot be written for any other reason.
pub fn write_lines(
    shared: &Shared,
    out: &mut impl Write,
    describe: fn(&Model, usize) -> String,
    is_over: impl Fn() -> bool,
    must_quit: impl Fn() -> bool,
) -> io::Result<()> {
    let mut reported_notes = 0;
    let mut due = Instant::now() + PERIOD;
    loop {
        let over = is_over();
        if over || Instant::now() >= due {
            due += PERIOD;
            let text = {
                let model = shared.model();
                let text = describe(&model, reported_notes);
                reported_notes = model.noted;
                text
            };
            match writeln!(out, "{text}").and_then(|()| out.flush()) {
                Err(gone) if gone.kind() == io::ErrorKind::BrokenPipe => return Ok(()),
                result => result?,
            }
        }
        if over {
            return Ok(());
        }
        if must_quit() {
            shared.order(Order::Quit);
        }
        std::thread::sleep(LOOK);
    }
}
