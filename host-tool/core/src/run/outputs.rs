//! Hands over the output of a simulated device while a session runs. Nothing is kept for long, so
//! that a day's session needs no more memory than a minute's.

use super::trial::{edge, longest_period_us};
use crate::record::{Edge, RecordError};
use crate::session::Session;
use hal_sim::trace::{Trace, Vcd};
use std::fs::File;
use std::io;
use std::path::PathBuf;

/// Receives the output of a simulated device in pieces, in the order of time, while a session runs.
pub trait Outputs {
    /// Receives the next piece of the output. `epoch_us` is the device time at which the trains
    /// began, µs.
    fn receive(&mut self, piece: &Trace, epoch_us: u64);

    /// Receives the end of the output, which lasted until the device time `now_us`, µs.
    fn end(&mut self, now_us: u64);
}

impl<T: Outputs + ?Sized> Outputs for &mut T {
    fn receive(&mut self, piece: &Trace, epoch_us: u64) {
        (**self).receive(piece, epoch_us);
    }

    fn end(&mut self, now_us: u64) {
        (**self).end(now_us);
    }
}

impl<A: Outputs, B: Outputs> Outputs for (A, B) {
    fn receive(&mut self, piece: &Trace, epoch_us: u64) {
        self.0.receive(piece, epoch_us);
        self.1.receive(piece, epoch_us);
    }

    fn end(&mut self, now_us: u64) {
        self.0.end(now_us);
        self.1.end(now_us);
    }
}

impl<T: Outputs> Outputs for Option<T> {
    fn receive(&mut self, piece: &Trace, epoch_us: u64) {
        self.iter_mut()
            .for_each(|output| output.receive(piece, epoch_us));
    }

    fn end(&mut self, now_us: u64) {
        self.iter_mut().for_each(|output| output.end(now_us));
    }
}

/// Returns the edges of one period of `session` from a complete trace, chosen as [`FullestPeriod`]
/// does it. Their times are in µs since the start of that period. The period begins at least
/// `after_us` after the start of the trains, which was at the device time `epoch_us`.
#[must_use]
pub fn edges_of_one_period(
    session: &Session,
    trace: &Trace,
    epoch_us: u64,
    after_us: u64,
) -> Vec<Edge> {
    let mut fullest = FullestPeriod::new(session, after_us);
    fullest.receive(trace, epoch_us);
    fullest.into_edges()
}

/// Selects the edges of one period from the output of a device. A period is as long as the longest
/// period of the session's channels. Of all periods after a given time, it selects the first one in
/// which the largest number of channels outputs pulses.
#[derive(Clone, Debug)]
pub struct FullestPeriod {
    period_us: u64,
    after_us: u64,
    /// Period whose edges are being received: its number, counted from `after_us`, a mask with one
    /// bit for each channel that has output a pulse, and the edges so far.
    now: (u64, u16, Vec<Edge>),
    fullest: Option<(u32, Vec<Edge>)>,
}

impl FullestPeriod {
    /// Creates a collector for the periods of `session` from `after_us` after the start of the
    /// trains on. That time is rounded down to a whole number of periods.
    #[must_use]
    pub fn new(session: &Session, after_us: u64) -> Self {
        let period_us = longest_period_us(session);
        Self {
            period_us,
            after_us: after_us / period_us * period_us,
            now: (0, 0, Vec::new()),
            fullest: None,
        }
    }

    /// Returns the edges of the selected period. Their times are in µs since the start of that
    /// period.
    #[must_use]
    pub fn into_edges(mut self) -> Vec<Edge> {
        self.close_period();
        self.fullest.map(|(_, edges)| edges).unwrap_or_default()
    }

    fn close_period(&mut self) {
        let (_, playing, edges) = std::mem::take(&mut self.now);
        let count = playing.count_ones();
        if self.fullest.as_ref().is_none_or(|(most, _)| count > *most) {
            self.fullest = Some((count, edges));
        }
    }
}

impl Outputs for FullestPeriod {
    fn receive(&mut self, piece: &Trace, epoch_us: u64) {
        let begin_us = epoch_us + self.after_us;
        for item in piece.edges_from(begin_us) {
            let number = (item.t_us - begin_us) / self.period_us;
            if number != self.now.0 {
                self.close_period();
                self.now.0 = number;
            }
            if item.state.is_driven() && item.dac_code > 0 {
                self.now.1 |= 1 << item.channel;
            }
            let from_us = begin_us + number * self.period_us;
            self.now.2.push(edge(item, from_us));
        }
    }

    fn end(&mut self, _: u64) {}
}

/// Writes the output of a device to a VCD file (value change dump, IEEE 1364). After the first
/// write error it writes nothing more, and [`Self::close`] returns that error.
pub struct Dump {
    path: PathBuf,
    /// Open file, or the first error; `None` until the first piece of output arrives.
    vcd: Option<io::Result<Vcd<File>>>,
    end_us: u64,
}

impl Dump {
    /// Creates a dump to the file at `path`. The file is created or replaced when the first piece
    /// of output arrives.
    #[must_use]
    pub const fn new(path: PathBuf) -> Self {
        Self {
            path,
            vcd: None,
            end_us: 0,
        }
    }

    /// Ends the file with a time stamp for the end of the output.
    ///
    /// # Errors
    /// The file could not be written completely.
    pub fn close(self) -> Result<(), RecordError> {
        let closed = self.vcd.map_or(Ok(()), |vcd| vcd?.end(self.end_us));
        closed.map_err(RecordError::write(&self.path))
    }
}

impl Outputs for Dump {
    fn receive(&mut self, piece: &Trace, _: u64) {
        let path = &self.path;
        let begin = || File::create(path).and_then(Vcd::begin);
        let vcd = self.vcd.get_or_insert_with(begin);
        if let Ok(open) = vcd
            && let Err(why) = open.append(piece)
        {
            *vcd = Err(why);
        }
    }

    fn end(&mut self, now_us: u64) {
        self.end_us = now_us;
    }
}
