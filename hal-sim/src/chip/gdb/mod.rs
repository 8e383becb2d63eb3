//! A board under a debugger: a server of gdb's remote protocol, as probes have it.
//!
//! In: clients at a port, one at a time, who come and go. Out: a [`Device`] whose time stands
//! still while one has the core. The core halts at reset and waits for the first; it stops at
//! breakpoints, watched data, BKPT, Ctrl-C, and where the simulator knows no further, which it
//! says in words. Memory is read without side effects.

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

/// What becomes of the board when its debugger has gone.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AfterDebugger {
    /// It is served to others: a core that was halted waits for the next debugger, unless the
    /// last one detached; a killed program waits at its first instruction.
    Debugger,
    /// It has a session to go through: the core goes on alone; killing it ends the run.
    #[default]
    Nothing,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Core {
    Halted,
    Runs,
    Steps,
}

/// A board that whoever comes to a port debugs.
pub struct Debugger {
    board: Board<Points>,
    port: Box<dyn Port>,
    outlives: AfterDebugger,
    core: Core,
    /// It has the core, or had it and has not gone yet.
    client: Option<Client>,
    /// They are connected, and not attached.
    others: Vec<Client>,
    /// Why the core stands: what `?` is answered.
    status: String,
    /// The BKPT that stopped the core, which goes on behind it.
    stopped_by: Option<u32>,
    /// Since when the core goes through a session with nobody attached.
    alone_since: Option<Cycle>,
}

/// Most connections that wait without being attached: the oldest makes room.
const MOST_OTHERS: usize = 8;
/// How often the port is looked at while the core is halted.
const LOOK: Duration = Duration::from_micros(200);
/// The same while nobody is attached.
const LOOK_IDLY: Duration = Duration::from_millis(5);
/// Of the only thread that there is.
const SIGTRAP: &str = "T05thread:1;";

impl Debugger {
    /// `board`'s core is halted at reset until someone comes to `port` and lets it run.
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

    /// [`Board::boot`], as the debugger lets it, and however long the image takes: one that
    /// opens no port is debugged all the same. Alone it has as long as without a debugger.
    ///
    /// # Errors
    /// As [`Self::run_to`]; E541: it was left alone and opened no port.
    pub fn boot(&mut self, sensors: &Sensors) -> Result<(), BoardError> {
        loop {
            let begin = self.alone_since.max(self.board.last_reset());
            let end = self.alone_since.and(begin).map(|begin| begin + BOOT_LIMIT);
            if self.run(0, |board| board.boot_on(sensors, end))? {
                return Ok(());
            }
        }
    }

    /// [`Board::run_to`], as the debugger lets it.
    ///
    /// # Errors
    /// The core stopped with nobody attached, or the debugger ended the run.
    pub fn run_to(&mut self, cycle: Cycle) -> Result<(), BoardError> {
        self.run(cycle, |board| board.run_to(cycle))
    }

    /// The board.
    pub const fn board(&self) -> &Board<Points> {
        &self.board
    }

    /// Does `act`, again and again while something stops it; once `limit` is reached, what
    /// the debugger wants next waits for the next call.
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

    /// Serves the port until the core may run.
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

    /// The first instruction since the core was let go, or the only one.
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

    /// Lets clients in, and does what they ask. Whether anything came.
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
            // Nobody is left to let the core go.
            Err(_) if self.client.is_none() && self.others.is_empty() => self.detach(),
            Err(_) => {}
        }
        // Fetched first: whoever saw the client leave is heard after it has left.
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

    /// Does what the client asks that has the core, up to what lets the core go: it runs before
    /// more is heard. Whether anything came.
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

    /// Who has said nothing that the protocol knows only looks whether the port is open. The
    /// first who does is attached.
    fn listen_to_others(&mut self) -> Result<(), BoardError> {
        for mut other in std::mem::take(&mut self.others) {
            match other.parse() {
                Err(_) => {}
                Ok(None) if other.is_gone => {}
                Ok(None) => self.others.push(other),
                Ok(Some(_)) if self.is_attached() => {
                    let name = self.client.as_ref().map(Client::name).unwrap_or_default();
                    let words = format!("E.{name} debugs this chip: one debugger at a time");
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

    /// A debugger halts the core as it comes.
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

    /// What one debugger wanted is not the next one's.
    fn clear_debugger_state(&mut self) {
        self.clear_points();
        self.board.cpu.system.semihosting = None;
    }

    fn clear_points(&mut self) {
        self.board.observer.clear();
        self.board.cpu.system.clear_watchpoints();
    }

    /// Nobody debugs the chip any more, and it goes on alone.
    fn detach(&mut self) {
        self.clear_debugger_state();
        self.board.cpu.system.set_debugger(false);
        self.pass_breakpoint_instruction();
        self.core = Core::Runs;
        let is_session = self.outlives == AfterDebugger::Nothing;
        self.alone_since = is_session.then_some(self.board.cpu.cycle);
    }

    /// The client is gone without a word.
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

    /// The core stopped: says why, in words where numbers do not tell.
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

    /// A BKPT that stopped the core would stop it for ever: it goes on behind it. Whether there
    /// was one.
    fn pass_breakpoint_instruction(&mut self) -> bool {
        let pc = self.board.pc();
        let is_there = self.stopped_by.take() == Some(pc);
        if is_there {
            self.board.cpu.registers.r[15] = pc.wrapping_add(2);
        }
        is_there
    }

    /// The core is halted, and whoever waits for that is told.
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

    /// Prints `text` in the client's console: the protocol's O packet.
    fn print(&mut self, text: &str) {
        if !text.is_empty() {
            self.send(format!("O{}", hex(text.as_bytes())).as_bytes());
        }
    }

    /// Prints what the program wrote by semihosting, as soon as the client may be told.
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
    let what = match hit.what {
        WatchedAccess::Writes => "watch",
        WatchedAccess::Reads => "rwatch",
        WatchedAccess::Accesses => "awatch",
    };
    format!("{SIGTRAP}{what}:{:x};", hit.address)
}

/// gdb's number of the signal that says what `stop` is.
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
