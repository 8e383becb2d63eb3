//! Provides the boards of both simulators, and access to their internals.

use super::bench::{Bench, DeviceReports};
use super::case::CaseResult;
use super::error::FaultsError;
use firmware::lockstep::{Lockstep, Sensors};
use firmware::safety::Fault;
use firmware::units::Micros;
use hal_sim::chip::board::Board;
use hal_sim::chip::cpu::{Bus, Size};
use hal_sim::chip::image::Image;
use hal_sim::lockstep::Device;
use hal_sim::native::native;
use hal_sim::trace::judge::{self, Pump, QuietInterval, Truth, Verdict};
use hal_sim::trace::{Levels, Trace};
use host_core::run::power_on;
use host_core::session::Session;

/// Longest time from a fault to isolated outputs, µs: two windows.
pub(super) const TWO_WINDOWS_US: u64 = 500;
/// Time for which isolated outputs must last to count as permanent, µs: by then the host has sent
/// eight times, the judge's test pulses are over, and a reset chip has booted.
pub(super) const FOR_GOOD_US: u64 = 40_000;
/// Backup register in which the device stores its last fault, its address, and the marker "FX" in
/// its upper half; the lower half is the fault's number.
const KEPT_FAULT_WORD: usize = 0;
const KEPT_FAULT: u32 = 0x4000_2850 + 4 * KEPT_FAULT_WORD as u32;
const MAGIC: u32 = 0x4658;

/// A device that can be broken and inspected.
pub(super) trait FaultableDevice: Device {
    /// Returns the time of the last reset since power-on, µs.
    fn reset_us(&self) -> Option<u64>;
    /// Returns the fault that the device stores across resets.
    fn kept_fault(&mut self) -> Option<Fault>;
    /// Returns the edges of the charge pump.
    fn pump(&self) -> Pump;
    /// Breaks these lines between the chip and its output stages.
    fn break_lines(&mut self, lines: Levels);
    /// Makes the converter of the current sense ignore its trigger.
    fn ignore_sense_trigger(&mut self);
    /// Plugs in or pulls the cable to the host.
    fn set_cable(&mut self, is_in: bool);
    /// Returns whether the host's writes reach the device.
    fn is_connected(&self) -> bool;
    /// Returns whether the device stores a fault and has no host to report it to.
    fn has_unreported_fault(&self) -> bool;
    /// Returns the number of bytes that the host has written and the device has not yet read.
    fn unread_bytes(&self) -> usize;
}

impl FaultableDevice for Board<()> {
    fn reset_us(&self) -> Option<u64> {
        self.last_reset().map(|at| self.around.us_of(at))
    }

    fn kept_fault(&mut self) -> Option<Fault> {
        let head = self.around.read(KEPT_FAULT, Size::Word, self.cpu.cycle);
        let head = head.ok()?.value;
        (head >> 16 == MAGIC).then(|| Fault::from_number(head as u16))?
    }

    fn pump(&self) -> Pump {
        self.around.pump().clone()
    }

    fn break_lines(&mut self, lines: Levels) {
        self.around.broken = lines;
    }

    fn ignore_sense_trigger(&mut self) {
        self.around.soc.adc.deaf = true;
    }

    fn set_cable(&mut self, is_in: bool) {
        self.around.plug(is_in, self.cpu.cycle);
    }

    fn is_connected(&self) -> bool {
        self.around.host.is_open()
    }

    fn has_unreported_fault(&self) -> bool {
        let kept = self.around.soc.backup.word(KEPT_FAULT_WORD);
        !self.is_connected() && kept >> 16 == MAGIC
    }

    fn unread_bytes(&self) -> usize {
        self.around.host.unsent_bytes()
    }
}

/// The native backend has no chip to reset, no lines, no converter and no cable. No class breaks
/// the first three here, and messages on a pulled cable are never sent to it.
impl FaultableDevice for Lockstep {
    fn reset_us(&self) -> Option<u64> {
        None
    }

    fn kept_fault(&mut self) -> Option<Fault> {
        None
    }

    fn pump(&self) -> Pump {
        Pump::Throughout
    }

    fn break_lines(&mut self, _: Levels) {}

    fn ignore_sense_trigger(&mut self) {}

    fn set_cable(&mut self, _: bool) {}

    fn is_connected(&self) -> bool {
        true
    }

    fn has_unreported_fault(&self) -> bool {
        false
    }

    fn unread_bytes(&self) -> usize {
        0
    }
}

/// Boots boards of one simulator.
pub(super) trait Boards: Sync + Send {
    type Board: FaultableDevice;
    /// A booted board that can be forked; empty if boards cannot be stored.
    type Snapshot: Send + Sync;

    /// Boots a board with the stages of `session` and exchanges `Hello`; `prepare` changes a chip
    /// before its power comes on.
    fn board(
        &self,
        session: &Session,
        sensors: Sensors,
        prepare: &dyn Fn(&mut Board<()>),
    ) -> Result<Bench<Self::Board>, FaultsError>;

    /// Boots a board and exchanges `Hello`, for use by [`Self::connected_board`].
    fn prepare(&self, session: &Session) -> Result<Self::Snapshot, FaultsError>;

    /// Returns an unchanged board as [`Self::board`] does, forked from the stored one if there is
    /// one.
    fn connected_board(
        &self,
        kept: &Self::Snapshot,
        session: &Session,
        sensors: Sensors,
    ) -> Result<Bench<Self::Board>, FaultsError>;

    /// Returns the value for this simulator of the two in a declaration.
    fn select<'k, T: ?Sized>(&self, chip: &'k T, native: &'k T) -> &'k T;
}

impl Boards for Image {
    type Board = Board<()>;
    type Snapshot = Bench<Board<()>>;

    fn board(
        &self,
        session: &Session,
        sensors: Sensors,
        prepare: &dyn Fn(&mut Board<()>),
    ) -> Result<Bench<Board<()>>, FaultsError> {
        let mut board = power_on(session, self, ())?;
        prepare(&mut board);
        board.boot(&sensors)?;
        let now_us = board.now_us();
        Bench::connect(board, now_us, sensors)
    }

    fn prepare(&self, session: &Session) -> Result<Self::Snapshot, FaultsError> {
        self.board(session, Sensors::default(), &|_| ())
    }

    fn connected_board(
        &self,
        kept: &Self::Snapshot,
        _: &Session,
        sensors: Sensors,
    ) -> Result<Bench<Board<()>>, FaultsError> {
        let mut fork = kept.clone();
        fork.sensors = sensors;
        Ok(fork)
    }

    fn select<'k, T: ?Sized>(&self, chip: &'k T, _: &'k T) -> &'k T {
        chip
    }
}

/// The native backend.
pub(super) struct Native;

impl Boards for Native {
    type Board = Lockstep;
    type Snapshot = ();

    fn board(
        &self,
        _: &Session,
        sensors: Sensors,
        _: &dyn Fn(&mut Board<()>),
    ) -> Result<Bench<Lockstep>, FaultsError> {
        Bench::connect(native(Micros::new(0)), 0, sensors)
    }

    fn prepare(&self, _: &Session) -> Result<(), FaultsError> {
        Ok(())
    }

    fn connected_board(
        &self,
        (): &(),
        session: &Session,
        sensors: Sensors,
    ) -> Result<Bench<Lockstep>, FaultsError> {
        self.board(session, sensors, &|_| ())
    }

    fn select<'k, T: ?Sized>(&self, _: &'k T, native: &'k T) -> &'k T {
        native
    }
}

/// Returns whether the device reported a fault, stores one without a host, or was reset, and its
/// outputs have been isolated since.
pub(super) fn is_isolated_for_good(
    heard: &DeviceReports,
    device: &impl FaultableDevice,
    trace: &Trace,
    now_us: u64,
) -> bool {
    let reset_us = device.reset_us();
    let found = heard.fault.is_some() || reset_us.is_some() || device.has_unreported_fault();
    let last = trace.levels.last();
    let since_us = last
        .filter(|pair| pair.1 == Levels::ISOLATED)
        .map(|pair| pair.0);
    let since_us = since_us.map(|us| us.max(reset_us.unwrap_or(0)));
    found && since_us.is_some_and(|us| us + FOR_GOOD_US <= now_us)
}

/// Judges a case: whether the device detected the fault at `moment_us`, and the verdict on its
/// whole output, given `truth` and the consequences of the fault itself.
pub(super) fn judge_case<D: FaultableDevice>(
    bench: &mut Bench<D>,
    moment_us: u64,
    truth: Truth,
) -> (CaseResult, Verdict) {
    let (pump, end_us) = (bench.device.pump(), bench.now_us());
    judge_case_until(bench, moment_us, truth, (&pump, end_us))
}

/// Judges as [`judge_case`] does, for a recorder with more output than the bench played: with its
/// pump, and up to `end_us`.
pub(super) fn judge_case_until<D: FaultableDevice>(
    bench: &mut Bench<D>,
    moment_us: u64,
    mut truth: Truth,
    (pump, end_us): (&Pump, u64),
) -> (CaseResult, Verdict) {
    let mut fate = CaseResult::default();
    let mut quiet = |from_us: u64| {
        truth.quiet.push(QuietInterval {
            from_us: from_us.max(moment_us),
            until_us: u64::MAX,
        });
    };
    if let Some(record) = bench.reports().fault {
        let at_us = bench.clock.world_us(record.at);
        fate.fault = Some(record.fault);
        fate.told_us = Some(at_us.saturating_sub(moment_us));
        quiet(at_us + TWO_WINDOWS_US);
    }
    if let Some(at_us) = bench.device.reset_us() {
        fate.reset = true;
        quiet(at_us);
    }
    // A device without a host reports the fault to the next one.
    fate.fault = fate.fault.or_else(|| bench.device.kept_fault());
    fate.found = fate.fault.is_some() || fate.reset;
    let trace = &bench.recorder.trace;
    if let (true, Some((at, Levels::ISOLATED))) = (fate.found, trace.levels.last()) {
        fate.isolated_us = Some(at.saturating_sub(moment_us));
    }
    truth.faults.push(judge::Fault { t_us: moment_us });
    let verdict = judge::judge(trace, pump, &truth, end_us);
    let severe = verdict.as_built.findings.iter();
    fate.severe = severe.map(ToString::to_string).collect();
    let truncated = verdict.as_built.truncated.iter();
    fate.truncated_uc = truncated.map(|truncated| truncated.charge_uc).collect();
    fate.latched = !verdict.as_built.latched.is_empty();
    (fate, verdict)
}
