//! The thread at the terminal: frames out. It is not waited for, however slow it is.

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

/// From one try to write to the next.
const RETRY: Duration = Duration::from_millis(2);

/// Tries after which a terminal that takes nothing shows nothing, or is left as it is.
const TRIES: u32 = 50;

fn lock_terminal(sitting: &Mutex<SharedTerminal>) -> MutexGuard<'_, SharedTerminal> {
    sitting.lock().unwrap_or_else(PoisonError::into_inner)
}

/// What is to be written.
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

/// The terminal in raw mode, on its alternate screen, as long as this lives.
pub struct RawTerminal {
    bytes: Bytes,
    terminal: Terminal<CrosstermBackend<Bytes>>,
}

impl RawTerminal {
    /// Takes the terminal.
    ///
    /// # Errors
    /// It cannot be taken.
    pub fn open() -> io::Result<Self> {
        let mut bytes = Bytes::default();
        let terminal = Terminal::new(CrosstermBackend::new(bytes.clone()))?;
        queue!(bytes, EnterAlternateScreen, EnableBracketedPaste)?;
        enable_raw_mode()?;
        install_panic_hook(restore_terminal);
        Ok(Self { bytes, terminal })
    }

    /// Draws until `is_over`, at the pace of the terminal. Afterwards nobody sits at it.
    ///
    /// # Errors
    /// The terminal fails. One that has gone is no error: it is noted.
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

    /// Draws what there is, and says that it is shown before its last bytes are written.
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
                // Whoever is at the device ends it.
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

/// Gives the terminal back as it was, if it is still there.
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
