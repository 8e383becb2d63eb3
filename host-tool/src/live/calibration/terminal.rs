//! Runs the terminal's thread, which draws frames. No other thread waits for it.

use super::view::is_small;
use super::{SharedTerminal, draw_calibration};
use crate::live::screen::{FRAME, has_panicked, install_panic_hook};
use crate::live::stream::{AT_ONCE, discard_unread_output, write_available};
use crossterm::cursor::Show;
use crossterm::event::{DisableBracketedPaste, EnableBracketedPaste};
use crossterm::queue;
use crossterm::terminal::{
    EnterAlternateScreen, LeaveAlternateScreen, disable_raw_mode, enable_raw_mode,
};
use ratatui::Terminal;
use ratatui::backend::CrosstermBackend;
use std::cell::RefCell;
use std::io::{self, Write};
use std::rc::Rc;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Time between two attempts to write.
const RETRY: Duration = Duration::from_millis(2);

/// Number of failed attempts after which the terminal counts as blocked.
const TRIES: u32 = 50;

fn lock_terminal(sitting: &Mutex<SharedTerminal>) -> MutexGuard<'_, SharedTerminal> {
    sitting.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Buffer of the bytes to write.
#[derive(Clone, Default)]
struct Bytes(Rc<RefCell<Vec<u8>>>);

impl Write for Bytes {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.borrow_mut().extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// The terminal in raw mode on its alternate screen, until this value is dropped.
pub struct RawTerminal {
    bytes: Bytes,
    terminal: Terminal<CrosstermBackend<Bytes>>,
}

impl RawTerminal {
    /// Switches the terminal to raw mode and its alternate screen.
    ///
    /// # Errors
    /// Fails if the terminal cannot be switched.
    pub fn open() -> io::Result<Self> {
        let mut bytes = Bytes::default();
        let terminal = Terminal::new(CrosstermBackend::new(bytes.clone()))?;
        queue!(bytes, EnterAlternateScreen, EnableBracketedPaste)?;
        enable_raw_mode()?;
        install_panic_hook(restore_terminal);
        Ok(Self { bytes, terminal })
    }

    /// Draws until `is_over`, as fast as the terminal accepts, then marks the terminal as closed.
    ///
    /// # Errors
    /// Fails if drawing fails. A terminal that closes is noted instead.
    pub fn draw_until(
        &mut self,
        sitting: &Mutex<SharedTerminal>,
        is_over: impl Fn() -> bool,
    ) -> io::Result<()> {
        let mut drawn = Ok(());
        while drawn.is_ok() && !is_over() && !has_panicked() {
            drawn = self.draw(sitting, &is_over);
            std::thread::sleep(FRAME);
        }
        lock_terminal(sitting).mark_closed();
        drawn
    }

    /// Draws the present state, and marks it as shown before its last bytes are written.
    fn draw(
        &mut self,
        sitting: &Mutex<SharedTerminal>,
        is_over: impl Fn() -> bool,
    ) -> io::Result<()> {
        let (sight, number) = lock_terminal(sitting).snapshot();
        let drawn = (self.terminal).draw(|frame| draw_calibration(frame, &sight))?;
        let is_small = is_small(drawn.area);
        let mut bytes = std::mem::take(&mut *self.bytes.0.borrow_mut());
        let mut tries = 0;
        while !bytes.is_empty() && !is_over() {
            if bytes.len() <= AT_ONCE {
                lock_terminal(sitting).mark_shown(number, is_small);
            }
            let Ok(written) = write_available(&bytes) else {
                // The thread at the device then ends the calibration.
                lock_terminal(sitting).mark_closed();
                break;
            };
            bytes.drain(..written);
            if written == 0 {
                tries += 1;
                if tries >= TRIES {
                    lock_terminal(sitting).mark_hidden();
                }
                std::thread::sleep(RETRY);
            }
        }
        Ok(())
    }
}

impl Drop for RawTerminal {
    fn drop(&mut self) {
        if !has_panicked() {
            restore_terminal();
        }
        discard_unread_output(RETRY * TRIES);
    }
}

/// Restores the terminal, if it still exists.
fn restore_terminal() {
    let _ = disable_raw_mode();
    let mut bytes = Vec::new();
    if queue!(bytes, DisableBracketedPaste, LeaveAlternateScreen, Show).is_err() {
        return;
    }
    for _ in 0..TRIES {
        match write_available(&bytes) {
            Ok(written) => drop(bytes.drain(..written)),
            Err(_) => return,
        }
        if bytes.is_empty() {
            return;
        }
        std::thread::sleep(RETRY);
    }
}
