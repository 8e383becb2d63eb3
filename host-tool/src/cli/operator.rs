//! The operator of an experiment: a person at the terminal, or nobody.

use super::Bar;
use super::typed::{Closed, TypedLines};
use host_core::link::Interruption;
use std::time::{Duration, Instant};
use studies::laboratory::Operator;

/// Operator of an experiment: the person who typed the command.
pub(super) struct TerminalOperator<'a> {
    pub bar: &'a Bar,
    /// Whether the device is a board. Only then are the protocol's prompts shown and its rests
    /// waited for.
    pub is_board: bool,
    /// Share of the progress bar that the protocol fills, 0 to 1.
    pub part: f64,
    pub interruption: Interruption,
    pub typed: Option<TypedLines>,
}

impl Operator for TerminalOperator<'_> {
    fn ready(&mut self, text: &str) -> bool {
        if self.is_board {
            eprintln!("{text}");
            eprintln!("Press Enter to continue; type anything and press Enter to end");
            let typed = self.typed.get_or_insert_with(TypedLines::start);
            typed.discard();
            while self.interruption.received_signal().is_none() {
                match typed.next_line() {
                    Ok(None) => std::thread::sleep(Duration::from_millis(50)),
                    Ok(Some(line)) => return line.trim().is_empty(),
                    Err(Closed) => return false,
                }
            }
        }
        self.interruption.received_signal().is_none()
    }

    fn rest(&mut self, rest_s: f64) -> bool {
        let until = Instant::now() + Duration::from_secs_f64(rest_s);
        if self.is_board {
            eprintln!("{rest_s} s of rest");
        }
        while self.is_board
            && Instant::now() < until
            && self.interruption.received_signal().is_none()
        {
            std::thread::sleep(Duration::from_millis(50));
        }
        self.interruption.received_signal().is_none()
    }

    fn progress(&mut self, part: f64) {
        self.bar.set(self.part * part);
    }

    fn interruption(&self) -> Interruption {
        self.interruption.clone()
    }
}
