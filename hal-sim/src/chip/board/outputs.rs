//! Converts the board's output from cycles to microseconds.

use super::wiring::{self, CORE_HZ, CYCLES_PER_US, Outputs as Pins, Port, Wiring};
use crate::chip::Cycle;
use crate::chip::ad5668::Change;
use crate::chip::soc::gpio::Edge;
use crate::chip::time::Time;
use crate::trace::Levels;
use crate::trace::judge::{Hardware, Pump};
use firmware::lockstep::Sink;
use firmware::units::{DacCode, Micros};
use std::collections::VecDeque;

/// Statistics of the edges of pins that the tape plays: for each port, a histogram of the cycle
/// within its microsecond at which each edge came. Ideally port B's edges come at TIM1's update,
/// and port C's 8 cycles later.
#[derive(Clone, Debug)]
pub struct Phases {
    /// Number of edges of port B, the first to move, by cycle within the microsecond.
    pub b: [u64; CYCLES_PER_US as usize],
    /// Number of edges of port C, the second to move, by cycle within the microsecond.
    pub c: [u64; CYCLES_PER_US as usize],
    /// Hash (FNV-1a) of port, cycle and levels of all these edges in their order. Two runs with the
    /// same digest had the same edges.
    pub digest: u64,
}

/// FNV-1a, 64 bits: offset basis and prime.
const FNV: (u64, u64) = (0xCBF2_9CE4_8422_2325, 0x100_0000_01B3);

impl Phases {
    /// Counts `edge` of tape port `port` (0 is B, 1 is C), at its cycle relative to `origin`.
    fn record(&mut self, port: usize, edge: &Edge, origin: Cycle) {
        let cycle = edge.cycle.saturating_sub(origin);
        let counts = match port {
            0 => &mut self.b,
            _ => &mut self.c,
        };
        counts[(cycle % CYCLES_PER_US) as usize] += 1;
        for word in [edge.port.into(), cycle, edge.levels.into()] {
            self.digest = (self.digest ^ word).wrapping_mul(FNV.1);
        }
    }
}

impl Default for Phases {
    fn default() -> Self {
        let none = [0; CYCLES_PER_US as usize];
        Self {
            b: none,
            c: none,
            digest: FNV.0,
        }
    }
}

/// Returns whether the tape plays one of the pins `changed`: the channels' lines, sync out, the
/// pump.
fn is_played_by_tape(board: &Wiring, port: Port, changed: u16) -> bool {
    let lines = board.lines.iter().flatten().flat_map(|&(c, a)| [c, a]);
    let pins = lines.chain([wiring::SYNC_OUT, wiring::PUMP]);
    pins.filter(|pin| pin.0 == port)
        .any(|(_, pin)| changed >> pin & 1 == 1)
}

#[derive(Clone, Copy, PartialEq, Debug)]
enum OutputChange {
    Levels(Levels),
    Dac(u8, u16),
    Trip(u8, u16),
}

/// Collector of the board's output: takes in changes by cycle, and passes them on by microsecond.
#[derive(Clone, Debug)]
pub(super) struct Outputs {
    board: &'static Wiring,
    origin: Option<Cycle>,
    time: Time,
    pins: Pins,
    levels: Levels,
    pump: Pump,
    /// Microsecond in which levels have changed and which is not over yet; `None` if there is none.
    open: Option<u64>,
    waiting: VecDeque<(u64, OutputChange)>,
    bytes: VecDeque<(u64, Vec<u8>)>,
    phases: Phases,
}

impl Outputs {
    /// Creates a collector of the output of `board`, before time 0.
    pub fn new(board: &'static Wiring) -> Self {
        Self {
            board,
            origin: None,
            time: Time::new(0, CORE_HZ),
            pins: Pins::default(),
            levels: Levels::ISOLATED,
            pump: Pump::Runs(Vec::new()),
            open: None,
            waiting: VecDeque::new(),
            bytes: VecDeque::new(),
            phases: Phases::default(),
        }
    }

    /// Returns the wiring of the board.
    pub const fn board(&self) -> &'static Wiring {
        self.board
    }

    /// Makes `origin` time 0, and drops all earlier output.
    pub fn begin(&mut self, origin: Cycle) {
        self.origin = Some(origin);
        self.time = Time::new(origin, CORE_HZ);
        self.waiting.clear();
        self.pump = Pump::Runs(Vec::new());
        self.open = None;
    }

    /// Returns whether both collectors pass on the same output from now on; their past output may
    /// differ.
    pub fn is_equivalent_to(&self, other: &Self) -> bool {
        (self.origin, self.levels, self.open) == (other.origin, other.levels, other.open)
            && self.pump.last_edge() == other.pump.last_edge()
            && (self.pins, &self.waiting, &self.bytes) == (other.pins, &other.waiting, &other.bytes)
    }

    pub const fn origin(&self) -> Cycle {
        match self.origin {
            Some(origin) => origin,
            None => 0,
        }
    }

    pub fn restart_counts(&mut self) {
        self.phases = Phases::default();
    }

    pub const fn phases(&self) -> &Phases {
        &self.phases
    }

    /// Returns the present state of the lines to the output stages.
    pub const fn levels(&self) -> Levels {
        self.levels
    }

    /// Returns the edges of the pump pin since time 0.
    pub const fn pump(&self) -> &Pump {
        &self.pump
    }

    /// Changes the core's clock to `hz` from `cycle` on.
    pub fn set_hz(&mut self, hz: u32, cycle: Cycle) {
        self.time.set_hz(hz, cycle);
    }

    /// Returns the conversion between cycles and time since `origin`.
    pub const fn clock(&self) -> &Time {
        &self.time
    }

    fn time(&self, cycle: Cycle) -> u64 {
        self.time.us(cycle)
    }

    pub fn edge(&mut self, edge: Edge) {
        let is_edges = |port: &Port| port.index() == usize::from(edge.port);
        let Some(n) = wiring::TAPE_PORTS.iter().position(is_edges) else {
            return;
        };
        let port = wiring::TAPE_PORTS[n];
        if let Some(origin) = self
            .origin
            .filter(|_| is_played_by_tape(self.board, port, edge.changed))
        {
            self.phases.record(n, &edge, origin);
        }
        if wiring::PUMP.0 == port && edge.changed >> wiring::PUMP.1 & 1 == 1 {
            let us = self.time(edge.cycle);
            self.pump.edge(us, Hardware::REFERENCE.pump_hold_us);
        }
        self.pins.0[n] = edge.levels;
        let levels = self.pins.levels(self.board);
        if levels == self.levels {
            return;
        }
        let us = self.time(edge.cycle);
        // Changes of both ports in one slot count as one change.
        if let Some(open) = self.open.filter(|&open| open != us) {
            self.waiting
                .push_back((open, OutputChange::Levels(self.levels)));
        }
        self.open = Some(us);
        self.levels = levels;
    }

    pub fn dac(&mut self, chip: usize, change: Change) {
        let changed = (chip, usize::from(change.output));
        let place =
            |outputs: &[(usize, usize)]| outputs.iter().position(|&output| output == changed);
        let out = match (place(&wiring::AMPLITUDES), place(&wiring::TRIPS)) {
            (Some(channel), _) => OutputChange::Dac(channel as u8, change.code),
            (None, Some(bank)) => OutputChange::Trip(bank as u8, change.code),
            (None, None) => return,
        };
        let us = self.time(change.at);
        self.waiting.push_back((us, out));
    }

    pub fn bytes(&mut self, cycle: Cycle, bytes: &[u8]) {
        let us = self.time(cycle);
        self.bytes.push_back((us, bytes.to_vec()));
    }

    /// Passes all output before `to_us`, µs since time 0, to `sink`, in the order of time.
    pub fn emit(&mut self, to_us: u64, sink: &mut dyn Sink) {
        if let Some(open) = self.open.filter(|&open| open < to_us) {
            self.waiting
                .push_back((open, OutputChange::Levels(self.levels)));
            self.open = None;
        }
        // DAC words are queued at once, levels only when their microsecond is over.
        self.waiting.make_contiguous().sort_by_key(|(us, _)| *us);
        for (us, out) in self.waiting.drain(..) {
            let at = Micros::new(us as u32);
            match out {
                OutputChange::Levels(levels) => {
                    sink.write_levels(at, firmware::pulse::Levels(levels.0))
                }
                OutputChange::Dac(channel, code) => sink.write_dac(at, channel, DacCode::new(code)),
                OutputChange::Trip(bank, code) => sink.write_trip(at, bank, DacCode::new(code)),
            }
        }
        for (us, bytes) in self.bytes.drain(..) {
            sink.write_bytes(Micros::new(us as u32), &bytes);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_of_the_pump_are_kept() {
        let mut outputs = Outputs::new(&wiring::REFERENCE);
        outputs.begin(1_000);
        for (n, us) in [0, 25, 50, 1_050].into_iter().enumerate() {
            outputs.edge(Edge {
                cycle: 1_000 + us * CYCLES_PER_US,
                port: wiring::PUMP.0.index() as u8,
                changed: 1 << wiring::PUMP.1,
                levels: ((n % 2) as u16) << wiring::PUMP.1,
            });
        }
        let runs = vec![(0, 50), (1_050, 1_050)];
        assert_eq!(outputs.pump(), &Pump::Runs(runs));
        assert_eq!(outputs.levels(), Levels::ISOLATED);
    }
}
