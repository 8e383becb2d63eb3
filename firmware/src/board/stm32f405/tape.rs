//! The self-erasing pulse tape in SRAM2 and the hardware that plays it.
//!
//! TIM1 overflows every microsecond. In that microsecond, in this order:
//!
//! | TIM1 count | event | DMA2 stream | moves |
//! |---|---|---|---|
//! | 0 | update | `play[0]` | first tape → BSRR of the first port |
//! | 8 | CH1 | `play[1]` | second tape → BSRR of the second port, 48 ns after the first |
//! | 20 | CH2 | `erase[0]` | disconnect word → first tape, the slot just played |
//! | 32 | CH3 | `erase[1]` | disconnect word → second tape |
//!
//! Ports and streams are those of the board ([`crate::board::wiring`]). All streams move 32 bits,
//! in direct mode, circular over two windows. A play stream fetches its next word as soon as the
//! last word is out, so a slot must be painted before the slot ahead of it begins.

use super::pac::dma::{St, vals};
use super::pac::{DMA2, RCC, TIM1};
use super::timebase::Instant;
use super::{crystal, detail, memory, pace, pins, timebase};
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
/// Word of each port that disconnects its outputs.
const ISOLATED: [u32; TAPE_PORTS] = isolated_words::<BoardPins>();

/// Counts of TIM1 at which all four transfers of a microsecond are over: the last request comes at
/// 32, and four transfers of two bus accesses each take less than 40 cycles. Reading the positions
/// takes about 60 cycles.
const QUIET: core::ops::Range<u16> = 72..100;
const _: () = assert!(QUIET.end as u32 + 60 < timebase::CYCLES_PER_US);
/// Longest wait for a stream to finish its transfer, or for the quiet part of a microsecond, in
/// polls of at least 5 cycles: at least 20 µs.
const PATIENCE: usize = 700;

/// Last slot during which painting may end: the next window's first word is fetched while slot 249
/// plays.
const LAST_SLOT: u32 = SLOTS as u32 - 3;

#[repr(C)]
struct Memory {
    /// Tape of each port, one BSRR word per slot.
    words: [[u32; LENGTH]; TAPE_PORTS],
    isolated: [u32; TAPE_PORTS],
}

struct Shared(UnsafeCell<Memory>);

// SAFETY: only the one `Tape` and DMA2 access this, through raw pointers; `Tape::window` shows why
// they never use the same window.
unsafe impl Sync for Shared {}

/// The tape is alone in SRAM2, a separate bus slave, away from every stack. The section is not
/// loaded: `Tape::start` writes every word before a stream reads one.
#[unsafe(link_section = ".tape")]
static MEMORY: Shared = Shared(UnsafeCell::new(Memory {
    words: [[0; LENGTH]; TAPE_PORTS],
    isolated: [0; TAPE_PORTS],
}));

/// Half of the tape, which holds one window.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Half {
    /// Slots 0–249.
    First,
    /// Slots 250–499.
    Second,
}

impl Half {
    /// Returns the other half.
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

/// The running tape. Only one exists; the refill interrupt owns it.
pub struct Tape {
    /// NDTR of each stream before its first request: 500, or 499 if the word fetched ahead is
    /// counted. RM0090 10.3.8 counts transfers on the peripheral port, which gives 500; the value
    /// is measured so that the code does not depend on this.
    origins: [u16; 4],
    /// Position of device time 0 within a lap of [`crystal`], from the first check.
    offset: Option<u16>,
}

impl Tape {
    /// Erases the whole tape, paints `plan` on its first half and starts it, so that slot 0 plays
    /// at `plan.start`. Without `since`, device time starts there. After a fault stop, device time
    /// has continued: then `since` is a recent instant of it, and this function waits up to one
    /// window for `plan.start`, with nothing on the outputs.
    ///
    /// # Errors
    /// Returns [`Fault::TapeSlip`] with a [`detail`](super::detail) if DMA2 carries another stream, a stream does
    /// not stop, or a stream starts from an impossible position, and [`Fault::MissedDeadline`] if
    /// `plan.start` is past or too near.
    ///
    /// # Safety
    /// No earlier `Tape` may exist, and no user of the tape may preempt the caller.
    pub unsafe fn start(plan: &WindowPlan, since: Option<Instant>) -> Result<Self, (Fault, u32)> {
        RCC.ahb1enr().modify(|w| w.set_dma2en(true));
        RCC.apb2enr().modify(|w| w.set_tim1en(true));
        // The reset also drops unserved requests of stopped play streams.
        RCC.apb2rstr().modify(|w| w.set_tim1rst(true));
        RCC.apb2rstr().modify(|w| w.set_tim1rst(false));
        for stream in STREAMS {
            if !switch_off(stream) {
                return Err((Fault::TapeSlip, detail::NOT_STOPPED));
            }
        }
        pins::isolate();
        assert_alone()?;
        erase_all();
        let mut tape = Self {
            origins: [0; 4],
            offset: None,
        };
        // SAFETY: all four streams are off, so nothing plays.
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
            return Err((Fault::TapeSlip, detail::START));
        }
        // Enabling a stream may set its FIFO flag; from here on a set flag is a fault.
        STREAMS.into_iter().for_each(clear_flags);
        pace::prepare();
        timebase::start(plan.start);
        if let Some(instant) = since {
            pace::await_start(instant.cycle_of(plan.start)).map_err(|fault| (fault, 0))?;
        }
        TIM1.cr1().modify(|w| w.set_cen(true));
        Ok(tape)
    }

    /// Checks that the window `(start, half)` is playing: all streams agree on the slot and with
    /// the clock, the clock agrees with the core's, and no error flag is set.
    ///
    /// TIM11 counts the core's cycles here, because CYCCNT stops in sleep, or permanently when a
    /// debugger detaches. [`crystal`] verifies TIM11. Steps of whole laps of 8 µs, which TIM11
    /// cannot show, show in the streams' positions.
    ///
    /// # Errors
    /// Returns [`Fault::MissedDeadline`] if the window is over or the next one is about to be
    /// fetched, [`Fault::TimeBase`] if device time has drifted from the core's cycles, and
    /// [`Fault::TapeSlip`] otherwise, each with a [`detail`](super::detail).
    pub fn check(&mut self, start: Micros, half: Half) -> Result<(), (Fault, u32)> {
        let observed = observe().ok_or((Fault::TapeSlip, detail::NOT_QUIET));
        let (now, positions, offset) = observed?;
        // TIM1 counts the core's own clock. A count that is off by one costs 250 cycles in its
        // first window, and losses accumulate; waits for flash add or remove a few cycles.
        const TOLERANCE: u16 = 60;
        let lost = offset.abs_diff(*self.offset.get_or_insert(offset)); // less than a lap
        if lost.min(crystal::LAP - lost) > TOLERANCE {
            return Err((Fault::TimeBase, detail::TIME_BASE_TAPE));
        }
        let played = played(now, start, half)?;
        let agree = positions
            .iter()
            .zip(self.origins)
            .all(|(&ndtr, origin)| ndtr == origin - played);
        if agree && !has_failed() && isolated_words_intact() {
            Ok(())
        } else {
            Err((Fault::TapeSlip, self.find_slip(positions, played)))
        }
    }

    /// Returns the [`detail`](super::detail) of a slip found in [`Self::check`].
    #[cold]
    #[inline(never)]
    fn find_slip(&self, positions: [u16; 4], played: u16) -> u32 {
        let mut found = 0;
        let expected = self.origins.map(|origin| origin.wrapping_sub(played));
        for (n, &stream) in STREAMS.iter().enumerate() {
            // FEIF, DMEIF and TEIF are bits 0, 2 and 3 of the stream's six (RM0090 10.5.1).
            let place = [0, 6, 16, 22][stream % 4];
            let flags = DMA2.isr(stream / 4).read().0 >> place;
            let mut bits = flags & 1 | flags >> 1 & 0b110;
            if !DMA2.st(stream).cr().read().en() {
                bits |= detail::OFF;
            }
            found |= bits << (4 * n);
            if positions.get(n) != expected.get(n) {
                found |= detail::POSITION << n;
            }
        }
        if !isolated_words_intact() {
            found |= detail::DISCONNECT_WORD;
        }
        found
    }

    /// Checks that all streams are within a slot or two of their expected positions in the window
    /// `(start, half)`, so that the other half may be painted. [`Self::check`] is exact, but waits
    /// for a quiet moment.
    ///
    /// # Errors
    /// Returns the errors of [`Self::check`].
    pub fn look(&self, start: Micros, half: Half) -> Result<(), (Fault, u32)> {
        // At most one microsecond begins while the positions are read.
        let played = played(timebase::now(), start, half)?;
        let is_near = |(stream, origin): (usize, u16)| {
            let ndtr = DMA2.st(stream).ndtr().read().ndt();
            origin.wrapping_sub(ndtr).wrapping_sub(played - 1) <= 2
        };
        if STREAMS.into_iter().zip(self.origins).all(is_near) {
            Ok(())
        } else {
            Err((Fault::TapeSlip, detail::FAR))
        }
    }

    /// Paints `plan` on the window `half`.
    ///
    /// # Safety
    /// Either `look` has just confirmed that the other half is playing, and `check` is called after
    /// painting; or no stream runs.
    pub unsafe fn paint(&mut self, plan: &WindowPlan, half: Half) {
        publish();
        let first = half.first_slot();
        let memory = MEMORY.0.get();
        // SAFETY: by the caller's check the streams are in the other half, and they stay there for
        // the rest of its 250 µs. All of this half has been erased, and none of it fetched. `&mut
        // self` allows one window at a time, and nothing preempts the refill.
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

/// Returns how many slots of the tape have been played when the slot at `now` ends, 1–498. This is
/// below every origin, so no reload of NDTR lies in between.
fn played(now: Micros, start: Micros, half: Half) -> Result<u16, (Fault, u32)> {
    let slot = now.elapsed_since(start);
    if slot > LAST_SLOT {
        return Err((Fault::MissedDeadline, 0));
    }
    Ok((half.first_slot() as u32 + slot + 1) as u16) // at most 250 + 247 + 1
}

/// Orders the CPU's accesses to the tape before and after DMA2's.
fn publish() {
    compiler_fence(Ordering::SeqCst);
    cortex_m::asm::dmb();
}

/// Stops the outputs after a fault: disables the play streams, waits until they are off (bounded),
/// disconnects the outputs by the CPU and stops the pump. May be called from anywhere, at any time,
/// repeatedly. The erase streams and the clock continue.
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

/// Disables `stream` and returns whether it is off (RM0090 10.3.17: EN reads 1 until the current
/// transfer is over).
fn switch_off(stream: usize) -> bool {
    let cr = DMA2.st(stream).cr();
    cr.modify(|w| w.set_en(false));
    (0..PATIENCE).any(|_| !cr.read().en())
}

/// Checks that DMA2 carries only the four streams, because serving AHB and APB at once corrupts
/// data (ES0182, DMA2 concurrent AHB and APB). `start` shows that all four have AHB addresses.
fn assert_alone() -> Result<(), (Fault, u32)> {
    let others = (0..8).filter(|s| !STREAMS.contains(s));
    if others.into_iter().any(|s| DMA2.st(s).cr().read().en()) {
        Err((Fault::TapeSlip, detail::OTHER_STREAM))
    } else {
        Ok(())
    }
}

fn erase_all() {
    let memory = MEMORY.0.get();
    // SAFETY: all four streams are off and no `Tape` exists, so nothing else uses the memory. Every
    // word is written, none is read before.
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
    // SAFETY: only `erase_all` writes these two words, and DMA2 reads them.
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

/// Configures a stream (RM0090 10.3.17 and 10.5.5). The tape is the memory side, whose address
/// increments; the address of the other side, BSRR or the disconnect word, does not.
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

/// Clears the stream's flags; LISR has those of streams 0–3, HISR of 4–7.
fn clear_flags(stream: usize) {
    DMA2.ifcr(stream / 4).write(|w| {
        w.set_feif(stream % 4, true);
        w.set_dmeif(stream % 4, true);
        w.set_teif(stream % 4, true);
        w.set_htif(stream % 4, true);
        w.set_tcif(stream % 4, true);
    });
}

/// Returns whether a stream is off or has flagged a transfer error, direct mode error or FIFO
/// error. In direct mode, the last two mean that a request came before the word was there (RM0090
/// 10.3.18).
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

/// Returns device time, the four NDTRs, and the position of device time 0 within a lap of
/// [`crystal`], all read within the quiet part of one microsecond; `None` if TIM1 stands still.
fn observe() -> Option<(Micros, [u16; 4], u16)> {
    let count = || TIM1.cnt().read().cnt();
    (0..PATIENCE).find_map(|_| {
        let (before, lap) = (count(), crystal::count());
        if !QUIET.contains(&before) {
            return None;
        }
        let now = timebase::now();
        let positions = STREAMS.map(|s| DMA2.st(s).ndtr().read().ndt());
        // Less than a lap: at most 7 µs plus less than one.
        let since = (now.get() % LAP_US * timebase::CYCLES_PER_US) as u16 + before;
        let offset = lap.checked_sub(since);
        let offset = offset.unwrap_or_else(|| lap + (crystal::LAP - since));
        // A later count in the same microsecond shows that the readings belong together. An
        // interruption could hide a whole microsecond only by lasting one, so try again otherwise.
        (count() > before && timebase::now() == now).then_some((now, positions, offset))
    })
}

/// Length of a lap of [`crystal`] in device time, µs; device time wraps after a whole number of
/// laps.
const LAP_US: u32 = crystal::LAP as u32 / timebase::CYCLES_PER_US;
const _: () = assert!(LAP_US * timebase::CYCLES_PER_US == crystal::LAP as u32);
const _: () = assert!(LAP_US.is_power_of_two());
