//! What a simulated device puts out, taken while a session runs: none of it is held
//! for long, so that a day's takes no more memory than a minute's.

use super::trial::{edge, longest_period_us};
use crate::record::{Edge, RecordError};
use crate::session::Session;
use hal_sim::trace::{Trace, Vcd};
use std::fs::File;
use std::io;
use std::path::PathBuf;

/// Takes what a simulated device puts out, piece by piece in order of time.
pub trait Outputs {
    /// The next piece; the trains began at `epoch_us` in its time.
    fn take(&mut self, piece: &Trace, epoch_us: u64);

    /// There is no other: the device's time is `now_us`.
    fn end(&mut self, now_us: u64);
}

impl<T: Outputs + ?Sized> Outputs for &mut T {
    fn take(&mut self, piece: &Trace, epoch_us: u64) {
        (**self).take(piece, epoch_us);
    }

    fn end(&mut self, now_us: u64) {
        (**self).end(now_us);
    }
}

impl<A: Outputs, B: Outputs> Outputs for (A, B) {
    fn take(&mut self, piece: &Trace, epoch_us: u64) {
        self.0.take(piece, epoch_us);
        self.1.take(piece, epoch_us);
    }

    fn end(&mut self, now_us: u64) {
        self.0.end(now_us);
        self.1.end(now_us);
    }
}

impl<T: Outputs> Outputs for Option<T> {
    fn take(&mut self, piece: &Trace, epoch_us: u64) {
        self.iter_mut()
            .for_each(|output| output.take(piece, epoch_us));
    }

    fn end(&mut self, now_us: u64) {
        self.iter_mut().for_each(|output| output.end(now_us));
    }
}

/// The edges of one period of `session` in a whole trace: see [`FullestPeriod`].
#[must_use]
pub fn edges_of_one_period(
    session: &Session,
    trace: &Trace,
    epoch_us: u64,
    after_us: u64,
) -> Vec<Edge> {
    let mut fullest = FullestPeriod::new(session, after_us);
    fullest.take(trace, epoch_us);
    fullest.edges()
}

/// The edges of one period, as long as the longest of a session's channels': the first
/// from some moment on in which as many channels play as in any.
#[derive(Clone, Debug)]
pub struct FullestPeriod {
    period_us: u64,
    after_us: u64,
    /// The period that goes on: its number from `after_us`, a bit for each channel that
    /// plays, its edges.
    now: (u64, u16, Vec<Edge>),
    fullest: Option<(u32, Vec<Edge>)>,
}

impl FullestPeriod {
    /// Of `session`, from `after_us` after the start of its trains.
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

    /// Its edges, with times counted from its start.
    #[must_use]
    pub fn edges(mut self) -> Vec<Edge> {
        self.close();
        self.fullest.map(|(_, edges)| edges).unwrap_or_default()
    }

    fn close(&mut self) {
        let (_, playing, edges) = std::mem::take(&mut self.now);
        let count = playing.count_ones();
        if self.fullest.as_ref().is_none_or(|(most, _)| count > *most) {
            self.fullest = Some((count, edges));
        }
    }
}

impl Outputs for FullestPeriod {
    fn take(&mut self, piece: &Trace, epoch_us: u64) {
        let begin_us = epoch_us + self.after_us;
        for item in piece.edges_from(begin_us) {
            let number = (item.t_us - begin_us) / self.period_us;
            if number != self.now.0 {
                self.close();
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

/// A file that grows with what is put out (IEEE 1364 value change dump). The first error
/// ends that, and is told when the file is closed.
pub struct Dump {
    path: PathBuf,
    /// From the first piece on.
    vcd: Option<io::Result<Vcd<File>>>,
    end_us: u64,
}

impl Dump {
    /// Replaces the file at `path` when the first piece comes.
    #[must_use]
    pub const fn at(path: PathBuf) -> Self {
        Self {
            path,
            vcd: None,
            end_us: 0,
        }
    }

    /// Ends it with the time stamp of the last moment.
    ///
    /// # Errors
    /// It could not be written as a whole.
    pub fn close(self) -> Result<(), RecordError> {
        let closed = self.vcd.map_or(Ok(()), |vcd| vcd?.end(self.end_us));
        closed.map_err(RecordError::write(&self.path))
    }
}

impl Outputs for Dump {
    fn take(&mut self, piece: &Trace, _: u64) {
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
