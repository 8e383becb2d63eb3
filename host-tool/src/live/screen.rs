//! The dashboard on a terminal, which is always restored at the end.

use super::stream::{discard_unread_output, has_input};
use super::{Act, Order, Shared, draw, order_for_key};
use crossterm::event::{self, Event, KeyEvent};
use ratatui::DefaultTerminal;
use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Time between frames.
pub(super) const FRAME: Duration = Duration::from_millis(50);

/// Whether a panic has restored the terminal and printed its message there.
static PANICKED: AtomicBool = AtomicBool::new(false);

/// Returns whether a panic has restored the terminal already.
pub(super) fn has_panicked() -> bool {
    PANICKED.load(Ordering::Acquire)
}

/// The terminal in raw mode, on its alternate screen.
struct Screen(DefaultTerminal);

impl Screen {
    fn open() -> io::Result<Self> {
        // Installs its own panic hook that restores the terminal.
        let screen = Self(ratatui::try_init()?);
        install_panic_hook(|| {});
        Ok(screen)
    }
}

/// Installs a panic hook that notes the panic and calls `restore` before the message is printed.
pub(super) fn install_panic_hook(restore: fn()) {
    let tell = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        PANICKED.store(true, Ordering::Release);
        restore();
        tell(panic);
    }));
}

impl Drop for Screen {
    fn drop(&mut self) {
        if !PANICKED.load(Ordering::Acquire) {
            // Fails if the terminal has closed.
            let _ = ratatui::try_restore();
        }
    }
}

/// Draws and reads keys until `is_over`. Calls `must_quit` often.
///
/// # Errors
/// Fails if the terminal fails or has closed.
pub fn run_screen(
    shared: &Shared,
    is_over: impl Fn() -> bool,
    must_quit: impl Fn() -> bool,
) -> io::Result<()> {
    let mut screen = Screen::open()?;
    let mut drawn = Instant::now();
    while !is_over() && !has_panicked() {
        if must_quit() {
            shared.order(Order::Quit);
        }
        let now = Instant::now();
        let model = {
            let mut model = shared.model();
            model.silent_s += (now - drawn).as_secs_f64();
            model.clone()
        };
        drawn = now;
        let drawn = screen.0.draw(|frame| draw(frame, &model)).map(drop);
        let seen = drawn.and_then(|()| take_keys(shared, now + FRAME));
        if seen.is_err() {
            discard_unread_output(FRAME);
            return seen;
        }
    }
    Ok(())
}

/// Carries out the effect of a key. If the keyboard controls the session, the key may change the
/// session.
fn take_key(shared: &Shared, key: KeyEvent) {
    let mut model = shared.model();
    let act = match &mut model.hands {
        Some(hands) => hands.press(key, Instant::now()),
        None => order_for_key(key).map(Act::Order),
    };
    match act {
        None => {}
        Some(Act::Control(control)) => shared.push_control(control),
        Some(Act::Order(order)) => shared.order(order),
        Some(Act::Note(why)) => {
            let (t_s, is_told) = (
                model.t_s,
                model.notes.back().is_some_and(|note| note.text == why),
            );
            if !is_told {
                model.note(t_s, why.to_owned(), true);
            }
        }
    }
}

/// Reads every waiting key until the next frame is due.
///
/// # Errors
/// Fails if the terminal has closed; reading from it would make crossterm wait for ever.
fn take_keys(shared: &Shared, next: Instant) -> io::Result<()> {
    has_input(Duration::ZERO)?;
    loop {
        shared.mark_attended();
        while event::poll(Duration::ZERO)? {
            if let Event::Key(key) = event::read()? {
                take_key(shared, key);
            }
        }
        let rest = next.saturating_duration_since(Instant::now());
        if rest.is_zero() || !has_input(rest)? {
            return Ok(());
        }
    }
}
