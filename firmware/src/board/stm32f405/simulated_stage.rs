//! Output stages that a breadboard does not have: what they would report, computed from what the
//! tape plays. Over-current never trips, the arm key is closed, and the current sense reads the
//! current of the configured stages through 2 kΩ. The hand-held stop is real.

use super::pins::{self, SafetyInputs};
use super::{boot_loader, detail};
use crate::board::wiring::BOARD;
use crate::device::Restart;
use crate::link::Kind;
use crate::pulse::{CHANNELS, Levels, Sample, State, WindowPlan};
use crate::safety::{Fault, Setup, Stages};
use crate::units::DacCode;

/// Kind of device that an image for these stages is.
pub const KIND: Kind = Kind::Breadboard;
/// Whether the image enters the chip's boot loader on request.
pub const HAS_BOOT_LOADER: bool = true;

/// Load of every channel, Ω.
const LOAD_OHM: u32 = 2_000;
/// Largest reading of the current sense, counts.
const FULL_SCALE: u32 = 4_095;
/// Time for the pull-down resistors to discharge an open pin after reset, core cycles at the HSI:
/// 100 µs, some ten times 50 kΩ and 100 pF.
const SETTLE: u32 = 1_600;

/// Simulated output stages.
pub struct OutputStage {
    codes: [DacCode; CHANNELS],
    /// Reading of the sample that the ADC takes next, counts.
    reading: u16,
}

impl OutputStage {
    /// Returns stages whose DACs are at 0.
    pub const fn new() -> Self {
        Self {
            codes: [DacCode::new(0); CHANNELS],
            reading: 0,
        }
    }

    /// Notes that the DAC of `channel` was set to `code`.
    pub fn note_dac(&mut self, channel: u8, code: DacCode) {
        if let Some(slot) = self.codes.get_mut(usize::from(channel)) {
            *slot = code;
        }
    }

    /// Computes the reading of `sample` while `plan` plays. All stages share the sense resistor, so
    /// their currents add up.
    pub fn note_sample(&mut self, sample: &Sample, plan: &WindowPlan, setup: Option<&Setup>) {
        let levels = levels_at(plan, sample.at.elapsed_since(plan.start));
        let mut sum_ua = 0_u32;
        for (channel, code) in (0_u8..).zip(self.codes) {
            let stage = setup.and_then(|setup| Some(setup.channel(channel)?.stage));
            let state = levels.state(channel.into());
            let is_driven = matches!(state, State::Cathodic | State::Anodic);
            if let Some(stage) = stage.filter(|_| is_driven) {
                let ua = stage.current_through(code, LOAD_OHM).get();
                sum_ua = sum_ua.saturating_add(ua);
            }
        }
        let largest = BOARD.stages.sense_full_scale_ua;
        // At most 4095 · 120 000, below 2^32.
        self.reading = (sum_ua.min(largest) * FULL_SCALE / largest) as u16;
    }

    /// Returns the reading of the current sense, counts, in place of the ADC's.
    pub fn current(&self, _raw: u16) -> u16 {
        self.reading
    }

    /// Reads the hand-held stop and the trigger; the other inputs are simulated.
    pub fn inputs(&self) -> SafetyInputs {
        SafetyInputs {
            arm: true,
            over_current: false,
            ..pins::safety_inputs()
        }
    }
}

/// Returns the levels that `plan` plays `us` microseconds after its start.
fn levels_at(plan: &WindowPlan, us: u32) -> Levels {
    let mut changes = plan.changes.iter();
    let last = changes.rfind(|change| u32::from(change.slot) <= us);
    last.map_or(plan.initial, |change| change.levels)
}

/// Returns the fault, with its detail, if the image does not belong on this board: the strap is
/// open, or output stages drive the over-current line. The inputs must be configured.
pub fn find_other_board() -> Option<(Fault, u32)> {
    cortex_m::asm::delay(SETTLE);
    let is_open = BOARD.breadboard.is_none_or(|b| !pins::is_high(b.strap));
    let mut found = if is_open { detail::STRAP_OPEN } else { 0 };
    if pins::is_high(BOARD.inputs.over_current) {
        found |= detail::OVER_CURRENT_HIGH;
    }
    (found != 0).then_some((Fault::Board, found))
}

/// Returns the stages, which exist for the channels whose lines the board has.
pub fn stages(_unique_id: [u32; 3]) -> Stages {
    let lines = BOARD.outputs.channels.iter().enumerate();
    let present = lines.filter(|(_, lines)| lines.is_some());
    Stages::Simulated {
        channels: present.fold(0, |channels, (n, _)| channels | 1 << n), // n is below 10
    }
}

/// Does what the accepted `restart` asks for, and restarts.
pub fn restart(restart: &Restart) -> ! {
    if matches!(restart, Restart::EnterBootLoader) {
        boot_loader::request();
    }
    // The session refuses every other restart here.
    cortex_m::peripheral::SCB::sys_reset()
}
