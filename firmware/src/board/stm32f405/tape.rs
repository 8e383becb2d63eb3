//! The self-erasing tape in SRAM2 and the hardware that plays it.
//!
//! TIM1 overflows every microsecond. In that microsecond, in this order:
//!
//! | TIM1 count | event | DMA2 stream | moves |
//! |---|---|---|---|
//! | 0 | update | `play[0]` | first tape → BSRR of the first port |
//! | 8 | CH1 | `play[1]` | second tape → BSRR of the second port, 48 ns after the first |
//! | 20 | CH2 | `erase[0]` | isolated word → first tape, the slot just played |
//! | 32 | CH3 | `erase[1]` | isolated word → second tape |
//!
//! Ports and streams are the board's ([`crate::board::wiring`]). All streams move 32 bits, in
//! direct mode, circular over two windows. A play stream fetches its next word as soon as the
//! last is out, so a slot must be painted before the slot ahead of it begins.

use super::pac::dma::{St, vals};
use super::pac::{DMA2, RCC, TIM1};
use super::timebase::Instant;
use super::{crystal, memory, pace, pins, timebase};
use crate::board::wiring::{BOARD, BoardPins, TAPE_PORTS};
use crate::pulse::WindowPlan;
use crate::pulse::tape::{SLOTS, Window, isolated_words, paint};
use crate::safety::Fault;
use crate::units::Micros;
use core::cell::UnsafeCell;
use core::sync::atomic::{Ordering, compiler_fence};

/// Slots of the tape: two windows.
const LENGTH: usize = 2 * SLOTS;
const LENGTH_16: u16 = LENGTH as u16; // 500

const PLAY_FIRST: usize = BOARD.streams.play[0] as usize;
const PLAY_SECOND: usize = BOARD.streams.play[1] as usize;
const ERASE_FIRST: usize = BOARD.streams.erase[0] as usize;
const ERASE_SECOND: usize = BOARD.streams.erase[1] as usize;
const STREAMS: [usize; 4] = [PLAY_FIRST, PLAY_SECOND, ERASE_FIRST, ERASE_SECOND];
/// Of each port, the word that isolates it.
const ISOLATED: [u32; TAPE_PORTS] = isolated_words::<BoardPins>();

/// All four transfers of a microsecond are over from here on: the last request
/// comes at 32, and four transfers of two bus accesses each take less than 40
/// cycles. Reading the positions takes about 60.
const QUIET: core::ops::Range<u16> = 72..100;
const _: () = assert!(QUIET.end as u32 + 60 < timebase::CYCLES_PER_US);
/// Time to wait for a stream to finish its transfer or for the quiet part of
/// a microsecond, in polls of at least 5 cycles: at least 20 µs.
const PATIENCE: usize = 700;

/// Last slot in which a paint may end: the next window's first word is
/// fetched when slot 249 plays.
const LAST_SLOT: u32 = SLOTS as u32 - 3;

#[repr(C)]
struct Memory {
    /// The words of each port.
    words: [[u32; LENGTH]; TAPE_PORTS],
    isolated: [u32; TAPE_PORTS],
}

struct Shared(UnsafeCell<Memory>);

// SAFETY: reached through raw pointers by the one `Tape` and by DMA2 only;
// `Tape::window` says why they never meet in one window.
unsafe impl Sync for Shared {}

/// Alone in SRAM2, a bus slave of its own, away from every stack. The section
/// is not loaded: `Tape::start` writes every word before a stream reads one.
#[unsafe(link_section = ".tape")]
static MEMORY: Shared = Shared(UnsafeCell::new(Memory {
    words: [[0; LENGTH]; TAPE_PORTS],
    isolated: [0; TAPE_PORTS],
}));

/// The half of the tape that a window occupies.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Half {
    /// Slots 0–249.
    First,
    /// Slots 250–499.
    Second,
}

impl Half {
    /// The other half.
    #[must_use]
    pub const fn other(self) -> Self {
        match self {
            Self::First => Self::Second,
            Self::Second => Self::First,
        }
    }

    const fn first_slot(self) -> usize {
        match self {
            Self::First => 0,
            Self::Second => SLOTS,
        }
    }
}

/// The running tape. One exists, owned by the refill interrupt.
pub struct Tape {
    /// NDTR of each stream before its first request: 500, or 499 should the
    /// fetched-ahead word be counted. RM0090 10.3.8 counts transfers on the
    /// peripheral port, which gives 500; measured, so that it need not be known.
    origins: [u16; 4],
    /// Where in a lap of [`crystal`] device time 0 lies, as the first check found it.
    offset: Option<u16>,
}

impl Tape {
    /// Erases the whole tape, paints `plan` on its first half and starts it:
    /// slot 0 plays at `plan.start`. That becomes the time now; or, after a
    /// fault stop, when the clock that ran on `since` then gets there, which is
    /// awaited: up to a window with nothing on the outputs.
    ///
    /// # Errors
    /// [`Fault::TapeSlip`] if DMA2 carries another stream, a stream does not
    /// stop, or one starts from an impossible position;
    /// [`Fault::MissedDeadline`] if `plan.start` is past or too near.
    ///
    /// # Safety
    /// Any earlier `Tape` must be gone, and the caller must not be preempted
    /// by a user of the tape.
    pub unsafe fn start(plan: &WindowPlan, since: Option<Instant>) -> Result<Self, Fault> {
        RCC.ahb1enr().modify(|w| w.set_dma2en(true));
        RCC.apb2enr().modify(|w| w.set_tim1en(true));
        // The reset also drops requests that stopped play streams left unserved.
        RCC.apb2rstr().modify(|w| w.set_tim1rst(true));
        RCC.apb2rstr().modify(|w| w.set_tim1rst(false));
        for stream in STREAMS {
            if !switch_off(stream) {
                return Err(Fault::TapeSlip);
            }
        }
        pins::isolate();
        assert_alone()?;
        erase_all();
        let mut tape = Self {
            origins: [0; 4],
            offset: None,
        };
        // SAFETY: all four streams are off: nothing plays.
        unsafe { tape.paint(plan, Half::First) };
        let memory = MEMORY.0.get();
        // SAFETY: `memory` points to a static; only addresses are taken.
        let (first, second, isolated_first, isolated_second) = unsafe {
            (
                &raw mut (*memory).words[0],
                &raw mut (*memory).words[1],
                &raw mut (*memory).isolated[0],
                &raw mut (*memory).isolated[1],
            )
        };
        let [first_port, second_port] = pins::TAPE_PORTS.map(|port| port.bsrr().as_ptr() as u32);
        play(PLAY_FIRST, first_port, first as u32);
        play(PLAY_SECOND, second_port, second as u32);
        erase(ERASE_FIRST, isolated_first as u32, first as u32);
        erase(ERASE_SECOND, isolated_second as u32, second as u32);
        cortex_m::asm::delay(64); // the play streams fetch slot 0
        tape.origins = STREAMS.map(|s| DMA2.st(s).ndtr().read().ndt());
        let [play_first, play_second, erase_first, erase_second] = tape.origins;
        let fetched = [play_first, play_second].map(|o| LENGTH_16.wrapping_sub(o));
        let erased = [erase_first, erase_second];
        if fetched.iter().any(|&n| n > 1) || erased != [LENGTH_16; TAPE_PORTS] {
            return Err(Fault::TapeSlip);
        }
        // Enabling a stream may leave its FIFO flag set; from here on, none may.
        STREAMS.into_iter().for_each(clear_flags);
        pace::prepare();
        timebase::start(plan.start);
        if let Some(instant) = since {
            pace::await_start(instant.cycle_of(plan.start))?;
        }
        TIM1.cr1().modify(|w| w.set_cen(true));
        Ok(tape)
    }

    /// Whether the window `(start, half)` is playing: all streams agree on the slot,
    /// and with the clock, which agrees with the core's, and no error flag is up.
    ///
    /// TIM11 counts the core's cycles here, not CYCCNT, which stops in sleep or for good
    /// when a debugger detaches. It is known to count right ([`crystal`]), and what a lap
    /// of 8 µs cannot tell, steps of whole laps, the streams' positions do.
    ///
    /// # Errors
    /// [`Fault::MissedDeadline`] if the window is over or so nearly over that
    /// the next one is being fetched; [`Fault::TimeBase`] if device time has gained or
    /// lost against the core's cycles; [`Fault::TapeSlip`] for the rest.
    pub fn check(&mut self, start: Micros, half: Half) -> Result<(), Fault> {
        let (now, positions, offset) = observe().ok_or(Fault::TapeSlip)?;
        // TIM1 counts the core's own clock. A count one off costs 250 cycles in its
        // first window, and what is lost adds up; flash takes some more or less.
        const TOLERANCE: u16 = 60;
        let lost = offset.abs_diff(*self.offset.get_or_insert(offset)); // below a lap
        if lost.min(crystal::LAP - lost) > TOLERANCE {
            return Err(Fault::TimeBase);
        }
        let played = played(now, start, half)?;
        let agree = positions
            .iter()
            .zip(self.origins)
            .all(|(&ndtr, origin)| ndtr == origin - played);
        if agree && !has_failed() && isolated_words_intact() {
            Ok(())
        } else {
            Err(Fault::TapeSlip)
        }
    }

    /// Whether all streams are within a slot or two of where the clock has them in
    /// the window `(start, half)`, so that the other half may be painted; what
    /// [`Self::check`] says for certain costs the wait for a quiet moment.
    ///
    /// # Errors
    /// As there.
    pub fn look(&self, start: Micros, half: Half) -> Result<(), Fault> {
        // While the positions are read, at most one microsecond begins.
        let played = played(timebase::now(), start, half)?;
        let is_near = |(stream, origin): (usize, u16)| {
            let ndtr = DMA2.st(stream).ndtr().read().ndt();
            origin.wrapping_sub(ndtr).wrapping_sub(played - 1) <= 2
        };
        if STREAMS.into_iter().zip(self.origins).all(is_near) {
            Ok(())
        } else {
            Err(Fault::TapeSlip)
        }
    }

    /// Paints `plan` on the window `half`.
    ///
    /// # Safety
    /// `look` must just have said that the other half is playing, and `check` must be
    /// asked after painting; or no stream may run.
    pub unsafe fn paint(&mut self, plan: &WindowPlan, half: Half) {
        publish();
        let first = half.first_slot();
        let memory = MEMORY.0.get();
        // SAFETY: the streams are in the other half, by the caller's check,
        // and stay there for the rest of its 250 µs; all of this half has been
        // erased and none of it fetched. `&mut self` keeps it to one window, and
        // nothing preempts the refill.
        let (_writable, mut window) = unsafe {
            let at_first = (&raw mut (*memory).words[0]).cast::<u32>().add(first);
            let at_second = (&raw mut (*memory).words[1]).cast::<u32>().add(first);
            let window = Window {
                first: &mut *at_first.cast(),
                second: &mut *at_second.cast(),
            };
            (memory::writable_tape(), window)
        };
        paint::<BoardPins>(plan, &mut window);
        publish();
    }
}

/// Slots that have played once those up to `now` have, 1–498: below every origin, so
/// that no reload lies between.
fn played(now: Micros, start: Micros, half: Half) -> Result<u16, Fault> {
    let slot = now.elapsed_since(start);
    if slot > LAST_SLOT {
        return Err(Fault::MissedDeadline);
    }
    Ok((half.first_slot() as u32 + slot + 1) as u16) // at most 250 + 247 + 1
}

/// Orders the CPU's accesses to the tape with DMA2's, both ways.
fn publish() {
    compiler_fence(Ordering::SeqCst);
    cortex_m::asm::dmb();
}

/// Fault stop: disables the play streams, waits until they are off (bounded),
/// isolates by the CPU and stops the pump. Callable from anywhere, at any
/// time, more than once. The erase streams and the clock go on.
pub fn stop() {
    let is_first_off = switch_off(PLAY_FIRST);
    let is_second_off = switch_off(PLAY_SECOND);
    if !(is_first_off && is_second_off) {
        TIM1.dier().modify(|w| {
            w.set_ude(false);
            w.set_ccde(0, false);
        });
    }
    pins::isolate();
}

/// Disables `stream` and says whether it is off (RM0090 10.3.17: EN reads 1
/// until the transfer under way is over).
fn switch_off(stream: usize) -> bool {
    let cr = DMA2.st(stream).cr();
    cr.modify(|w| w.set_en(false));
    (0..PATIENCE).any(|_| !cr.read().en())
}

/// DMA2 must carry the four streams only, none with an APB address: serving
/// AHB and APB at once corrupts data (ES0182, DMA2 concurrent AHB and APB).
/// That all four have AHB addresses is visible in `start`.
fn assert_alone() -> Result<(), Fault> {
    let others = (0..8).filter(|s| !STREAMS.contains(s));
    if others.into_iter().any(|s| DMA2.st(s).cr().read().en()) {
        Err(Fault::TapeSlip)
    } else {
        Ok(())
    }
}

fn erase_all() {
    let memory = MEMORY.0.get();
    // SAFETY: all four streams are off and no `Tape` exists, so nothing else
    // touches the memory. Every word is written: none is read before.
    unsafe {
        let _writable = memory::writable_tape();
        (*memory).words[0].fill(ISOLATED[0]);
        (*memory).words[1].fill(ISOLATED[1]);
        (&raw mut (*memory).isolated[0]).write_volatile(ISOLATED[0]);
        (&raw mut (*memory).isolated[1]).write_volatile(ISOLATED[1]);
    }
    publish();
}

fn isolated_words_intact() -> bool {
    let memory = MEMORY.0.get();
    // SAFETY: two words that only `erase_all` writes, and DMA2 reads.
    unsafe {
        (&raw const (*memory).isolated[0]).read_volatile() == ISOLATED[0]
            && (&raw const (*memory).isolated[1]).read_volatile() == ISOLATED[1]
    }
}

fn play(stream: usize, bsrr: u32, tape: u32) {
    configure(stream, vals::Dir::MEMORY_TO_PERIPHERAL, bsrr, tape);
}

fn erase(stream: usize, isolated: u32, tape: u32) {
    configure(stream, vals::Dir::PERIPHERAL_TO_MEMORY, isolated, tape);
}

/// RM0090 10.3.17 and 10.5.5. The tape is the memory side and increments; the
/// other side, BSRR or the isolated word, does not.
fn configure(stream: usize, direction: vals::Dir, peripheral: u32, tape: u32) {
    let st: St = DMA2.st(stream);
    clear_flags(stream);
    st.par().write_value(peripheral);
    st.m0ar().write_value(tape);
    st.ndtr().write(|w| w.set_ndt(LENGTH_16));
    st.fcr().write(|w| w.set_dmdis(vals::Dmdis::ENABLED)); // direct mode
    st.cr().write(|w| {
        w.set_chsel(BOARD.streams.channel);
        w.set_pl(vals::Pl::VERY_HIGH);
        w.set_msize(vals::Size::BITS32);
        w.set_psize(vals::Size::BITS32);
        w.set_minc(true);
        w.set_pinc(false);
        w.set_circ(true);
        w.set_dir(direction);
    });
    st.cr().modify(|w| w.set_en(true));
}

/// LISR holds streams 0–3, HISR 4–7.
fn clear_flags(stream: usize) {
    DMA2.ifcr(stream / 4).write(|w| {
        w.set_feif(stream % 4, true);
        w.set_dmeif(stream % 4, true);
        w.set_teif(stream % 4, true);
        w.set_htif(stream % 4, true);
        w.set_tcif(stream % 4, true);
    });
}

/// Whether a stream is off, or flags a transfer error, direct mode error or FIFO
/// error: in direct mode the last two mean a request that came before the word
/// was there (RM0090 10.3.18).
fn has_failed() -> bool {
    let flags = DMA2.isr(0).read().0 & FAILURES[0] | DMA2.isr(1).read().0 & FAILURES[1];
    flags != 0 || STREAMS.into_iter().any(|s| !DMA2.st(s).cr().read().en())
}

/// TEIF, DMEIF and FEIF of all four streams, in LISR and HISR (RM0090 10.5.1).
const FAILURES: [u32; 2] = {
    let (mut masks, mut n) = ([0; 2], 0);
    while n < STREAMS.len() {
        let stream = STREAMS[n]; // below 8
        let place = [0, 6, 16, 22][stream % 4];
        masks[stream / 4] |= 0b00_1101 << place;
        n += 1;
    }
    masks
};

/// Device time, the four NDTRs, and where in a lap of [`crystal`] device time 0 lies, read
/// within the quiet part of one microsecond; `None` if TIM1 stands still.
fn observe() -> Option<(Micros, [u16; 4], u16)> {
    let count = || TIM1.cnt().read().cnt();
    (0..PATIENCE).find_map(|_| {
        let (before, lap) = (count(), crystal::count());
        if !QUIET.contains(&before) {
            return None;
        }
        let now = timebase::now();
        let positions = STREAMS.map(|s| DMA2.st(s).ndtr().read().ndt());
        // Below a lap: 7 µs, and less than one.
        let since = (now.get() % LAP_US * timebase::CYCLES_PER_US) as u16 + before;
        let offset = lap.checked_sub(since);
        let offset = offset.unwrap_or_else(|| lap + (crystal::LAP - since));
        // A later count in the same microsecond; an interruption in between
        // could hide one whole microsecond only by lasting one: try again.
        (count() > before && timebase::now() == now).then_some((now, positions, offset))
    })
}

/// A lap of [`crystal`] in device time, which wraps after a whole number of them.
const LAP_US: u32 = crystal::LAP as u32 / timebase::CYCLES_PER_US;
const _: () = assert!(LAP_US * timebase::CYCLES_PER_US == crystal::LAP as u32);
const _: () = assert!(LAP_US.is_power_of_two());
