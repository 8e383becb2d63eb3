//! The host's clock as a second opinion: USB frames begin every millisecond, within
//! 0.05 % (USB 2.0 section 7.1.12), and our own microseconds come from the crystal
//! through the PLL. A wrong crystal, or a wrong multiplier, makes every phase longer.

use super::timebase;
use crate::units::Micros;
use core::sync::atomic::{AtomicBool, Ordering};

/// Frames of one comparison: 2 s, of which one frame at each end is 0.1 %.
const FRAMES: u32 = 2_000;
/// 0.2 %, and a frame's quantum, µs.
const TOLERANCE_US: u32 = FRAMES * 1_000 / 500 + 1_000;
/// A turn of the loop comes every millisecond; without a new frame for so long the
/// bus is suspended or the cable is out.
const SILENCE_US: u32 = 3_000;

static DISAGREES: AtomicBool = AtomicBool::new(false);

/// Whether the host's clock and ours were found to disagree since this was last asked.
pub fn disagrees() -> bool {
    // Asked each window: a load is cheaper than an exchange, and mostly enough.
    DISAGREES.load(Ordering::Relaxed) && DISAGREES.swap(false, Ordering::Relaxed)
}

/// Counts frames against device time.
pub struct UsbClock {
    /// Number of the latest frame seen, and when it was seen.
    frame: u32,
    seen: Micros,
    /// Where the comparison under way began, and frames since.
    begun: Micros,
    frames: u32,
}

impl UsbClock {
    /// No frame has been seen.
    pub fn new() -> Self {
        let (frame, now) = (frame_number(), timebase::now());
        Self {
            frame,
            seen: now,
            begun: now,
            frames: 0,
        }
    }

    /// Looks at the frame number; to be called at least every other millisecond.
    pub fn look(&mut self) {
        let (frame, now) = (frame_number(), timebase::now());
        let passed = frame.wrapping_sub(self.frame) & NUMBER;
        if passed == 0 && now.elapsed_since(self.seen) < SILENCE_US {
            return;
        }
        // Silence, or numbers that jump as after a reset of the bus: begin again.
        let is_continuous = (1..=SILENCE_US / 1_000).contains(&passed);
        (self.frame, self.seen) = (frame, now);
        if !is_continuous {
            (self.begun, self.frames) = (now, 0);
            return;
        }
        self.frames += passed; // below FRAMES + 3
        if self.frames >= FRAMES {
            let ours = now.elapsed_since(self.begun);
            if ours.abs_diff(self.frames * 1_000) > TOLERANCE_US {
                DISAGREES.store(true, Ordering::Relaxed);
            }
            (self.begun, self.frames) = (now, 0);
        }
    }
}

/// Frame numbers have 11 bits at full speed (USB 2.0 section 8.4.3).
const NUMBER: u32 = 0x7FF;

/// OTG_FS_DSTS.FNSOF (RM0090 section 34.16.4).
fn frame_number() -> u32 {
    const DSTS: *const u32 = 0x5000_0808 as *const u32;
    // SAFETY: a status register of this chip that reading does not change; 0 until the
    // core has its clock.
    unsafe { DSTS.read_volatile() >> 8 & NUMBER }
}
