//! Faults of the flashed image: every fault ends with disconnected outputs within two windows and
//! is reported with its number, also after a reset.

use firmware::device::Draft;
use firmware::link::message::ResetCause;
use firmware::link::{BROADCAST, Event, HelloInfo, Refusal, Request, Response, SCHEMA};
use firmware::lockstep::Sensors;
use firmware::pulse::TrainSpec;
use firmware::safety::{ChannelSpec, Fault, StopCause};
use firmware::units::{Amplitude, Micros};
use hal_sim::chip::board::{Board, CYCLES_PER_US};
use hal_sim::chip::cpu::{Bus, Size};
use hal_sim::chip::soc::Pace;
use hal_sim::lockstep::Device;
use hal_sim::trace::{Levels, State};
use tests::desk;
use tests::record::Record;

/// Longest time from a fault until the outputs are disconnected, two windows, µs.
pub const TWO_WINDOWS_US: u64 = 500;

/// Board and its host. A clone is a fork of the simulation.
#[derive(Clone)]
pub struct Bench {
    pub board: Board<()>,
    pub sensors: Sensors,
    pub record: Record,
    session: u16,
    seq: u16,
    /// Setup that the host has sent.
    draft: Draft,
    events: Vec<Event>,
    refused: Vec<Refusal<'static>>,
    hello: Option<HelloInfo>,
}

impl Bench {
    /// Boots a board and opens a session.
    pub fn idle() -> Self {
        let (image, stages) = (desk::flashed_image(), desk::stages(24.0));
        Self::boot(Board::power_on(image, stages, Pace::Lazy, ()).unwrap())
    }

    fn boot(board: Board<()>) -> Self {
        let (bench, hello) = Self::boot_and_greet(board);
        assert_eq!((hello.reset, hello.last_fault), (ResetCause::PowerOn, None));
        bench
    }

    /// Boots a board after power-on. Returns its answer to `Hello` too.
    pub fn boot_and_greet(mut board: Board<()>) -> (Self, HelloInfo) {
        let sensors = Sensors::default();
        board.boot(&sensors).unwrap_or_else(|e| panic!("{e}"));
        let mut bench = Self {
            board,
            sensors,
            record: Record::default(),
            session: BROADCAST,
            seq: 0,
            draft: Draft::default(),
            events: Vec::new(),
            refused: Vec::new(),
            hello: None,
        };
        let hello = bench.greet();
        (bench, hello)
    }

    /// Boots a board that stimulates on two channels.
    fn stimulating() -> Self {
        let mut bench = Self::idle();
        bench.arm_and_start();
        bench.stimulate(30);
        assert!(bench.drives_within(10), "{:?}", bench.refused);
        bench
    }

    /// Returns the refusal on arming a channel.
    pub fn refusal_to_arm(&mut self) -> Option<(u16, String, i32)> {
        self.send(Request::Wearer(desk::wearer(100)));
        let spec = spec(0);
        self.send(Request::Channel { channel: 0, spec });
        self.run_us(5_000);
        self.refusal(desk::ARM)
    }

    /// Returns the refusal of `request`.
    pub fn refusal(&mut self, request: Request) -> Option<(u16, String, i32)> {
        self.refused.clear();
        self.send(request);
        self.run_us(5_000);
        let refused = self.refused.pop()?;
        Some((refused.code, refused.field.to_owned(), refused.max))
    }

    pub fn send(&mut self, request: Request) {
        let frame = desk::frame(self.session, self.seq, self.draft.prepare_request(request));
        self.seq = self.seq.wrapping_add(1);
        self.send_bytes(&frame);
    }

    /// Sends bytes to the device.
    pub fn send_bytes(&mut self, frame: &[u8]) {
        let now = Micros::new(self.board.now_us() as u32);
        let (sensors, record) = (&self.sensors, &mut self.record);
        let done = self.board.receive(now, frame, sensors, record);
        done.unwrap_or_else(|e| panic!("{e}"));
    }

    pub fn run_us(&mut self, us: u64) {
        let to = Micros::new((self.board.now_us() + us) as u32);
        let done = self.board.advance(to, &self.sensors, &mut self.record);
        done.unwrap_or_else(|e| panic!("{e}"));
        for message in desk::messages(&std::mem::take(&mut self.record.bytes)) {
            match postcard::from_bytes(&message) {
                Ok(Response::Event { event, .. }) => self.events.push(event),
                Ok(Response::Hello(hello)) => self.hello = Some(hello),
                Ok(Response::Refused { refusal, .. }) => {
                    let field = Box::leak(refusal.field.to_owned().into_boxed_str());
                    self.refused.push(Refusal { field, ..refusal });
                }
                _ => {}
            }
        }
    }

    fn greet(&mut self) -> HelloInfo {
        self.session = BROADCAST;
        self.send(Request::Hello { schema: SCHEMA });
        self.run_us(5_000);
        let hello = self.hello.take().expect("an answer to Hello");
        self.session = hello.session;
        hello
    }

    pub fn arm_and_start(&mut self) {
        self.send(Request::Wearer(desk::wearer(100)));
        for channel in [0, 5] {
            let spec = spec(channel);
            self.send(Request::Channel { channel, spec });
        }
        self.send(desk::ARM);
        self.run_us(40_000);
        self.send(Request::Start);
        self.run_us(2_000);
    }

    pub fn stimulate(&mut self, ms: u64) {
        for _ in 0..ms / 5 {
            self.send(Request::Amplitudes {
                at: None,
                mask: 0b10_0001,
                values: [Amplitude::new(5_000); 2].into_iter().collect(),
                widths: Default::default(),
            });
            self.run_us(5_000);
        }
    }

    /// Runs for `ms` of the fastest clock without reading messages, which a reset may cut.
    pub fn run_on_ms(&mut self, ms: u64) {
        let to = self.board.cpu.cycle + ms * 1_000 * CYCLES_PER_US;
        self.board.run_to(to).unwrap_or_else(|e| panic!("{e}"));
    }

    /// Runs for `us` without reading messages, which may end within a frame then.
    pub fn run_unread_us(&mut self, us: u64) {
        let to = Micros::new((self.board.now_us() + us) as u32);
        let done = self.board.advance(to, &self.sensors, &mut self.record);
        done.unwrap_or_else(|e| panic!("{e}"));
        self.record.bytes.clear();
    }

    /// Returns whether an output was driven since the last reset, and forgets the levels so far.
    pub fn is_driving(&mut self) -> bool {
        self.run_unread_us(1_000);
        let levels = std::mem::take(&mut self.record.trace.levels);
        let is_driven = |l: Levels| (0..10).any(|c| l.state(c).is_driven());
        levels.into_iter().any(|(_, levels)| is_driven(levels))
    }

    /// Returns whether any output is driven in the next `ms`.
    pub fn drives_within(&mut self, ms: u64) -> bool {
        self.record.trace.levels.clear();
        self.run_us(ms * 1000);
        let mut levels = self.record.trace.levels.iter();
        levels.any(|(_, l)| (0..10).any(|c| l.state(c).is_driven()))
    }

    /// Runs until a channel is driven, and for `us` into its phase.
    fn run_into_pulse(&mut self, us: u64) {
        self.record.trace.levels.clear();
        while !self.record.trace.last_levels().state(0).is_driven() {
            self.run_us(10);
        }
        self.run_us(us);
    }

    /// Checks that all outputs are disconnected from two windows after `since_us` on.
    pub fn expect_isolated(&mut self, since_us: u64, ms: u64) {
        self.run_us(ms * 1000);
        let end = since_us + TWO_WINDOWS_US;
        let levels = &self.record.trace.levels;
        let last = levels.iter().rfind(|(t, _)| *t <= end);
        assert_eq!(last.map(|l| l.1), Some(Levels::ISOLATED));
        let later = levels.iter().filter(|(t, _)| *t > end).count();
        let end = levels.last().unwrap().0;
        println!("isolated {} us after", end.saturating_sub(since_us));
        assert_eq!(later, 0);
    }

    fn now(&self) -> u64 {
        self.board.now_us()
    }

    /// Runs until the program itself no longer masks interrupts, because it would enable them
    /// again.
    pub fn leave_critical_section(&mut self) {
        let Board { cpu, around, .. } = &mut self.board;
        while cpu.registers.primask {
            cpu.step(around).unwrap();
        }
    }

    /// Masks an interrupt permanently.
    fn disable(&mut self, line: u32) {
        let register = 0xE000_E180 + line / 32 * 4;
        let cpu = &mut self.board.cpu;
        let done = cpu
            .system
            .write(register, Size::Word, 1 << (line % 32), cpu.cycle);
        done.unwrap();
    }

    /// Sends the thread into an endless loop around `wfi`; interrupts continue.
    fn hang_thread(&mut self) {
        let pc = self.find_code([0xBF30, 0xE7FD]);
        self.send_thread_to(pc, []);
    }

    /// Returns the address of these instructions, or of equal constants, in flash.
    pub fn find_code<const N: usize>(&self, instructions: [u16; N]) -> u32 {
        let (code, _) = self.board.image().flash.as_chunks();
        let wanted = instructions.map(u16::to_le_bytes);
        let found = code.windows(N).position(|c| c == wanted);
        0x0800_0000 + 2 * found.expect("any image has it") as u32
    }

    /// Continues the thread at `pc` with some registers changed.
    pub fn send_thread_to<const N: usize>(&mut self, pc: u32, registers: [(usize, u32); N]) {
        let Board { cpu, around, .. } = &mut self.board;
        while cpu.registers.exception != 0 || cpu.registers.it != 0 {
            cpu.step(around).unwrap();
        }
        for (number, value) in registers {
            cpu.registers.r[number] = value;
        }
        cpu.registers.r[15] = pc;
    }

    /// Waits until the chip has booted after a reset, and returns its answer to `Hello`.
    pub fn after_reset(&mut self) -> HelloInfo {
        let booted = self.board.boot(&self.sensors);
        booted.unwrap_or_else(|e| panic!("{e}"));
        // Bytes from before the reset may end within a frame.
        let now = Micros::new(self.board.now_us() as u32);
        let done = self.board.advance(now, &self.sensors, &mut self.record);
        done.unwrap_or_else(|e| panic!("{e}"));
        self.record = Record::default();
        self.greet()
    }

    /// Returns the fault reported since the session was opened.
    pub fn fault(&self) -> Option<Fault> {
        self.events.iter().find_map(|event| match event {
            Event::Faulted(record) => Some(record.fault),
            _ => None,
        })
    }

    /// Returns the detail of the fault reported since the session was opened.
    pub fn fault_detail(&self) -> Option<u32> {
        self.events.iter().find_map(|event| match event {
            Event::Faulted(record) => Some(record.detail),
            _ => None,
        })
    }

    /// Checks that the device reported this fault, and stimulates again after its acknowledgement.
    fn recovers_from(mut self, fault: Fault) {
        assert_eq!(self.fault(), Some(fault));
        self.expect_recovery();
    }

    /// Checks that the device reset by this cause, reports this fault, and recovers.
    pub fn recovers_after(mut self, reset: ResetCause, fault: Fault) {
        let hello = self.after_reset();
        assert_eq!(hello.reset, reset);
        assert_eq!(hello.last_fault.map(|f| f.fault), Some(fault));
        self.expect_recovery();
    }

    /// Returns a board 20 µs into a pulse, and that time.
    pub fn stimulating_in_pulse() -> (Self, u64) {
        let mut bench = Self::stimulating();
        bench.run_into_pulse(20);
        let at = bench.now();
        (bench, at)
    }

    /// Acknowledges the fault, and checks that the device stimulates again.
    pub fn expect_recovery(&mut self) {
        self.send(Request::Acknowledge);
        self.run_us(450_000); // until the next electrode check may begin
        let is_recovered = self.events.contains(&Event::Recovered);
        assert!(is_recovered, "{:?} {:?}", self.events, self.refused);
        self.arm_and_start();
        self.stimulate(20);
        assert!(self.drives_within(10));
    }
}

pub fn spec(channel: u8) -> ChannelSpec {
    let train = TrainSpec {
        offset_us: 300 * u32::from(channel),
        ..TrainSpec::biphasic(200, 20, 5_000)
    };
    desk::channel(train, 24_000, 18_000)
}

#[test]
fn over_current_isolates_and_the_tape_starts_again() {
    let (mut bench, at) = Bench::stimulating_in_pulse();
    bench.sensors.over_current = true;
    bench.expect_isolated(at, 5);
    bench.sensors.over_current = false;
    bench.recovers_from(Fault::OverCurrent);
}

#[test]
fn a_released_hand_stop_ends_stimulation() {
    let mut bench = Bench::stimulating();
    bench.sensors.hand_stop = false;
    bench.run_us(60_000);
    assert!(
        bench.events.contains(&Event::Stopped(StopCause::HandStop)),
        "{:?}",
        bench.events
    );
    assert!(!bench.drives_within(20));
}

/// Interrupts of TIM2, TIM7 (control), TIM5 and OTG_FS (USB): RM0090 table 62.
#[test]
fn the_watchdog_bites_when_an_owner_freezes() {
    let freezes = [
        // The refill watchdog disconnects the outputs, and then no pulser checks in.
        ("pulser", Some(28), TWO_WINDOWS_US, Fault::MissedDeadline),
        // A pulser that still runs continues until the watchdog resets.
        ("controller", Some(55), 12_000, Fault::Watchdog),
        ("session", None, 12_000, Fault::Watchdog),
    ];
    for (owner, line, limit, fault) in freezes {
        let (mut bench, at) = Bench::stimulating_in_pulse();
        match line {
            Some(line) => bench.disable(line),
            None => bench.hang_thread(),
        }
        bench.run_us(13_000);
        let last = *bench.record.trace.levels.last().unwrap();
        println!("{owner}: isolated {} us after", last.0 - at);
        assert_eq!(last.1, Levels::ISOLATED);
        assert!(last.0 <= at + limit);
        bench.recovers_after(ResetCause::Watchdog, fault);
    }
}

#[test]
fn a_falling_supply_is_remembered_through_the_reset() {
    let (mut bench, at) = Bench::stimulating_in_pulse();
    // Below the detector's 2.93 V, above the brown-out reset's 2.83 V.
    bench.board.around.soc.supply(2_880);
    bench.run_us(100);
    bench.board.around.soc.supply(3_300);
    bench.expect_isolated(at, 5);
    bench.recovers_after(ResetCause::Software, Fault::BrownOut);
}

/// A supply that is low from the start makes no edge for an interrupt; the device once became Idle.
#[test]
fn a_supply_that_is_low_from_the_start_starts_nothing() {
    let (image, stages) = (desk::flashed_image(), desk::stages(24.0));
    const MS: u64 = 1_000 * CYCLES_PER_US;
    let mut board = Board::power_on(image, stages, Pace::Lazy, ()).unwrap();
    // Enough for the chip, but too little for the detector: 2.93 V, 3.03 V rising.
    for (mv, cycle) in [(2_900, 500 * MS), (3_000, 1_000 * MS)] {
        board.around.soc.supply(mv);
        board.run_to(cycle).unwrap();
        // Stream 5 of DMA2, which plays the tape, is off.
        let plays = board
            .around
            .soc
            .read(0x4002_6410 + 0x18 * 5, Size::Word, cycle);
        assert_eq!(plays.unwrap().value & 1, 0, "at {mv} mV");
    }
    // Above the threshold it boots normally.
    board.around.soc.supply(3_300);
    let mut bench = Bench::boot(board);
    bench.arm_and_start();
    bench.stimulate(30);
    assert!(bench.drives_within(10), "{:?}", bench.refused);
}

/// A dead crystal stays dead; the record is in the backup registers.
#[test]
fn a_dead_crystal_isolates_and_is_recorded() {
    let (mut bench, at) = Bench::stimulating_in_pulse();
    let cycle = bench.board.cpu.cycle;
    bench.board.around.soc.rcc.stop_hse(cycle).unwrap();
    bench.board.around.soc.reschedule();
    bench.expect_isolated(at, 5);
    let cycle = bench.board.cpu.cycle;
    let head = bench.board.around.soc.read(0x4000_2850, Size::Word, cycle);
    assert_eq!(
        head.unwrap().value,
        0x4658_0000 | u32::from(Fault::ClockFailure.number())
    );
}

/// Stream 2 erases port B's tape; the disconnect words lie at the tape's end.
#[test]
fn a_tape_that_slips_is_a_fault() {
    let (mut bench, at) = Bench::stimulating_in_pulse();
    let cycle = bench.board.cpu.cycle;
    let cr = 0x4002_6410 + 0x18 * 2;
    let soc = &mut bench.board.around.soc;
    let on = soc.read(cr, Size::Word, cycle).unwrap().value;
    soc.write(cr, Size::Word, on & !1, cycle).unwrap();
    bench.expect_isolated(at, 5);
    bench.recovers_from(Fault::TapeSlip);
}

#[test]
fn interrupts_masked_for_two_windows_are_a_missed_deadline() {
    let (mut bench, at) = Bench::stimulating_in_pulse();
    bench.leave_critical_section();
    bench.board.cpu.registers.primask = true;
    bench.run_us(600);
    bench.board.cpu.registers.primask = false;
    bench.expect_isolated(at, 5);
    bench.recovers_from(Fault::MissedDeadline);
}

#[test]
fn a_stack_that_overflows_meets_its_guard() {
    let mut bench = Bench::stimulating();
    bench.run_into_pulse(20);
    while !bench.board.cpu.is_asleep() {
        bench.run_us(1);
    }
    let at = bench.now();
    let cpu = &mut bench.board.cpu;
    let guard = cpu.system.denied_range().unwrap();
    assert!(guard.end - guard.start == 32 && (0x2000_0000..0x2001_C000).contains(&guard.start));
    cpu.registers.r[13] = guard.end as u32;
    bench.expect_isolated(at, 5);
    bench.recovers_after(ResetCause::Software, Fault::StackGuard);
}

/// 5 mA into a load that rises from 1 to 25 kΩ in 10 s: 125 V, above the stage's 120 V.
#[test]
fn a_peeling_electrode_is_a_fault() {
    let mut bench = Bench::stimulating();
    let mut ohm = 1_000;
    let is_told = |bench: &Bench| {
        let faulted = |event: &Event| matches!(event, Event::Faulted(_));
        bench.events.iter().any(faulted)
    };
    for ms in (0..10_200u32).step_by(5) {
        ohm = 1_000 + 24_000 * ms.min(10_000) / 10_000;
        bench.sensors.load_ohm[0] = ohm;
        bench.record.trace.levels.clear();
        bench.stimulate(5);
        if is_told(&bench) {
            break;
        }
    }
    println!("found at {ohm} Ω");
    // 98 % of 5 mA, minus two counts, at 120 V: 24.8 kΩ, and three readings.
    assert!((24_600..=25_000).contains(&ohm), "{ohm} Ω");
    assert!(!bench.drives_within(20));
    bench.sensors.load_ohm[0] = 2_000;
    bench.recovers_from(Fault::LoadUnstable);
}

/// The anodic line of channel 1 breaks after its pin, so its second phase is lost.
#[test]
fn a_lost_second_phase_is_a_fault() {
    let (mut bench, at) = Bench::stimulating_in_pulse();
    bench.board.around.broken = Levels(State::Anodic as u32);
    // Of four bursts at 5 ms two are read, one of them in the second phase.
    bench.stimulate(80);
    bench.expect_isolated(at + 80_000, 5);
    bench.board.around.broken = Levels::ISOLATED;
    bench.recovers_from(Fault::PhaseLost);
}
