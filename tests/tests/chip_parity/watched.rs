//! A board on the chip simulator whose session owner is observed: the time at which bytes were
//! handed over, the time passed with them, and the time of completion.

use firmware::lockstep::{Sensors, Sink};
use firmware::units::{Micros, us};
use hal_sim::chip::board::{Board, BoardError, CYCLES_PER_US};
use hal_sim::chip::cpu::run::Observer;
use hal_sim::chip::cpu::{Size, Stop};
use hal_sim::chip::soc::{Pace, gpio::Level};
use hal_sim::lockstep::{Device, Output};
use tests::desk::flashed_image;

/// One call of `Session::receive`.
pub struct ReceiveCall {
    /// Time passed to the session.
    pub at: Micros,
    /// Time at which its last order or request was posted or, without any for the pulser or the
    /// controller, at which the call returned; µs of device time, rounded down.
    pub done: Micros,
    /// Bytes passed to the session.
    pub bytes: Vec<u8>,
}

/// Breakpoints at the start and end of `Session::receive`, and where an order in it begins and has
/// been posted. From there on, a refill that interrupts the call sees the order, and a control tick
/// the request.
#[derive(Clone)]
pub struct Gate {
    entry: u32,
    exit: Option<u32>,
    order: u32,
    request: u32,
    /// Return address of the current request.
    asked: Option<u32>,
    /// Start of the current order, and its queue.
    begun: (Micros, u32),
    posted: Option<u32>,
    has_posted: bool,
}

impl Observer for Gate {
    fn stops_before(&mut self, pc: u32) -> bool {
        [self.entry, self.order, self.request].contains(&pc)
            || [self.exit, self.posted, self.asked].contains(&Some(pc))
    }
}

/// Board, and the calls so far.
pub struct WatchedBoard {
    pub board: Board<Gate>,
    pub served: Vec<ReceiveCall>,
}

impl WatchedBoard {
    /// Boots a board with these breakpoints.
    pub fn boot(stages: [Option<Output>; 10], sensors: &Sensors, pace: Pace) -> Self {
        let image = flashed_image();
        let function = |name: &str| {
            let functions = image.symbols.functions().iter();
            let mut found = functions.filter(|f| f.name.ends_with(name));
            let address = found.next().expect(name).address;
            assert!(found.next().is_none(), "{name}");
            address
        };
        let gate = Gate {
            entry: function("session::Session::receive"),
            exit: None,
            order: function("session::requests::later"),
            request: function("session::submit"),
            asked: None,
            begun: (Micros::new(0), 0),
            posted: None,
            has_posted: false,
        };
        let mut board = Board::power_on(image, stages, pace, gate).unwrap();
        board.boot(sensors).unwrap_or_else(|e| panic!("{e}"));
        Self {
            board,
            served: Vec::new(),
        }
    }

    /// Advances time to `to_us`.
    pub fn advance(&mut self, to_us: u64, sensors: &Sensors, sink: &mut dyn Sink) {
        let mut sensors = *sensors;
        let trigger = sensors.trigger.take();
        self.step(self.board.now_us(), &sensors, sink);
        if let Some(at) = trigger {
            for (level, at) in [(Level::High, at), (Level::Low, at + us(2))] {
                self.step(at.get().into(), &sensors, sink);
                let (port, pin) = self.board.around.board().trigger;
                let cycle = self.board.cpu.cycle;
                let soc = &mut self.board.around.soc;
                soc.drive(port.index(), pin.into(), level, cycle).unwrap();
            }
        }
        self.step(to_us, &sensors, sink);
    }

    /// Writes `bytes` from the host now.
    pub fn send(&mut self, bytes: &[u8]) {
        let cycle = self.board.cpu.cycle;
        self.board.around.host.send(bytes, cycle);
        self.board.around.soc.reschedule();
    }

    fn step(&mut self, to_us: u64, sensors: &Sensors, sink: &mut dyn Sink) {
        let cycle = self.board.around.origin() + to_us * CYCLES_PER_US;
        loop {
            match self.board.run_to(cycle) {
                Ok(()) => break,
                Err(BoardError::Stopped {
                    stop: Stop::Breakpoint { pc },
                    ..
                }) => self.note(pc),
                Err(e) => panic!("{e}"),
            }
        }
        // The time is reached already; this only delivers outputs.
        let done = self.board.advance(Micros::new(to_us as u32), sensors, sink);
        done.unwrap_or_else(|e| panic!("{e}"));
    }

    fn note(&mut self, pc: u32) {
        let board = &mut self.board;
        let now = (board.cpu.cycle - board.around.origin()) / CYCLES_PER_US;
        let registers = &board.cpu.registers;
        // An exception may come between the breakpoint and the instruction.
        let before = board.cpu.instructions;
        let (exit, r) = (registers.r[14] & !1, registers.r);
        board.cpu.step(&mut board.around).unwrap();
        if board.cpu.instructions == before {
            return;
        }
        let gate = &mut board.observer;
        let soc = &board.around.soc;
        let read = |address, size| {
            let is_ccm = soc.ccm.contains(address);
            let ram = if is_ccm { &soc.ccm } else { &soc.ram };
            ram.read(address, size).unwrap()
        };
        let now = Micros::new(now as u32);
        if pc == gate.order {
            // The third argument is the mail, whose second slice is the queue of orders.
            gate.begun = (now, read(r[2] + 8, Size::Word));
            gate.posted = Some(exit);
        } else if Some(pc) == gate.posted {
            (gate.posted, gate.has_posted) = (None, true);
            // A queue begins with its two ends. If it is empty again, a refill between the order's
            // last word and the return has taken the order.
            let (begun, queue) = gate.begun;
            let is_taken = read(queue, Size::Word) == read(queue + 4, Size::Word);
            self.served.last_mut().unwrap().done = if is_taken { begun } else { now };
        } else if pc == gate.request {
            gate.asked = Some(exit);
        } else if Some(pc) == gate.asked {
            (gate.asked, gate.has_posted) = (None, true);
            self.served.last_mut().unwrap().done = now;
        } else if pc == gate.entry {
            self.served.push(ReceiveCall {
                at: Micros::new(r[1]),
                done: now,
                bytes: (0..r[3])
                    .map(|n| read(r[2] + n, Size::Byte) as u8)
                    .collect(),
            });
            (board.observer.exit, board.observer.has_posted) = (Some(exit), false);
        } else {
            if !gate.has_posted {
                self.served.last_mut().unwrap().done = now;
            }
            gate.exit = None;
        }
    }
}
