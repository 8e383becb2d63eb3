//! Another program orders: JSON lines on standard input and output.

use host_core::calibration::{Gone, Operator, Order, OrderError, Phase, Step, Told, View};
use host_core::calibration::{Level, Refusal};
use serde_json::{Value, json};
use std::io::{BufRead, Read, Write};
use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};
use std::thread::JoinHandle;

/// Longest line that is read, bytes: what is longer is no order.
const LONGEST: u64 = 16_384;

/// Lines in and out, each by a thread of its own: neither a program that is slow to read
/// nor one that is slow to write keeps the device waiting.
pub struct Lines {
    typed: Receiver<String>,
    told: Sender<String>,
    writer: JoinHandle<()>,
    shown: Option<Shown>,
}

/// What of a view is told again when it changes.
#[derive(Clone, PartialEq)]
struct Shown(
    usize,
    Step,
    Phase,
    Level,
    Option<Level>,
    Option<&'static str>,
    bool,
    bool,
);

impl Lines {
    /// Reads and writes from now on.
    pub fn begin() -> Self {
        let (to, typed) = channel();
        std::thread::spawn(move || {
            let mut stdin = std::io::stdin().lock();
            while let Some(line) = line(&mut stdin) {
                if to.send(line).is_err() {
                    break;
                }
            }
        });
        let (told, lines) = channel::<String>();
        let writer = std::thread::spawn(move || {
            let mut stdout = std::io::stdout();
            for line in lines {
                // A reader that has gone misses nothing that it wants.
                if writeln!(stdout, "{line}")
                    .and_then(|()| stdout.flush())
                    .is_err()
                {
                    break;
                }
            }
        });
        let shown = None;
        Self {
            typed,
            told,
            writer,
            shown,
        }
    }

    /// Waits until everything is written.
    pub fn end(self) {
        drop(self.told);
        // A thread that panicked has nothing more to write.
        let _ = self.writer.join();
    }

    fn say(&self, value: &Value) {
        let _ = self.told.send(value.to_string()); // nobody reads
    }
}

/// The next line, whatever is in it; nothing when the input has ended.
fn line(input: &mut impl BufRead) -> Option<String> {
    let mut bytes = Vec::new();
    let read = input.by_ref().take(LONGEST).read_until(b'\n', &mut bytes);
    if read.ok()? == 0 {
        return None;
    }
    while !bytes.ends_with(b"\n") && bytes.len() as u64 >= LONGEST {
        // The rest of what is too long is no order either.
        let mut rest = Vec::new();
        let read = input.by_ref().take(LONGEST).read_until(b'\n', &mut rest);
        if read.ok()? == 0 || rest.ends_with(b"\n") {
            break;
        }
    }
    Some(String::from_utf8_lossy(&bytes).trim_end().to_owned())
}

/// A view as a line, with what may be ordered.
fn view_line(view: &View) -> Value {
    let mut said = json!(view);
    said["event"] = "view".into();
    said["orders"] = json!(orders(view));
    said
}

/// What may be ordered at this sight, the always allowed apart.
fn orders(view: &View) -> Vec<&'static str> {
    let mut all = Vec::new();
    match (view.question, view.phase) {
        (Some(_), _) if view.step == Step::Points => all.push("moves"),
        (Some(_), _) => all.extend(["yes", "no"]),
        (None, Phase::Ready) => {
            all.extend(view.raise.map(|_| "raise"));
            all.extend(view.again.map(|_| "again"));
            all.extend((view.step == Step::Comfort).then_some("enough"));
        }
        _ => {}
    }
    all
}

fn refused(error: &str) -> Value {
    json!({ "event": "refused", "error": error })
}

impl Operator for Lines {
    fn order(&mut self, view: &View) -> Result<Option<Result<Order, OrderError>>, Gone> {
        let shown = Shown(
            view.electrode,
            view.step,
            view.phase,
            view.level,
            view.raise,
            view.question,
            view.is_rested,
            view.complains,
        );
        if self.shown.as_ref() != Some(&shown) {
            self.shown = Some(shown);
            self.say(&view_line(view));
        }
        match self.typed.try_recv() {
            Ok(line) => Ok(Some(Order::parse(&line))),
            Err(TryRecvError::Empty) => Ok(None),
            Err(TryRecvError::Disconnected) => Err(Gone),
        }
    }

    fn tell(&mut self, told: Told<'_>, view: &View) {
        let said = match told {
            Told::Recorded(entry) => {
                json!({ "event": "recorded", "t_s": view.t_s, "entry": entry })
            }
            Told::Refused(refusal) => refusal_line(refusal),
            Told::Nonsense(error) => refused(&error.to_string()),
            Told::Written => json!({ "event": "written" }),
        };
        self.say(&said);
    }
}

fn refusal_line(refusal: &Refusal) -> Value {
    refused(&refusal.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_line_is_read_whatever_is_in_it() {
        let long = "x".repeat(40_000);
        let text = format!("one\n\u{fffd}\n{long}\nlast");
        let mut input = std::io::Cursor::new(text.into_bytes());
        assert_eq!(line(&mut input).as_deref(), Some("one"));
        assert_eq!(line(&mut input).as_deref(), Some("\u{fffd}"));
        assert_eq!(line(&mut input).map(|it| it.len()), Some(16_384));
        assert_eq!(line(&mut input).as_deref(), Some("last"));
        assert_eq!(line(&mut input), None);
        let mut broken = std::io::Cursor::new(b"\xff\xfe\nnext\n".to_vec());
        assert!(Order::parse(&line(&mut broken).unwrap()).is_err());
        assert_eq!(line(&mut broken).as_deref(), Some("next"));
    }
}
