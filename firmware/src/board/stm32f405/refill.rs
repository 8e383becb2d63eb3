//! Execution context of the Pulser: the interrupt 2 µs into each 250 µs window renders the next
//! window. The over-current and supply interrupts and the refill watchdog share its priority, the
//! highest, so none of the four can preempt another.

use super::adc::{self, Sequence};
use super::control::{TICK, Tick};
use super::crystal::Crystal;
#[cfg(not(feature = "breadboard"))]
use super::output_stage::OutputStage;
use super::pac::{EXTI, Interrupt, SYSCFG};
#[cfg(feature = "breadboard")]
use super::simulated_stage::OutputStage;
use super::tape::{self, Half, Tape};
use super::timebase::Instant;
use super::watchdog::{self, Owner};
use super::{
    InterruptPriority, dac, detail, emergency, overdue, pace, pins, record, registers, timebase,
    usb_clock,
};
use crate::device::{Pulser, PulserMail, REFILL_OFFSET_US, WINDOWS_PER_TICK};
use crate::pulse::{Levels, Sample, WINDOW_US, WindowPlan};
use crate::safety::{Fault, FaultRecord, Inputs, Reading, State, UsageAtBoot};
use crate::units::{Micros, us};
use core::ptr::null_mut;
use core::sync::atomic::{AtomicPtr, Ordering};
use cortex_m::peripheral::{NVIC, SYST};
use cortex_m_rt::exception;
use embassy_stm32::interrupt;
use static_cell::StaticCell;

/// Time of the joint-angle sample within a window that requests no mid-phase sample, µs.
const DEFAULT_SAMPLE_US: u32 = 125;

struct Refill {
    /// Refill watchdog: interrupts when the next refill is overdue.
    second_clock: SYST,
    crystal: Crystal,
    pulser: Pulser,
    mail: PulserMail<'static>,
    /// `None` after a fault stop, until a plan drives outputs again.
    tape: Option<Tape>,
    stage: OutputStage,
    plan: WindowPlan,
    /// Start and tape half of the window that is playing.
    playing: (Micros, Half),
    /// Mid-phase sample that the armed conversion takes.
    sampling: Option<Sample>,
    angle: Option<u16>,
    windows: u32,
    kept: StoredFault,
}

/// State of the fault record in the backup registers.
#[derive(Clone, Copy)]
enum StoredFault {
    Nothing,
    Latched,
    Acknowledged,
}

static MEMORY: StaticCell<Refill> = StaticCell::new();
/// Null until `start`; then accessed from interrupts of one priority only.
static REFILL: AtomicPtr<Refill> = AtomicPtr::new(null_mut());

/// Runs `act` on the refill; called from its four interrupts.
fn with_refill(act: impl FnOnce(&mut Refill)) {
    // SAFETY: the pointer points into `MEMORY` and is exclusive: `start` gave its reference away,
    // and interrupts of one priority do not preempt one another.
    if let Some(refill) = unsafe { REFILL.load(Ordering::Acquire).as_mut() } {
        act(refill);
    }
}

/// Starts the tape at device time 0 and gives a pulser to the interrupt. `latched` is the fault
/// found at reset, `found` the used time and charge found there. After a fault that this boot
/// found, or if the tape does not start, device time runs without the tape: nothing plays, and the
/// fault is reported over USB. Returns the latched fault.
///
/// # Safety
/// Must be called once, from the thread, while no other context uses the tape or the pins.
pub unsafe fn start(
    mut latched: Option<FaultRecord>,
    found: UsageAtBoot,
    mail: PulserMail<'static>,
    nvic: &mut NVIC,
    second_clock: SYST,
) -> Option<FaultRecord> {
    // Initialised in place, because it is too large for the stack.
    let refill = MEMORY.init_with(|| Refill {
        kept: latched.map_or(StoredFault::Nothing, |_| StoredFault::Latched),
        second_clock,
        crystal: Crystal::start(),
        pulser: Pulser::new(latched, found),
        mail,
        tape: None,
        stage: OutputStage::new(),
        plan: WindowPlan::new(),
        playing: (Micros::new(0), Half::First),
        sampling: None,
        angle: None,
        windows: 0,
    });
    if latched.is_some_and(|record| record.found_at_boot) {
        tape::stop();
        pace::run_without_tape();
    } else {
        // SAFETY: the caller guarantees that no other tape or user of the tape exists.
        match unsafe { Tape::start(&refill.plan, None) } {
            Ok(tape) => refill.tape = Some(tape),
            Err((fault, detail)) => {
                let record = record::keep_found_at_boot(fault, detail);
                refill.pulser.fault(&record, &mut refill.mail);
                refill.kept = StoredFault::Latched;
                latched = Some(record);
                tape::stop();
                pace::run_without_tape();
            }
        }
    }
    overdue::start(&mut refill.second_clock);
    REFILL.store(refill, Ordering::Release);
    watch_over_current();
    for line in [Interrupt::TIM2, Interrupt::EXTI9_5, Interrupt::PVD] {
        // SAFETY: no critical section relies on a priority, and the state that these interrupts use
        // is initialised.
        unsafe {
            nvic.set_priority(line, InterruptPriority::Refill as u8);
            NVIC::unmask(line);
        }
    }
    latched
}

/// Enables the over-current interrupt, on a falling edge.
fn watch_over_current() {
    let (line, port) = (pins::OVER_CURRENT_LINE, pins::OVER_CURRENT_PORT);
    SYSCFG
        .exticr(line / 4)
        .modify(|w| w.set_exti(line % 4, port));
    EXTI.ftsr(0).modify(|w| w.set_line(line, true));
    EXTI.pr(0).write(|w| w.set_line(line, true));
    EXTI.imr(0).modify(|w| w.set_line(line, true));
}

#[interrupt]
fn TIM2() {
    with_refill(Refill::run);
}

/// Disconnects the outputs, because the refill is overdue. SysTick has the priority of the refill from reset.
#[exception]
fn SysTick() {
    with_refill(Refill::is_overdue);
}

#[interrupt]
fn EXTI9_5() {
    tape::stop();
    EXTI.pr(0)
        .write(|w| w.set_line(pins::OVER_CURRENT_LINE, true));
    with_refill(|refill| refill.stop((Fault::OverCurrent, 0)));
}

#[interrupt]
fn PVD() {
    emergency::supply_fell()
}

impl Refill {
    fn run(&mut self) {
        self.second_clock.clear_current();
        let synchronised = self.synchronise();
        let (start, half) = self.playing;
        let next = start + us(WINDOW_US);
        timebase::refill_at(next + us(REFILL_OFFSET_US));
        // Comes first, so that at most two windows lie between two checks of the same registers.
        if let Err(fault) = self.check_hardware() {
            self.stop(fault);
        }
        let sequence = adc::read();
        let inputs = self.inputs(sequence);
        // The manual does not define the effect of a trigger during a sequence.
        if sequence != Sequence::Converts {
            self.arm_conversion(start);
        }

        let now = timebase::now();
        let rendered = self
            .pulser
            .refill(now, next, &inputs, &mut self.mail, &mut self.plan);
        let put_out = synchronised
            .and(rendered.map_err(|fault| (fault, 0)))
            .and_then(|()| self.play(start, half));
        let half = put_out.unwrap_or_else(|fault| {
            self.stop(fault); // keeps an earlier fault, including the pulser's own
            half.other()
        });
        self.playing = (next, half);
        self.clear_acknowledged();
        registers::keep_debug_bits(!self.windows.is_multiple_of(2));
        self.tick(start + us(REFILL_OFFSET_US));
        watchdog::check_in(Owner::Pulser);
    }

    /// Stops the outputs because the refill did not come in time: nothing that plays can be
    /// trusted.
    fn is_overdue(&mut self) {
        if self.tape.is_some() {
            self.stop((Fault::MissedDeadline, 0));
        }
    }

    /// Disconnects the outputs and latches `fault`. The outputs come first, because the rest takes
    /// 20 µs.
    #[inline(never)]
    fn stop(&mut self, (fault, detail): (Fault, u32)) {
        tape::stop();
        let found = FaultRecord {
            detail,
            ..FaultRecord::new(fault, timebase::now())
        };
        self.pulser.fault(&found, &mut self.mail);
        self.isolate();
    }

    /// Catches up with the clock if a window passed without its refill, which is a fault if
    /// anything plays.
    fn synchronise(&mut self) -> Result<(), (Fault, u32)> {
        let mut late = false;
        while timebase::now().has_reached(self.playing.0 + us(WINDOW_US)) {
            self.playing = (self.playing.0 + us(WINDOW_US), self.playing.1.other());
            late = true;
        }
        if late && self.tape.is_some() {
            Err((Fault::MissedDeadline, 0))
        } else {
            Ok(())
        }
    }

    /// Checks the clocks and, while anything may play, the registers on which the plan relies.
    fn check_hardware(&mut self) -> Result<(), (Fault, u32)> {
        if self.crystal.disagrees() {
            return Err((Fault::TimeBase, detail::TIME_BASE_CRYSTAL));
        }
        if usb_clock::disagrees() {
            return Err((Fault::TimeBase, detail::TIME_BASE_USB));
        }
        if self.tape.is_none() {
            return Ok(());
        }
        registers::check(!self.windows.is_multiple_of(2))
    }

    fn inputs(&mut self, sequence: Sequence) -> Inputs {
        let samples = match sequence {
            Sequence::Ended(samples) => Some(samples),
            Sequence::None | Sequence::Converts => None,
        };
        self.angle = samples.map(|s| s.angle).or(self.angle);
        let reading = samples.and_then(|s| {
            let sample = self.sampling.take()?;
            Some(Reading {
                channel: sample.channel,
                second: sample.second,
                raw: self.stage.current(s.current),
            })
        });
        // The captured edge comes first: an edge between the two readings belongs to the next
        // refill, which finds the input active.
        let trigger = timebase::captured();
        let pins::SafetyInputs {
            arm,
            hand_stop,
            over_current,
            held,
        } = self.stage.inputs();
        Inputs {
            arm,
            hand_stop,
            over_current,
            trigger,
            held,
            reading,
        }
    }

    /// Arms the conversion for the window that now plays, from the plan rendered one refill ago.
    /// The requested time is far enough ahead, and the conversion ends before the next refill,
    /// unless this refill is late.
    fn arm_conversion(&mut self, start: Micros) {
        let asked = self.plan.sample;
        let at = asked.map_or(start + us(DEFAULT_SAMPLE_US), |sample| sample.at);
        let armed = timebase::sample_at(at);
        self.sampling = asked.filter(|_| armed);
        if let Some(sample) = &self.sampling {
            let setup = self.pulser.setup();
            self.stage.note_sample(sample, &self.plan, setup);
        }
    }

    /// Writes the plan's amplitudes and paints the plan on the tape. Returns the half that it
    /// occupies.
    fn play(&mut self, start: Micros, playing: Half) -> Result<Half, (Fault, u32)> {
        if let Some(tape) = &self.tape {
            tape.look(start, playing)?;
        }
        if let Some(trips) = &self.plan.trips {
            dac::write_trips(trips);
        }
        for &(channel, code) in &self.plan.dac {
            dac::write(channel, code);
            self.stage.note_dac(channel, code);
        }
        if let Some(tape) = &mut self.tape {
            // SAFETY: `playing` is, or is very nearly, the half that plays, and this is checked
            // below.
            unsafe { tape.paint(&self.plan, playing.other()) };
            tape.check(start, playing)?;
        } else if drives(&self.plan) {
            // SAFETY: no tape exists, and nothing preempts this interrupt.
            self.tape = Some(unsafe { Tape::start(&self.plan, Some(Instant::now()))? });
            return Ok(Half::First);
        }
        Ok(playing.other())
    }

    /// Disconnects the outputs, then writes the record, then clears the amplitudes.
    fn isolate(&mut self) {
        tape::stop();
        self.tape = None;
        (self.plan.sample, self.sampling) = (None, None);
        if let Some(fault) = self.pulser.last_fault() {
            record::keep(&fault);
            self.kept = StoredFault::Latched;
        }
        dac::clear();
    }

    /// Clears the stored record of an acknowledged fault once the fault is over, so that it does
    /// not survive the next reset.
    fn clear_acknowledged(&mut self) {
        self.kept = match self.kept {
            StoredFault::Latched if !self.pulser.is_latched() => {
                record::acknowledge();
                StoredFault::Acknowledged
            }
            StoredFault::Acknowledged if self.pulser.state() != State::Fault => {
                record::clear();
                StoredFault::Nothing
            }
            kept => kept,
        };
    }

    /// Starts the control tick in every fourth window, with the time of the refill's compare match
    /// and not of its end, so that the controller sees no jitter.
    fn tick(&mut self, now: Micros) {
        if self.windows.is_multiple_of(WINDOWS_PER_TICK) {
            TICK.signal(Tick {
                now,
                angle: self.angle.take(),
            });
        }
        self.windows = self.windows.wrapping_add(1);
    }
}

/// Returns whether `plan` has any connected output, change of output, or the pump on.
fn drives(plan: &WindowPlan) -> bool {
    plan.pump || plan.initial != Levels::ISOLATED || !plan.changes.is_empty()
}
