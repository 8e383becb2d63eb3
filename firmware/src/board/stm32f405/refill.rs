//! The Pulser's context: the interrupt 2 µs into each 250 µs window renders
//! the next one. The over-current and supply interrupts share its priority,
//! the highest, and so does the second clock, by which it is overdue: none of the four
//! can interrupt another.

use super::adc::{self, Sequence};
use super::control::{TICK, Tick};
use super::crystal::Crystal;
use super::pac::{EXTI, Interrupt, SYSCFG};
use super::tape::{self, Half, Tape};
use super::timebase::Instant;
use super::watchdog::{self, Owner};
use super::{
    InterruptPriority, dac, emergency, overdue, pins, record, registers, timebase, usb_clock,
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

/// When nothing asks for a mid-phase sample, the joint angle is still sampled
/// once a window, here.
const DEFAULT_SAMPLE_US: u32 = 125;

struct Refill {
    /// Interrupts when the next refill is overdue.
    second_clock: SYST,
    crystal: Crystal,
    pulser: Pulser,
    mail: PulserMail<'static>,
    /// `None` after a fault stop, until a plan wants outputs again.
    tape: Option<Tape>,
    plan: WindowPlan,
    /// Start and half of the window that is playing.
    playing: (Micros, Half),
    /// The mid-phase that the armed conversion samples.
    sampling: Option<Sample>,
    angle: Option<u16>,
    windows: u32,
    kept: StoredFault,
}

/// What the backup registers hold.
#[derive(Clone, Copy)]
enum StoredFault {
    Nothing,
    Latched,
    Acknowledged,
}

static MEMORY: StaticCell<Refill> = StaticCell::new();
/// Null until `start`; then reached from interrupts of one priority only.
static REFILL: AtomicPtr<Refill> = AtomicPtr::new(null_mut());

/// Runs `act` on the refill, from one of its four interrupts.
fn with_refill(act: impl FnOnce(&mut Refill)) {
    // SAFETY: points into `MEMORY`, exclusively: `start` gave its reference
    // away, and interrupts of one priority do not interrupt one another.
    if let Some(refill) = unsafe { REFILL.load(Ordering::Acquire).as_mut() } {
        act(refill);
    }
}

/// Starts the tape at device time 0 and hands a pulser to the interrupt; `latched` is
/// the fault that the reset found, `found` what it found spent of time and charge.
///
/// # Errors
/// As [`Tape::start`].
///
/// # Safety
/// Once, from the thread, while no other context uses the tape or the pins.
pub unsafe fn start(
    latched: Option<FaultRecord>,
    found: UsageAtBoot,
    mail: PulserMail<'static>,
    nvic: &mut NVIC,
    second_clock: SYST,
) -> Result<(), Fault> {
    // In place: it is too large to lie on the stack first.
    let refill = MEMORY.init_with(|| Refill {
        kept: latched.map_or(StoredFault::Nothing, |_| StoredFault::Latched),
        second_clock,
        crystal: Crystal::start(),
        pulser: Pulser::new(latched, found),
        mail,
        tape: None,
        plan: WindowPlan::new(),
        playing: (Micros::new(0), Half::First),
        sampling: None,
        angle: None,
        windows: 0,
    });
    // SAFETY: the caller's promise: there is no other tape or user of one.
    refill.tape = Some(unsafe { Tape::start(&refill.plan, None)? });
    overdue::start(&mut refill.second_clock);
    REFILL.store(refill, Ordering::Release);
    watch_over_current();
    for line in [Interrupt::TIM2, Interrupt::EXTI9_5, Interrupt::PVD] {
        // SAFETY: no critical section relies on a priority; the state these
        // interrupts use is in place.
        unsafe {
            nvic.set_priority(line, InterruptPriority::Refill as u8);
            NVIC::unmask(line);
        }
    }
    Ok(())
}

/// A falling edge.
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

/// At the refill's priority, which is that of reset.
#[exception]
fn SysTick() {
    with_refill(Refill::is_overdue);
}

#[interrupt]
fn EXTI9_5() {
    tape::stop();
    EXTI.pr(0)
        .write(|w| w.set_line(pins::OVER_CURRENT_LINE, true));
    with_refill(|refill| refill.stop(Fault::OverCurrent));
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
        // Before all else, so that no more than two windows lie between two readings.
        if let Err(fault) = self.check_hardware() {
            self.stop(fault);
        }
        let sequence = adc::read();
        let inputs = self.inputs(sequence);
        // What a trigger does within a sequence, the manual does not say.
        if sequence != Sequence::Converts {
            self.arm_conversion(start);
        }

        let now = timebase::now();
        let rendered = self
            .pulser
            .refill(now, next, &inputs, &mut self.mail, &mut self.plan);
        let put_out = synchronised
            .and(rendered)
            .and_then(|()| self.play(start, half));
        let half = put_out.unwrap_or_else(|fault| {
            self.stop(fault); // keeps an earlier one, the pulser's own included
            half.other()
        });
        self.playing = (next, half);
        self.clear_acknowledged();
        registers::keep_debug_bits(!self.windows.is_multiple_of(2));
        self.tick(start + us(REFILL_OFFSET_US));
        watchdog::check_in(Owner::Pulser);
    }

    /// Its own clock did not bring it: nothing that plays is to be trusted.
    fn is_overdue(&mut self) {
        if self.tape.is_some() {
            self.stop(Fault::MissedDeadline);
        }
    }

    /// Isolates and latches `fault`; the outputs first, for the rest takes 20 µs.
    #[inline(never)]
    fn stop(&mut self, fault: Fault) {
        tape::stop();
        self.pulser.fault(fault, timebase::now(), &mut self.mail);
        self.isolate();
    }

    /// Catches up with the clock if a window passed without its refill, which
    /// is a fault if anything plays.
    fn synchronise(&mut self) -> Result<(), Fault> {
        let mut late = false;
        while timebase::now().has_reached(self.playing.0 + us(WINDOW_US)) {
            self.playing = (self.playing.0 + us(WINDOW_US), self.playing.1.other());
            late = true;
        }
        if late && self.tape.is_some() {
            Err(Fault::MissedDeadline)
        } else {
            Ok(())
        }
    }

    /// Holds clocks, and while anything may play registers, against what the plan relies on.
    fn check_hardware(&mut self) -> Result<(), Fault> {
        if self.crystal.disagrees() || usb_clock::disagrees() {
            return Err(Fault::TimeBase);
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
                raw: s.current,
            })
        });
        // First: an edge that comes in between is the next refill's, which finds it held.
        let trigger = timebase::captured();
        let pins::SafetyInputs {
            arm,
            hand_stop,
            over_current,
            held,
        } = pins::safety_inputs();
        Inputs {
            arm,
            hand_stop,
            over_current,
            trigger,
            held,
            reading,
        }
    }

    /// The plan still is that of the window now playing: it was rendered one refill
    /// ago. What it asks for lies far enough ahead, and ends before the next refill,
    /// unless this one is late.
    fn arm_conversion(&mut self, start: Micros) {
        let asked = self.plan.sample;
        let at = asked.map_or(start + us(DEFAULT_SAMPLE_US), |sample| sample.at);
        let armed = timebase::sample_at(at);
        self.sampling = asked.filter(|_| armed);
    }

    /// Writes the plan's amplitudes and paints it. Returns the half it is on.
    fn play(&mut self, start: Micros, playing: Half) -> Result<Half, Fault> {
        if let Some(tape) = &self.tape {
            tape.look(start, playing)?;
        }
        if let Some(trips) = &self.plan.trips {
            dac::write_trips(trips);
        }
        for &(channel, code) in &self.plan.dac {
            dac::write(channel, code);
        }
        if let Some(tape) = &mut self.tape {
            // SAFETY: `playing` plays, or nearly so, and it is checked below.
            unsafe { tape.paint(&self.plan, playing.other()) };
            tape.check(start, playing)?;
        } else if drives(&self.plan) {
            // SAFETY: there is no tape, and nothing preempts this interrupt.
            self.tape = Some(unsafe { Tape::start(&self.plan, Some(Instant::now()))? });
            return Ok(Half::First);
        }
        Ok(playing.other())
    }

    /// Outputs first, then the record, then the amplitudes.
    fn isolate(&mut self) {
        tape::stop();
        self.tape = None;
        (self.plan.sample, self.sampling) = (None, None);
        if let Some(fault) = self.pulser.last_fault() {
            record::keep(&fault, 0);
            self.kept = StoredFault::Latched;
        }
        dac::clear();
    }

    /// An acknowledged fault need not outlive the next reset, once it is over.
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

    /// Every fourth window starts the control tick. Its time is that of the
    /// refill's compare, not of its end: the law sees no jitter.
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

/// Whether `plan` wants anything but isolated outputs without supply.
fn drives(plan: &WindowPlan) -> bool {
    plan.pump || plan.initial != Levels::ISOLATED || !plan.changes.is_empty()
}
