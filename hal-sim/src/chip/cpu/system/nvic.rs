//! Keeps which exceptions are enabled, pending and active, and decides which has priority (Arm ARM
//! B1.5.4, B3.4). Each exception number has one bit, so that system exceptions and interrupts
//! (number 16 + line) are treated alike.

use crate::chip::Cycle;
use crate::chip::cpu::Registers;
use crate::chip::cpu::bus::LINE_WORDS;

/// Number of interrupt lines of the STM32F405 (RM0090 table 62).
pub const LINES: usize = 82;

/// Number of exception numbers: 16 of the system, then the lines.
pub const EXCEPTIONS: usize = 16 + LINES;

/// Exception numbers (Arm ARM table B1-4).
pub(crate) mod number {
    pub const NMI: u16 = 2; // Non-maskable interrupt
    pub const HARD_FAULT: u16 = 3; // Hard fault
    pub const MEM_MANAGE: u16 = 4; // Memory management fault
    pub const BUS_FAULT: u16 = 5; // Bus fault
    pub const USAGE_FAULT: u16 = 6; // Usage fault
    pub const SV_CALL: u16 = 11; // Supervisor call
    pub const PEND_SV: u16 = 14; // Pendable service request
    pub const SYS_TICK: u16 = 15; // System timer
    pub const LINE_0: u16 = 16; // Interrupt line 0
}

/// Execution priority of thread mode with no active exception: every exception pre-empts it.
pub const NO_PRIORITY: i16 = 256;

/// Bits of a priority that the hardware implements, the upper four (RM0090 section 12.1.1).
pub const PRIORITY_BITS: u8 = 0xF0;

/// Exceptions that cannot be disabled.
const ALWAYS_ENABLED: u128 = bit(number::NMI)
    | bit(number::HARD_FAULT)
    | bit(number::SV_CALL)
    | bit(number::PEND_SV)
    | bit(number::SYS_TICK);

/// Exceptions with a configurable priority.
const SETTABLE: u128 = bit(number::MEM_MANAGE)
    | bit(number::BUS_FAULT)
    | bit(number::USAGE_FAULT)
    | bit(number::SV_CALL)
    | bit(number::PEND_SV)
    | bit(number::SYS_TICK)
    | ALL_LINES;

const ALL_LINES: u128 = ((1 << LINES) - 1) << number::LINE_0;

/// Returns a mask with only the bit of exception `number`.
pub const fn bit(number: u16) -> u128 {
    1 << (number & 127)
}

/// Nested vectored interrupt controller: state and priorities of all exceptions. In its masks, bit
/// n stands for exception n.
#[derive(Clone, PartialEq, Debug)]
pub struct Nvic {
    /// Mask of the enabled exceptions.
    pub(crate) enabled: u128,
    /// Mask of the pending exceptions, enabled or not.
    pub(crate) pending: u128,
    /// Mask of the active exceptions, whose handlers have begun and not returned.
    pub(crate) active: u128,
    /// Levels of the interrupt lines when last sampled; line n is bit 16 + n.
    level: u128,
    nmi_level: bool,
    priority: [u8; EXCEPTIONS],
    /// Bits of a priority that decide about pre-emption (AIRCR.PRIGROUP).
    group: u8,
    raised: [Cycle; EXCEPTIONS],
}

impl Default for Nvic {
    fn default() -> Self {
        Self {
            enabled: ALWAYS_ENABLED,
            pending: 0,
            active: 0,
            level: 0,
            nmi_level: false,
            priority: [0; EXCEPTIONS],
            group: group_bits(0),
            raised: [0; EXCEPTIONS],
        }
    }
}

const fn group_bits(prigroup: u32) -> u8 {
    ((0xFF00_u32 << ((prigroup & 7) + 1) >> 8) & 0xFF) as u8
}

/// Returns the numbers of the bits that are set, lowest first.
pub fn numbers(mut bits: u128) -> impl Iterator<Item = u16> {
    std::iter::from_fn(move || {
        let number = bits.trailing_zeros() as u16;
        (bits != 0).then(|| {
            bits &= bits - 1;
            number
        })
    })
}

impl Nvic {
    /// Returns whether both behave the same from now on; the times since which exceptions are
    /// pending may differ.
    pub fn is_equivalent_to(&self, other: &Self) -> bool {
        let mut nvic = self.clone();
        nvic.raised = other.raised;
        nvic == *other
    }

    /// Samples the interrupt lines and NMI at `at`. A line makes its interrupt pending when it
    /// rises, and while it is high and the interrupt is not active (Arm ARM B3.4.1). Returns a mask
    /// of the exceptions that became pending.
    pub fn sample(&mut self, lines: [u32; LINE_WORDS], nmi: bool, at: Cycle) -> u128 {
        let mut level = 0;
        for (word, lines) in lines.into_iter().enumerate() {
            level |= u128::from(lines) << (16 + 32 * word);
        }
        let level = level & ALL_LINES;
        let mut new = level & (!self.level | !self.active);
        self.level = level;
        if nmi && !self.nmi_level {
            new |= bit(number::NMI);
        }
        self.nmi_level = nmi;
        self.pend(new, at)
    }

    /// Makes the exceptions of a mask pending at `at`; returns a mask of those that were not
    /// pending yet.
    pub fn pend(&mut self, exceptions: u128, at: Cycle) -> u128 {
        let new = exceptions & !self.pending;
        if new != 0 {
            self.pending |= new;
            self.set_raised(new, at);
        }
        new
    }

    fn set_raised(&mut self, exceptions: u128, at: Cycle) {
        for number in numbers(exceptions) {
            if let Some(raised) = self.raised.get_mut(usize::from(number)) {
                *raised = at;
            }
        }
    }

    /// Clears the pending state of the exceptions of a mask.
    pub fn unpend(&mut self, exceptions: u128) {
        self.pending &= !exceptions;
    }

    /// Enables or disables the fault exceptions (SHCSR) and interrupt lines of a mask. If an
    /// enabled exception is already pending, its latency counts from here.
    pub fn enable(&mut self, exceptions: u128, on: bool, at: Cycle) {
        if on {
            self.set_raised(exceptions & self.pending & !self.enabled, at);
            self.enabled |= exceptions;
        } else {
            self.enabled &= !(exceptions & !ALWAYS_ENABLED);
        }
    }

    /// Marks `number` as active and no longer pending, when its handler begins.
    pub fn activate(&mut self, number: u16) {
        self.active |= bit(number);
        self.pending &= !bit(number);
    }

    /// Marks `number` as not active, when its handler ends.
    pub fn deactivate(&mut self, number: u16) {
        self.active &= !bit(number);
    }

    /// Returns the cycle from which `number` has last been both pending and enabled.
    pub fn raised_at(&self, number: u16) -> Cycle {
        self.raised.get(usize::from(number)).copied().unwrap_or(0)
    }

    /// Sets AIRCR.PRIGROUP (0–7): the number of the highest bit of a priority that does not count
    /// for pre-emption.
    pub fn set_prigroup(&mut self, prigroup: u32) {
        self.group = group_bits(prigroup);
    }

    /// Returns the priority field of exception `number`, where lower values pre-empt higher ones; 0
    /// if it has none.
    pub fn priority(&self, number: u16) -> u8 {
        self.priority.get(usize::from(number)).copied().unwrap_or(0)
    }

    /// Sets the priority field of `number`, if it has one.
    pub fn set_priority(&mut self, number: u16, priority: u8) {
        if SETTABLE & bit(number) != 0
            && let Some(field) = self.priority.get_mut(usize::from(number))
        {
            *field = priority & PRIORITY_BITS;
        }
    }

    /// Returns the priority that decides whether `number` pre-empts: −2 for NMI, −1 for hard fault,
    /// else the group part of its priority field.
    pub fn group_priority(&self, number: u16) -> i16 {
        match number {
            number::NMI => -2,
            number::HARD_FAULT => -1,
            _ => i16::from(self.priority(number) & self.group),
        }
    }

    /// Returns the pending and enabled exception to take first: by group priority, then
    /// sub-priority, then number.
    pub fn first_pending(&self) -> Option<u16> {
        let candidates = self.pending & self.enabled;
        if candidates == 0 {
            return None;
        }
        numbers(candidates).min_by_key(|&number| match number {
            number::NMI | number::HARD_FAULT => (self.group_priority(number), number),
            _ => (i16::from(self.priority(number)), number),
        })
    }

    /// Returns the present execution priority: the highest priority of the active exceptions, or a
    /// higher one by FAULTMASK, PRIMASK or BASEPRI (Arm ARM B1.5.4).
    pub fn execution_priority(&self, registers: &Registers) -> i16 {
        let unmasked = self.priority_without_primask(registers);
        if registers.primask {
            unmasked.min(0)
        } else {
            unmasked
        }
    }

    /// Returns [`Self::execution_priority`] as if PRIMASK were clear, which decides whether WFI
    /// wakes.
    pub fn priority_without_primask(&self, registers: &Registers) -> i16 {
        let mut priority = numbers(self.active)
            .map(|number| self.group_priority(number))
            .min()
            .unwrap_or(NO_PRIORITY);
        if registers.basepri != 0 {
            priority = priority.min(i16::from(registers.basepri & self.group));
        }
        if registers.faultmask {
            priority = priority.min(-1);
        }
        priority
    }

    /// Returns the pending exception that pre-empts `priority`, if any.
    pub fn preempting(&self, priority: i16) -> Option<u16> {
        self.first_pending()
            .filter(|&number| self.group_priority(number) < priority)
    }

    /// Returns the 32 bits of the mask `bits` that stand for interrupt lines from 32 × `word` on,
    /// as in the registers of the NVIC.
    pub const fn word(bits: u128, word: u32) -> u32 {
        if word < LINE_WORDS as u32 {
            (bits >> (16 + 32 * word)) as u32
        } else {
            0
        }
    }

    /// Returns the mask of the exceptions that the bits of `value` stand for in word `word` of a
    /// register of the NVIC.
    pub const fn exceptions(value: u32, word: u32) -> u128 {
        if word < LINE_WORDS as u32 {
            ((value as u128) << (16 + 32 * word)) & ALL_LINES
        } else {
            0
        }
    }
}
