//! What somebody types, line by line, while the program goes on.

use std::io::BufRead;
use std::sync::mpsc::{Receiver, TryRecvError, channel};

/// Lines of the standard input, read by a thread of their own: whoever waits for one
/// still hears of a signal, and a device of its host.
pub struct TypedLines(Receiver<String>);

impl TypedLines {
    /// Reads from now on.
    pub fn start() -> Self {
        let (to, typed) = channel();
        std::thread::spawn(move || {
            let lines = std::io::stdin().lock().lines();
            lines
                .map_while(Result::ok)
                .all(|line| to.send(line).is_ok())
        });
        Self(typed)
    }

    /// Forgets what was typed so far: it is no answer to what is asked next.
    pub fn discard(&self) {
        while self.0.try_recv().is_ok() {}
    }

    /// The next line, if there is one.
    ///
    /// # Errors
    /// Nobody types any more.
    pub fn next_line(&self) -> Result<Option<String>, Closed> {
        match self.0.try_recv() {
            Ok(line) => Ok(Some(line)),
            Err(TryRecvError::Empty) => Ok(None),
            Err(TryRecvError::Disconnected) => Err(Closed),
        }
    }
}

/// The input has ended.
pub struct Closed;
