//! Serves gdb's remote protocol for a board, as debug probes do.
//!
//! In: clients at a port, of which one at a time is attached. Out: a [`Device`] whose time stands
//! still while a client has halted the core. The core halts at reset and waits for the first
//! client. It stops at breakpoints, watchpoints, BKPT, Ctrl-C, and where the simulator cannot
//! continue; in that case it prints the reason. Reading memory has no side effects.

mod command;
mod line;
mod memory;
mod monitor;
mod obey;
mod packet;
mod points;
mod refused;
mod registers;
#[cfg(test)]
mod tests;

pub use line::{Line, Port};
pub use points::Points;

use super::Cycle;
use super::board::{BOOT_LIMIT, Board, BoardError, Surroundings};
use super::cpu::Stop;
use super::cpu::system::{WatchedAccess, WatchpointHit};
use crate::lockstep::Device;
use firmware::lockstep::{Sensors, Sink};
use firmware::units::Micros;
use line::Client;
use packet::hex;
use points::StopReason;
use std::io;
use std::time::Duration;

/// Behaviour of the board after its debugger has left.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AfterDebugger {
    /// The board waits for further debuggers: a halted core stays halted unless the last debugger
    /// detached; a killed program waits at its first instruction.
    Debugger,
    /// The board runs a session: the core continues alone, and killing the program ends the run.
    #[default]
    Nothing,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Core {
    Halted,
    Runs,
    Steps,
}

/// A board that a client at a port can debug with gdb's protocol. One client at a time is attached
/// to the core.
pub struct Debugger {
    board: Board<Points>,
    port: Box<dyn Port>,
    outlives: AfterDebugger,
    core: Core,
    /// Client that is attached to the core, or was attached and is still connected.
    client: Option<Client>,
    /// Clients that are connected but not attached.
    others: Vec<Client>,
    /// Reason why the core is halted: the answer to `?`.
    status: String,
    /// Address of the BKPT that stopped the core; when it resumes, the core continues behind this
    /// instruction.
    stopped_by: Option<u32>,
    /// Cycle from which on the core has run a session without a debugger; `None` while a debugger
    /// is attached, or if the port stays open.
    alone_since: Option<Cycle>,
}

/// Largest number of connections that wait without being attached. If there are more, the oldest is
/// dropped.
const MOST_OTHERS: usize = 8;
/// Interval at which the port is polled while the core is halted.
const LOOK: Duration = Duration::from_micros(200);
/// Interval at which the port is polled while the core is halted and no client is attached.
const LOOK_IDLY: Duration = Duration::from_millis(5);
/// Beginning of a stop reply: the program's only thread stopped with SIGTRAP.
const SIGTRAP: &str = "T05thread:1;";

impl Debugger {
    /// Creates a debugger that halts the core of `board` at reset until a client at `port` lets it
    /// run. `outlives` selects what happens when the debugger has left.
    pub fn new(port: impl Port + 'static, board: Board<Points>, outlives: AfterDebugger) -> Self {
        let mut board = board;
        board.cpu.system.set_debugger(true);
        Self {
            board,
            port: Box::new(port),
            outlives,
            core: Core::Halted,
            client: None,
            others: Vec::new(),
            status: SIGTRAP.to_owned(),
            stopped_by: None,
            alone_since: None,
        }
    }

    /// Boots as [`Board::boot`] does, controlled by the debugger. While a debugger is attached the
    /// image may take any time, and need not open a port; without one, the usual limit applies.
    ///
    /// # Errors
    /// Fails like [`Self::run_to`], and with E541 if no debugger is attached and the image opened
    /// no port.
    pub fn boot(&mut self, sensors: &Sensors) -> Result<(), BoardError> {
        loop {
            let begin = self.alone_since.max(self.board.last_reset());
            let end = self.alone_since.and(begin).map(|begin| begin + BOOT_LIMIT);
            if self.run(0, |board| board.boot_on(sensors, end))? {
                return Ok(());
            }
        }
    }

    /// Runs as [`Board::run_to`] does, controlled by the debugger.
    ///
    /// # Errors
    /// Fails if the core stopped while no debugger was attached, or the debugger ended the run.
    pub fn run_to(&mut self, cycle: Cycle) -> Result<(), BoardError> {
        self.run(cycle, |board| board.run_to(cycle))
    }

    /// Returns the board that is debugged.
    pub const fn board(&self) -> &Board<Points> {
        &self.board
    }

    /// Calls `act`, which runs the board, again after each stop until it succeeds, and serves the
    /// clients before each call. Once the core has reached `limit`, further commands wait for the
    /// next call of this function.
    fn run<T>(
        &mut self,
        limit: Cycle,
        mut act: impl FnMut(&mut Board<Points>) -> Result<T, BoardError>,
    ) -> Result<T, BoardError> {
        loop {
            self.serve(limit)?;
            let done = act(&mut self.board);
            self.print_console();
            match done {
                // Where the port stays open, the next debugger finds the core as it stopped.
                Err(BoardError::Stopped { stop, .. })
                    if self.is_attached() || self.outlives == AfterDebugger::Debugger =>
                {
                    self.stop(stop);
                }
                other => return other,
            }
        }
    }

    fn is_attached(&self) -> bool {
        self.client.as_ref().is_some_and(|client| !client.has_left)
    }

    /// Serves the clients at the port until the core may run, or has reached `limit`.
    fn serve(&mut self, limit: Cycle) -> Result<(), BoardError> {
        loop {
            let has_heard = self.listen()?;
            if self.core == Core::Halted {
                match self.is_attached() {
                    _ if has_heard => {}
                    true => std::thread::sleep(LOOK),
                    false => std::thread::sleep(LOOK_IDLY),
                }
            } else if limit > 0 && self.board.cpu.cycle >= limit {
                return Ok(());
            } else if self.board.observer.leaves {
                self.step_once();
            } else if self.core == Core::Runs {
                return Ok(());
            }
        }
    }

    /// Executes the first instruction after a resume, or the only one of a single step.
    fn step_once(&mut self) {
        self.board.observer.leaves = false;
        let done = self.board.step();
        self.print_console();
        match done {
            Err(BoardError::Stopped { stop, .. }) => self.stop(stop),
            _ if self.core == Core::Steps => self.halt(SIGTRAP.to_owned()),
            _ => {}
        }
    }

    /// Accepts clients and carries out their commands; returns whether anything arrived from a
    /// client.
    fn listen(&mut self) -> Result<bool, BoardError> {
        let mut has_heard = false;
        match self.port.accept() {
            Ok(None) => {}
            Ok(Some(line)) => {
                has_heard = true;
                if self.others.len() == MOST_OTHERS {
                    self.others.remove(0);
                }
                self.others.push(Client::new(line));
            }
            // No client is left that could let the core run.
            Err(_) if self.client.is_none() && self.others.is_empty() => self.detach(),
            Err(_) => {}
        }
        // Bytes are fetched first: a client that saw the attached one leave is served only after
        // that.
        for other in &mut self.others {
            other.fetch();
        }
        let stood = self.core == Core::Halted;
        has_heard |= self.listen_to_client()?;
        if !(stood && self.core != Core::Halted) {
            self.listen_to_others()?;
        }
        Ok(has_heard)
    }

    /// Carries out the attached client's commands, up to the first that lets the core run, so that
    /// the core runs before more is read. Returns whether anything arrived.
    fn listen_to_client(&mut self) -> Result<bool, BoardError> {
        let mut has_heard = false;
        let stood = self.core == Core::Halted;
        while let Some(client) = &mut self.client {
            match client.receive() {
                Ok(None) => break,
                Ok(Some(heard)) => self.handle_event(heard)?,
                Err(_) => self.lose_client(),
            }
            has_heard = true;
            if stood && self.core != Core::Halted {
                break;
            }
        }
        Ok(has_heard)
    }

    /// Attaches the first waiting client that sends a valid packet. A client that sends nothing may
    /// only be testing whether the port is open.
    fn listen_to_others(&mut self) -> Result<(), BoardError> {
        for mut other in std::mem::take(&mut self.others) {
            match other.parse() {
                Err(_) => {}
                Ok(None) if other.is_gone => {}
                Ok(None) => self.others.push(other),
                Ok(Some(_)) if self.is_attached() => {
                    let name = self.client.as_ref().map(Client::name).unwrap_or_default();
                    let words =
                        format!("E.{name} already debugs this chip; only one debugger can attach");
                    other.send(words.as_bytes());
                    self.others.push(other);
                }
                Ok(Some(heard)) => {
                    self.client = Some(other);
                    self.attach();
                    self.handle_event(heard)?;
                }
            }
        }
        Ok(())
    }

    /// Attaches the client, which halts the core.
    fn attach(&mut self) {
        self.board.cpu.system.set_debugger(true);
        self.clear_debugger_state();
        self.alone_since = None;
        self.core = Core::Halted;
        self.status = SIGTRAP.to_owned();
        if let Some(client) = &mut self.client {
            client.has_left = false;
        }
    }

    /// Removes breakpoints, watchpoints and semihosting of the previous debugger.
    fn clear_debugger_state(&mut self) {
        self.clear_points();
        self.board.cpu.system.semihosting = None;
    }

    fn clear_points(&mut self) {
        self.board.observer.clear();
        self.board.cpu.system.clear_watchpoints();
    }

    /// Lets the core continue without a debugger.
    fn detach(&mut self) {
        self.clear_debugger_state();
        self.board.cpu.system.set_debugger(false);
        self.pass_breakpoint_instruction();
        self.core = Core::Runs;
        let is_session = self.outlives == AfterDebugger::Nothing;
        self.alone_since = is_session.then_some(self.board.cpu.cycle);
    }

    /// Handles a connection that closed without a detach.
    fn lose_client(&mut self) {
        let had_core = self.is_attached();
        self.client = None;
        if !had_core {
            return;
        }
        match (self.outlives, self.core) {
            (AfterDebugger::Debugger, Core::Halted) => self.clear_debugger_state(),
            _ => self.detach(),
        }
    }

    /// Halts the core after `stop` and reports the reason. Prints it in words if a signal number
    /// does not say enough.
    fn stop(&mut self, stop: Stop) {
        let status = match stop {
            Stop::Breakpoint { pc } => self.breakpoint_status(pc),
            Stop::Watchpoint { hit, .. } => describe_hit(hit),
            Stop::BreakpointInstruction { pc } => {
                self.stopped_by = Some(pc);
                SIGTRAP.to_owned()
            }
            Stop::Exit(status) => format!("W{:02x}", status as u8),
            _ => {
                let function = self.board.image().symbols.describe(self.board.pc());
                if self.client.as_ref().is_some_and(|client| client.waits) {
                    self.print(&format!("{stop} (in {function})\n"));
                }
                format!("T{:02x}thread:1;", signal(stop))
            }
        };
        self.halt(status);
    }

    fn breakpoint_status(&self, pc: u32) -> String {
        let knows = self
            .client
            .as_ref()
            .map_or([false; 2], |client| client.knows_breaks);
        match (self.board.observer.at(pc), knows) {
            (Some(StopReason::Software), [true, _]) => format!("{SIGTRAP}swbreak:;"),
            (Some(StopReason::Hardware), [_, true]) => format!("{SIGTRAP}hwbreak:;"),
            _ => SIGTRAP.to_owned(),
        }
    }

    /// Moves the core behind a BKPT that stopped it and would stop it again for ever. Returns
    /// whether there was such a BKPT.
    fn pass_breakpoint_instruction(&mut self) -> bool {
        let pc = self.board.pc();
        let is_there = self.stopped_by.take() == Some(pc);
        if is_there {
            self.board.cpu.registers.r[15] = pc.wrapping_add(2);
        }
        is_there
    }

    /// Halts the core, and sends the stop reply `status` to a client that waits for it.
    fn halt(&mut self, status: String) {
        self.core = Core::Halted;
        self.status = status;
        if self.client.as_ref().is_some_and(|client| client.waits) {
            self.send_status();
        }
        if let Some(client) = &mut self.client {
            client.waits = false;
        }
    }

    fn send(&mut self, contents: &[u8]) {
        if let Some(client) = &mut self.client {
            client.send(contents);
        }
    }

    fn send_status(&mut self) {
        let status = self.status.clone();
        self.send(status.as_bytes());
    }

    /// Prints `text` in the client's console with the protocol's O packet.
    fn print(&mut self, text: &str) {
        if !text.is_empty() {
            self.send(format!("O{}", hex(text.as_bytes())).as_bytes());
        }
    }

    /// Prints the program's semihosting output in the client's console. The protocol allows this
    /// only while the client waits for a stop reply.
    fn print_console(&mut self) {
        let waits = self.client.as_ref().is_some_and(|client| client.waits);
        if let Some(host) = &mut self.board.cpu.system.semihosting
            && waits
            && !host.console.is_empty()
        {
            let text = std::mem::take(&mut host.console);
            for part in text.chunks(packet::LONGEST / 2 - 1) {
                self.send(format!("O{}", hex(part)).as_bytes());
            }
        }
    }
}

fn describe_hit(hit: WatchpointHit) -> String {
    let reason = match hit.what {
        WatchedAccess::Writes => "watch",
        WatchedAccess::Reads => "rwatch",
        WatchedAccess::Accesses => "awatch",
    };
    format!("{SIGTRAP}{reason}:{:x};", hit.address)
}

/// Returns gdb's signal number for `stop`.
const fn signal(stop: Stop) -> u8 {
    match stop {
        Stop::Access { .. } => 10,     // SIGBUS
        Stop::Instruction { .. } => 4, // SIGILL
        Stop::LockUp { .. } => 11,     // SIGSEGV
        _ => 6,                        // SIGABRT
    }
}

impl AsMut<Surroundings> for Debugger {
    fn as_mut(&mut self) -> &mut Surroundings {
        &mut self.board.around
    }
}

impl Device for Debugger {
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
