//! A board on the chip simulator whose session owner is watched: when bytes
//! were handed to it, what time it was told, and when it was done with them.

use firmware::device::lockstep::{Sensors, Sink};
use firmware::units::Micros;
use hal_sim::chip::board::{Board, BoardError, CYCLES_PER_US, wiring};
use hal_sim::chip::cpu::run::Observer;
use hal_sim::chip::cpu::{Size, Stop};
use hal_sim::chip::soc::{Pace, gpio::Level};
use hal_sim::lockstep::Device;
use hal_sim::world::Output;
use host_tool::run::chip_image;

/// One call of `Session::receive`.
pub struct Served {
    /// The time that the session was told.
    pub at: Micros,
    /// When the call returned, µs of device time, rounded down.
    pub done: Micros,
    /// What it was handed.
    pub bytes: Vec<u8>,
}

/// Stops where `Session::receive` begins and where the call under way ends.
pub struct Gate {
    entry: u32,
    exit: Option<u32>,
}

impl Observer for Gate {
    fn stops_before(&mut self, pc: u32) -> bool {
        pc == self.entry || Some(pc) == self.exit
    }
}

/// The board and the calls so far.
pub struct Watched {
    pub board: Board<Gate>,
    pub served: Vec<Served>,
}

impl Watched {
    /// A board that has booted.
    pub fn boot(stages: [Option<Output>; 10], sensors: &Sensors, pace: Pace) -> Self {
        let image = chip_image(None).unwrap_or_else(|e| panic!("{e}"));
        let functions = image.symbols.functions().iter();
        let mut receive = functions.filter(|f| f.name.ends_with("session::Session::receive"));
        let entry = receive.next().expect("the session's entry").address;
        assert!(receive.next().is_none());
        let gate = Gate { entry, exit: None };
        let mut board = Board::power_on(image, stages, pace, gate).unwrap();
        board.boot(sensors).unwrap_or_else(|e| panic!("{e}"));
        Self {
            board,
            served: Vec::new(),
        }
    }

    /// Time goes on to `to_us`.
    pub fn advance(&mut self, to_us: u64, sensors: &Sensors, sink: &mut dyn Sink) {
        let mut sensors = *sensors;
        let trigger = sensors.trigger.take();
        self.step(self.board.now_us(), &sensors, sink);
        if let Some(at) = trigger {
            for (level, at) in [(Level::High, at), (Level::Low, at.plus(2))] {
                self.step(at.0.into(), &sensors, sink);
                let (port, pin) = wiring::TRIGGER;
                let cycle = self.board.cpu.cycle;
                let soc = &mut self.board.around.soc;
                soc.drive(port.index(), pin.into(), level, cycle).unwrap();
            }
        }
        self.step(to_us, &sensors, sink);
    }

    /// The host writes `bytes` now.
    pub fn send(&mut self, bytes: &[u8]) {
        let cycle = self.board.cpu.cycle;
        self.board.around.host.send(bytes, cycle);
        self.board.around.soc.touch();
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
        // There already: only gives out.
        let done = self.board.advance(Micros(to_us as u32), sensors, sink);
        done.unwrap_or_else(|e| panic!("{e}"));
    }

    fn note(&mut self, pc: u32) {
        let board = &mut self.board;
        let now = (board.cpu.cycle - board.around.origin()) / CYCLES_PER_US;
        let registers = &board.cpu.registers;
        // An exception may come between the stop and the instruction.
        let (before, is_entry) = (board.cpu.instructions, pc == board.observer.entry);
        let (exit, r) = (registers.r[14] & !1, registers.r);
        board.cpu.step(&mut board.around).unwrap();
        if board.cpu.instructions == before {
            return;
        }
        if is_entry {
            let byte = |address| {
                let soc = &board.around.soc;
                let ram = if soc.ccm.contains(address) {
                    &soc.ccm
                } else {
                    &soc.ram
                };
                ram.read(address, Size::Byte).unwrap() as u8
            };
            self.served.push(Served {
                at: Micros(r[1]),
                done: Micros(now as u32),
                bytes: (0..r[3]).map(|n| byte(r[2] + n)).collect(),
            });
            board.observer.exit = Some(exit);
        } else {
            self.served.last_mut().unwrap().done = Micros(now as u32);
            board.observer.exit = None;
        }
    }
}
