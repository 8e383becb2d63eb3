//! Register interface of a timer (RM0090 17.4, 18.4).

use super::{IN_FORCE, Mode, Timer, WRITTEN};
use crate::chip::Cycle;
use crate::chip::cpu::bus::{Modelled, Unmodelled};

/// Offsets of the registers from the base of a timer.
pub(crate) mod offset {
    pub const CR1: u32 = 0x00; // Control 1
    pub const CR2: u32 = 0x04; // Control 2
    pub const SMCR: u32 = 0x08; // Slave mode
    pub const DIER: u32 = 0x0C; // DMA and interrupt enable
    pub const SR: u32 = 0x10; // Status
    pub const EGR: u32 = 0x14; // Event generation
    pub const CCMR1: u32 = 0x18; // Capture/compare mode 1
    pub const CCMR2: u32 = 0x1C; // Capture/compare mode 2
    pub const CCER: u32 = 0x20; // Capture/compare enable
    pub const CNT: u32 = 0x24; // Counter
    pub const PSC: u32 = 0x28; // Prescaler
    pub const ARR: u32 = 0x2C; // Auto-reload
    pub const RCR: u32 = 0x30; // Repetition counter (TIM1)
    pub const CCR1: u32 = 0x34; // Capture/compare 1
    pub const CCR4: u32 = 0x40; // Capture/compare 4
    pub const BDTR: u32 = 0x44; // Break and dead time (TIM1)
    pub const OR: u32 = 0x50; // Option (TIM5)
}

/// Bits of the timer registers; the comment at each bit names its register.
pub(crate) mod bit {
    pub const CEN: u32 = 1; // CR1: counter enable
    pub const UDIS: u32 = 1 << 1; // CR1: update disable
    pub const URS: u32 = 1 << 2; // CR1: update requests from overflow only
    pub const OPM: u32 = 1 << 3; // CR1: one-pulse mode
    pub const DIR: u32 = 1 << 4; // CR1: counts down
    // CR1: centre-aligned mode, and direction in which flags are set
    pub const CMS: u32 = 0b11 << 5;
    pub const ARPE: u32 = 1 << 7; // CR1: auto-reload preload
    pub const UIE: u32 = 1; // DIER: update interrupt
    pub const CC1IE: u32 = 1 << 1; // DIER: channel 1 interrupt; the others follow
    pub const INTERRUPTS: u32 = 0x1F; // DIER and SR: update and channels 1–4
    pub const UIF: u32 = 1; // SR: update
    pub const CC1IF: u32 = 1 << 1; // SR: channel 1; the others follow
    pub const CC1OF: u32 = 1 << 9; // SR: channel 1 overcapture
    pub const UG: u32 = 1; // EGR: update
    pub const CC1E: u32 = 1; // CCER: channel 1 enable
    pub const CC1P: u32 = 1 << 1; // CCER: channel 1 polarity
    pub const CC4IF: u32 = 1 << 4; // SR: channel 4
    pub const CC4OF: u32 = 1 << 12; // SR: channel 4 overcapture
    pub const CC4E: u32 = 1 << 12; // CCER: channel 4 enable
    pub const TIE: u32 = 1 << 6; // DIER: trigger interrupt
    pub const OCPE: u32 = 1 << 3; // CCMR: output compare preload
    pub const ECE: u32 = 1 << 14; // SMCR: external clock mode 2
    pub const CCDS: u32 = 1 << 3; // CR2: channels request DMA at updates
}

/// Bits of CR2, besides MMS, that are accepted without effect, in TIM1 and in the other timers.
/// They affect pins in alternate-function mode, COM events, or inputs that are low in this model.
/// CCDS is among them: in TIM1 it does have an effect, on the DMA requests; requests of other
/// timers are not served.
const CR2_IDLE: [u32; 2] = [0x7F8D, 0x88];
/// Bits of DIER, besides interrupts and TIM1's DMA requests, that are accepted without effect, in
/// TIM1 and in the other timers. They enable events that never happen in this model (COM, break, a
/// trigger of TIM1), and requests to DMA1, which has no enabled stream.
const DIER_IDLE: [u32; 2] = [0x60E0, 0x5F40];
/// Existing bits of SMCR.
const SMCR: u32 = 0xFFF7;
/// Existing bits of CCER in TIM1 and in the other timers.
const CCER: [u32; 2] = [0x3FFF, 0xBBBB];

impl Timer {
    /// Reads the register at `offset` in an access complete from `done` on.
    pub fn read(&mut self, offset: u32, done: Cycle) -> Modelled<u32> {
        self.check(offset)?;
        self.advance(done.saturating_sub(1))?;
        Ok(match offset {
            offset::CR1 => self.cr1,
            offset::CR2 => self.cr2,
            offset::SMCR => self.smcr,
            offset::DIER => self.dier,
            offset::SR => self.sr,
            offset::CCMR1 | offset::CCMR2 => self.ccmr[(offset - offset::CCMR1) as usize / 4],
            offset::CCER => self.ccer,
            offset::CNT => self.count,
            offset::PSC => self.psc[WRITTEN],
            offset::ARR => self.shown.unwrap_or(self.arr[WRITTEN]),
            offset::CCR1..=offset::CCR4 => self.read_ccr((offset - offset::CCR1) as usize / 4),
            offset::OR => self.channel_4.option,
            _ => 0, // EGR is write only; RCR and BDTR hold 0
        })
    }

    /// Writes the register at `offset`, with effect from cycle `done` on.
    pub fn write(&mut self, offset: u32, value: u32, done: Cycle) -> Modelled {
        self.check(offset)?;
        self.advance(done.saturating_sub(1))?;
        let value = if self.is_wide(offset) {
            value
        } else {
            value & 0xFFFF
        };
        match offset {
            offset::CR1 => return self.write_cr1(value, done),
            offset::CR2 => {
                self.cr2 = known(value, 0x70 | CR2_IDLE[self.kind()], "a TIM_CR2 bit")?;
            }
            offset::SMCR => return self.write_smcr(value, done),
            offset::DIER => return self.write_dier(value),
            offset::SR => self.sr &= value, // rc_w0
            offset::EGR => return self.write_egr(value, done),
            offset::CCMR1 | offset::CCMR2 => {
                return self.write_ccmr((offset - offset::CCMR1) as usize / 4, value, done);
            }
            offset::CCER => return self.write_ccer(value),
            offset::CNT => self.count = value,
            offset::PSC => self.psc[WRITTEN] = value,
            offset::ARR => self.write_arr(value, done),
            offset::CCR1..=offset::CCR4 => {
                let channel = (offset - offset::CCR1) as usize / 4;
                if self.is_preloaded(channel) {
                    self.preload[channel] = value;
                } else if !self.is_input(channel) {
                    self.ccr[channel] = value;
                }
            }
            // TI4_RMP: the pin or the LSI.
            offset::OR => self.channel_4.option = known(value, 1 << 6, "a TIM5_OR remap")?,
            _ => {
                known(value, 0, "TIM1_RCR or TIM1_BDTR")?;
            }
        }
        Ok(())
    }

    /// Returns the index into pairs of values: the first is TIM1's, the second that of the other
    /// timers.
    const fn kind(&self) -> usize {
        (self.number != 1) as usize
    }

    fn check(&self, offset: u32) -> Modelled {
        let advanced = matches!(offset, offset::RCR | offset::BDTR);
        let known = offset <= offset::BDTR && offset.is_multiple_of(4);
        let option = offset == offset::OR && self.number == 5;
        if option || known && (!advanced || self.number == 1) {
            Ok(())
        } else {
            Err(Unmodelled("a TIM register"))
        }
    }

    /// Returns whether the register is 32 bits wide: those of TIM2 and TIM5 that hold counts.
    const fn is_wide(&self, offset: u32) -> bool {
        matches!(self.number, 2 | 5)
            && matches!(
                offset,
                offset::CNT | offset::ARR | offset::CCR1..=offset::CCR4
            )
    }

    /// Returns CCR of `channel`. Reading it clears the flag of an input (RM0090 18.4.5).
    fn read_ccr(&mut self, channel: usize) -> u32 {
        if self.is_input(channel) {
            self.sr &= !(bit::CC1IF << channel);
        }
        match self.is_preloaded(channel) {
            true => self.preload[channel],
            false => self.ccr[channel],
        }
    }

    fn write_cr1(&mut self, value: u32, done: Cycle) -> Modelled {
        let before = self.cr1;
        self.cr1 = known(value, 0x3FF, "a TIM_CR1 bit")?;
        if value & bit::CMS != 0 {
            self.cr1 = value & !bit::DIR | before & bit::DIR; // the counter sets the direction
        }
        if self.is_started() && value & bit::CEN == 0 {
            return Err(Unmodelled(
                "a TIM_CR1.CEN that is 0 in a timer that a trigger has started",
            ));
        }
        if before & bit::CEN != value & bit::CEN {
            if value & bit::CEN == 0 {
                self.ticks.stop(done);
            } else {
                self.restart(done);
            }
        }
        Ok(())
    }

    fn write_smcr(&mut self, value: u32, done: Cycle) -> Modelled {
        let clocked_by = |item: &Self| (item.is_slave(), item.is_halted());
        let before = clocked_by(self);
        let mode = value & 0b111;
        // TIM2's trigger comes every microsecond, too fast to be a gate or a reset.
        let is_fast = self.number == 2 && value & 0x70 == 0 && matches!(mode, 4 | 5);
        if is_fast && value & bit::ECE == 0 {
            return Err(Unmodelled("a TIM_SMCR mode"));
        }
        self.smcr = known(value, SMCR, "a TIM_SMCR bit")?;
        if self.is_started() && self.cr1 & bit::CEN == 0 {
            return Err(Unmodelled(
                "a TIM_CR1.CEN that is 0 in a timer that a trigger has started",
            ));
        }
        if before != clocked_by(self) {
            self.ticks.stop(done);
            self.ticks.forget_place();
            self.restart(done);
        }
        Ok(())
    }

    fn write_dier(&mut self, value: u32) -> Modelled {
        let requests = if self.number == 1 { 0x1F00 } else { 0 };
        let allowed = bit::INTERRUPTS | requests | DIER_IDLE[self.kind()];
        self.dier = known(value, allowed, "a TIM_DIER bit")?;
        Ok(())
    }

    /// Executes UG: the counter and prescaler restart and the preloads take effect; UIF is set only
    /// if URS is 0 (RM0090 18.3.2). The counter becomes 0, which matches every CCR that is 0.
    fn write_egr(&mut self, value: u32, done: Cycle) -> Modelled {
        if known(value, bit::UG, "a TIM_EGR bit")? == 0 {
            return Ok(());
        }
        known(
            self.dier,
            bit::INTERRUPTS,
            "an update event (UG) that requests DMA",
        )?;
        self.count = 0;
        for channel in 0..4 {
            if self.ccr[channel] == 0 && !self.is_input(channel) {
                self.sr |= bit::CC1IF << channel;
            }
        }
        if self.cr1 & bit::UDIS == 0 {
            self.psc[IN_FORCE] = self.psc[WRITTEN];
            self.arr[IN_FORCE] = self.arr[WRITTEN];
            if self.cr1 & bit::URS == 0 {
                self.sr |= bit::UIF;
            }
        }
        if self.is_slave() {
            return Ok(());
        }
        let running = self.ticks.are_running();
        self.ticks.stop(done);
        self.ticks.forget_place();
        if running {
            let period = self.tick_period();
            let edge = done.next_multiple_of(self.divider);
            self.ticks.set(edge + period, period);
        } else {
            self.restart(done);
        }
        Ok(())
    }

    /// Writes CCMR. Clear (OCxCE) and fast (OCxFE) need a high ETR or a trigger in PWM modes, which
    /// never happen in this model. An input of channels 2 to 4 captures nothing while its CCxE is
    /// 0.
    fn write_ccmr(&mut self, half: usize, value: u32, done: Cycle) -> Modelled {
        for channel in [2 * half, 2 * half + 1] {
            let field = value >> (8 * (channel % 2)) & 0xFF;
            match (field & 0b11, channel) {
                (0, _) if self.number == 2 || field & bit::OCPE == 0 => (),
                // IC1 on TI1, or TIM2's on its trigger, any prescaler.
                (1, 0) => (),
                (3, 0) if self.number == 2 => (),
                // IC4 on TI4, any prescaler, no filter.
                (1, 3) if self.number == 5 && field >> 4 == 0 => (),
                (_, 1..) if self.ccer >> (4 * channel) & bit::CC1E == 0 => (),
                _ => return Err(Unmodelled("a capture setting (CCMR)")),
            }
        }
        let before = self.ccmr[half];
        self.ccmr[half] = value;
        for channel in [2 * half, 2 * half + 1] {
            let shift = 8 * (channel % 2);
            if value & !before & bit::OCPE << shift != 0 {
                self.preload[channel] = self.ccr[channel];
            }
            if self.is_input(channel) {
                continue;
            }
            match self.mode(channel)? {
                Mode::ForceInactive => self.reference[channel] = false,
                Mode::ForceActive => {
                    let rises = channel == 2 && !self.reference[2] && self.cr2 >> 4 & 0b111 == 6;
                    self.rises.extend(rises.then_some(done));
                    self.reference[channel] = true;
                }
                _ => {}
            }
        }
        Ok(())
    }

    fn write_ccer(&mut self, value: u32) -> Modelled {
        // Outputs reach no pin: none has the timer's function. CC1NP of an input is reserved, or
        // selects both edges; TIM5's channel 4 captures rising edges only.
        let captures = (1..4).any(|n| {
            let refused = if (self.number, n) == (5, 3) {
                0b1010
            } else {
                bit::CC1E
            };
            self.is_input(n) && value >> (4 * n) & refused != 0
        });
        if captures || self.is_input(0) && value & 1 << 3 != 0 {
            return Err(Unmodelled("a TIM input (CCER)"));
        }
        self.ccer = known(value, CCER[self.kind()], "a TIM output or input (CCER)")?;
        if value & bit::CC1E == 0 {
            self.input.begin(); // resets the prescaler (RM0090 18.4.7)
        }
        Ok(())
    }

    fn write_arr(&mut self, value: u32, done: Cycle) {
        self.arr[WRITTEN] = value;
        self.shown = None;
        if self.cr1 & bit::ARPE != 0 {
            return;
        }
        let was_blocked = self.arr[IN_FORCE] == 0;
        self.arr[IN_FORCE] = value;
        if value == 0 && !self.is_slave() && !self.is_halted() {
            self.ticks.stop(done);
        } else if was_blocked {
            self.restart(done);
        }
    }
}

/// Returns `value` if it has no bits other than `allowed`.
fn known(value: u32, allowed: u32, feature: &'static str) -> Modelled<u32> {
    if value & !allowed == 0 {
        Ok(value)
    } else {
        Err(Unmodelled(feature))
    }
}
