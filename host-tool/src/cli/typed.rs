//! Reads typed lines while the program continues.

use std::io::BufRead;
use std::sync::mpsc::{Receiver, TryRecvError, channel};

/// Lines of the standard input, read by a separate thread, so that a waiting program still handles
/// signals and sends keep-alives.
pub struct TypedLines(Receiver<String>);

impl TypedLines {
    /// Starts to read.
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

    /// Discards everything typed so far, so that it does not answer the next question.
    pub fn discard(&self) {
        while self.0.try_recv().is_ok() {}
    }

    /// Returns the next line, if there is one.
    ///
    /// # Errors
    /// Returns [`Closed`] if the input has ended.
    pub fn next_line(&self) -> Result<Option<String>, Closed> {
        match self.0.try_recv() {
            Ok(line) => Ok(Some(line)),
            Err(TryRecvError::Empty) => Ok(None),
            Err(TryRecvError::Disconnected) => Err(Closed),
        }
    }
}

/// The end of the input.
pub struct Closed;
