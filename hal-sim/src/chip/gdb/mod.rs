//! A board under gdb: the core halts at reset, steps, stops at breakpoints,
//! on Ctrl-C and where the simulator knows no further, which it tells in words.
//!
//! In: gdb's remote protocol over TCP. Out: a [`Device`] whose time stands
//! still while gdb has the core. Memory is read without side effects.
//! Registers and memory map: `registers`, `target`.

mod registers;
mod target;
#[cfg(test)]
mod tests;

pub use target::Points;

use super::Cycle;
use super::board::{Around, Board, BoardError};
use super::cpu::Stop;
use crate::lockstep::Device;
use crate::wire::keepalive;
use firmware::lockstep::{Sensors, Sink};
use firmware::units::Micros;
use gdbstub::common::Signal;
use gdbstub::conn::Connection;
use gdbstub::stub::state_machine::GdbStubStateMachine;
use gdbstub::stub::{DisconnectReason, GdbStub, SingleThreadStopReason};
use std::io::{self, Read, Write};
use std::net::{TcpListener, TcpStream};

/// What gdb is at the other end of.
pub trait Line: Connection<Error = io::Error> {
    /// A byte; `None`: nothing is there now, and `wait` did not ask to wait for it.
    ///
    /// # Errors
    /// gdb is gone.
    fn read(&mut self, wait: bool) -> io::Result<Option<u8>>;
}

/// A socket that is looked at without waiting, and written to with.
pub struct Socket(TcpStream);

impl Line for Socket {
    fn read(&mut self, wait: bool) -> io::Result<Option<u8>> {
        let mut byte = [0];
        self.0.set_nonblocking(!wait)?;
        let read = self.0.read(&mut byte);
        self.0.set_nonblocking(false)?;
        match read {
            Ok(0) => Err(io::ErrorKind::ConnectionReset.into()),
            Ok(_) => Ok(Some(byte[0])),
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => Ok(None),
            Err(error) => Err(error),
        }
    }
}

impl Connection for Socket {
    type Error = io::Error;

    fn write(&mut self, byte: u8) -> io::Result<()> {
        Write::write_all(&mut self.0, &[byte])
    }

    fn write_all(&mut self, bytes: &[u8]) -> io::Result<()> {
        Write::write_all(&mut self.0, bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Write::flush(&mut self.0)
    }

    fn on_session_start(&mut self) -> io::Result<()> {
        self.0.set_nodelay(true)
    }
}

type State<L> = GdbStubStateMachine<'static, Board<Points>, L>;

/// A board that gdb holds until it lets go.
pub struct Debugger<L: Line = Socket> {
    board: Board<Points>,
    /// `None` once gdb has left: the core runs on alone.
    gdb: Option<State<L>>,
    killed: bool,
}

impl Debugger<Socket> {
    /// Waits for gdb at `listener`, with `board`'s core halted at reset. A gdb whose computer
    /// vanishes is taken for one that has left ([`keepalive::watch`]).
    ///
    /// # Errors
    /// gdb is gone.
    pub fn accept(listener: &TcpListener, board: Board<Points>) -> io::Result<Self> {
        let (stream, _) = listener.accept()?;
        keepalive::watch(&stream)?;
        Self::attach(Socket(stream), board)
    }
}

impl<L: Line + 'static> Debugger<L> {
    /// gdb is at the other end of `line`, and `board`'s core halted at reset.
    ///
    /// # Errors
    /// gdb is gone.
    pub fn attach(line: L, mut board: Board<Points>) -> io::Result<Self> {
        board.cpu.system.set_debugger(true);
        let stub = GdbStub::new(line);
        let gdb = stub.run_state_machine(&mut board);
        let gdb = gdb.map_err(|error| io::Error::other(format!("gdb: {error}")))?;
        Ok(Self {
            board,
            gdb: Some(gdb),
            killed: false,
        })
    }

    /// [`Board::boot`], as gdb lets it.
    pub fn boot(&mut self, sensors: &Sensors) -> Result<(), BoardError> {
        while !self.run(0, |board| board.boot_on(sensors))? {}
        Ok(())
    }

    /// [`Board::run_to`], as gdb lets it.
    ///
    /// # Errors
    /// The core stopped without gdb to tell, or gdb ended the run.
    pub fn run_to(&mut self, cycle: Cycle) -> Result<(), BoardError> {
        self.run(cycle, |board| board.run_to(cycle))
    }

    /// The board.
    pub const fn board(&self) -> &Board<Points> {
        &self.board
    }

    /// Does `act`, again and again while gdb stops it; steps on gdb's behalf
    /// end at `limit`.
    fn run<T>(
        &mut self,
        limit: Cycle,
        mut act: impl FnMut(&mut Board<Points>) -> Result<T, BoardError>,
    ) -> Result<T, BoardError> {
        loop {
            self.poll(limit);
            if self.killed {
                return Err(BoardError::Killed);
            }
            match act(&mut self.board) {
                Err(BoardError::Stopped { stop, .. }) if self.gdb.is_some() => {
                    self.report_stop(stop)
                }
                other => return other,
            }
        }
    }

    /// Serves gdb while it has the core.
    fn poll(&mut self, limit: Cycle) {
        while let Some(gdb) = self.gdb.take() {
            if matches!(gdb, State::Running(_)) && self.board.observer.leaves {
                self.gdb = Some(gdb);
                self.board.observer.leaves = false;
                if let Err(BoardError::Stopped { stop, .. }) = self.board.step() {
                    self.report_stop(stop);
                } else if self.board.observer.steps {
                    self.report(SingleThreadStopReason::DoneStep);
                }
                continue;
            }
            match self.serve(gdb) {
                Ok(Served::Runs(gdb)) => {
                    self.gdb = Some(gdb);
                    return;
                }
                Ok(Served::Holds(gdb)) => self.gdb = Some(gdb),
                // Gone: breakpoints of nobody hold nothing.
                Ok(Served::Left) | Err(_) => {
                    self.board.observer = Points::default();
                    self.board.cpu.system.set_debugger(false);
                }
            }
            if self.board.cpu.cycle >= limit && limit > 0 && self.is_stepping() {
                return;
            }
        }
    }

    fn is_stepping(&self) -> bool {
        matches!(self.gdb, Some(State::Running(_))) && self.board.observer.steps
    }

    /// One byte from gdb.
    fn serve(&mut self, gdb: State<L>) -> Result<Served<L>, Box<dyn std::error::Error>> {
        let board = &mut self.board;
        let gdb = match gdb {
            State::Idle(mut idle) => match idle.borrow_conn().read(true)? {
                Some(byte) => idle.incoming_data(board, byte)?,
                None => idle.into(),
            },
            State::Running(mut running) => match running.borrow_conn().read(false)? {
                Some(byte) => running.incoming_data(board, byte)?,
                None => return Ok(Served::Runs(running.into())),
            },
            State::CtrlCInterrupt(inner) => {
                let reason = SingleThreadStopReason::Signal(Signal::SIGINT);
                inner.interrupt_handled(board, Some(reason))?
            }
            State::Disconnected(inner) => {
                self.killed = inner.get_reason() == DisconnectReason::Kill;
                return Ok(Served::Left);
            }
        };
        Ok(Served::Holds(gdb))
    }

    /// Tells gdb that the core stopped, and why, if that needs words.
    fn report_stop(&mut self, stop: Stop) {
        let reason = match stop {
            Stop::Breakpoint { .. } => SingleThreadStopReason::SwBreak(()),
            Stop::Exit(status) => SingleThreadStopReason::Exited(status as u8),
            _ => {
                let function = self.board.image().symbols.describe(self.board.pc());
                self.print(&format!("{stop} (in {function})\n"));
                SingleThreadStopReason::Signal(signal(stop))
            }
        };
        self.report(reason);
    }

    fn report(&mut self, reason: SingleThreadStopReason<u32>) {
        self.gdb = match self.gdb.take() {
            // An error: gdb is gone.
            Some(State::Running(running)) => running.report_stop(&mut self.board, reason).ok(),
            other => other,
        };
    }

    /// Prints `text` in gdb's console: the protocol's O packet.
    fn print(&mut self, text: &str) {
        if let Some(State::Running(running)) = &mut self.gdb {
            let hex: String = text.bytes().map(|byte| format!("{byte:02x}")).collect();
            let sum = hex.bytes().fold(b'O', u8::wrapping_add);
            // A line that is broken shows when the stop is reported.
            let _ = running
                .borrow_conn()
                .write_all(format!("$O{hex}#{sum:02x}").as_bytes());
        }
    }
}

/// What came of a byte.
enum Served<L: Line> {
    /// The core may run, and nothing is there to be read.
    Runs(State<L>),
    /// There may be more.
    Holds(State<L>),
    /// gdb has let go.
    Left,
}

const fn signal(stop: Stop) -> Signal {
    match stop {
        Stop::Access { .. } => Signal::SIGBUS,
        Stop::Instruction { .. } => Signal::SIGILL,
        Stop::LockUp { .. } => Signal::SIGSEGV,
        _ => Signal::SIGABRT,
    }
}

impl<L: Line> AsMut<Around> for Debugger<L> {
    fn as_mut(&mut self) -> &mut Around {
        &mut self.board.around
    }
}

impl<L: Line + Send + 'static> Device for Debugger<L> {
    fn receive(
        &mut self,
        at: Micros,
        bytes: &[u8],
        sensors: &Sensors,
        sink: &mut dyn Sink,
    ) -> io::Result<()> {
        self.advance(at, sensors, sink)?;
        self.board.receive(at, bytes, sensors, sink)
    }

    fn advance(&mut self, to: Micros, sensors: &Sensors, sink: &mut dyn Sink) -> io::Result<()> {
        let ahead = (to - Micros::new(self.board.now_us() as u32)).us().max(0);
        let end = self.board.now_us() + u64::from(ahead.cast_unsigned());
        let limit = self.board.around.cycle_of(end);
        self.run(limit, |board| board.resume(to, sensors))?;
        self.board.emit(sink);
        Ok(())
    }
}
