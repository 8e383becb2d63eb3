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

/// Longest allowed time from a fault to isolated outputs, µs: two refill windows.
pub(super) const TWO_WINDOWS_US: u64 = 500;
/// Time for which isolated outputs must last to count as permanent, µs. By then the host has sent
/// eight messages, the judge's test pulses are over, and a chip that was reset has booted.
pub(super) const FOR_GOOD_US: u64 = 40_000;
/// Number of the backup register in which the device stores its last fault.
const KEPT_FAULT_WORD: usize = 0;
/// Address of that backup register. Its upper half holds [`MAGIC`], its lower half the number of
/// the fault.
const KEPT_FAULT: u32 = 0x4000_2850 + 4 * KEPT_FAULT_WORD as u32;
/// Marker "FX", which shows that the backup register contains a fault.
const MAGIC: u32 = 0x4658;

/// A simulated device that can be broken and inspected.
pub(super) trait FaultableDevice: Device {
    /// Returns the device time of the last reset since power-on, µs; `None` if there was none.
    fn reset_us(&self) -> Option<u64>;
    /// Returns the fault that the device stores across resets; `None` if it stores none.
    fn kept_fault(&mut self) -> Option<Fault>;
    /// Returns the recorded edges of the charge pump.
    fn pump(&self) -> Pump;
    /// Interrupts these lines between the chip and its output stages.
    fn break_lines(&mut self, lines: Levels);
    /// Makes the converter that measures the electrode current ignore its trigger.
    fn ignore_sense_trigger(&mut self);
    /// Plugs in the cable to the host, or pulls it out.
    fn set_cable(&mut self, is_in: bool);
    /// Returns whether the host's writes reach the device.
    fn is_connected(&self) -> bool;
    /// Returns whether the device stores a fault while no host is connected to which it could
    /// report.
    fn has_unreported_fault(&self) -> bool;
    /// Returns the number of bytes that the host has sent and the device has not read yet.
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

/// The native backend has no chip to reset, no lines, no converter and no cable. Its methods for
/// these do nothing, because no fault class uses them on this backend.
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

/// Boots simulated boards of one simulator.
pub(super) trait Boards: Sync + Send {
    type Board: FaultableDevice;
    /// A booted board that can be copied; the unit type if the simulator's boards are not stored.
    type Snapshot: Send + Sync;

    /// Boots a board with the output stages of `session` and exchanges `Hello`. On the chip
    /// simulator, `prepare` changes the board before its power comes on.
    fn board(
        &self,
        session: &Session,
        sensors: Sensors,
        prepare: &dyn Fn(&mut Board<()>),
    ) -> Result<Bench<Self::Board>, FaultsError>;

    /// Boots a board for [`Self::connected_board`] to copy.
    fn prepare(&self, session: &Session) -> Result<Self::Snapshot, FaultsError>;

    /// Returns a board that has booted and exchanged `Hello`: a copy of `kept`, or a newly booted
    /// one if boards are not stored.
    fn connected_board(
        &self,
        kept: &Self::Snapshot,
        session: &Session,
        sensors: Sensors,
    ) -> Result<Bench<Self::Board>, FaultsError>;

    /// Returns the value for this simulator: `chip` on the chip simulator, `native` on the native
    /// backend.
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

/// The native backend as a source of boards.
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

/// Returns whether the outputs are permanently isolated because of a fault. The device must have
/// reported or stored a fault or been reset, and its outputs must have been isolated for
/// [`FOR_GOOD_US`].
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

/// Judges a case: whether the device detected the fault that was injected at `moment_us`, and
/// whether its output was severe. `truth` contains the true properties of board and wearer, and
/// what the fault itself changes.
pub(super) fn judge_case<D: FaultableDevice>(
    bench: &mut Bench<D>,
    moment_us: u64,
    truth: Truth,
) -> (CaseResult, Verdict) {
    let (pump, end_us) = (bench.device.pump(), bench.now_us());
    judge_case_until(bench, moment_us, truth, (&pump, end_us))
}

/// Judges as [`judge_case`] does, for a recorder that contains more output than `bench` has
/// simulated: the output up to `end_us`, with the edges of the charge pump in `pump`.
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
