//! Check of the device's clock against the host's. USB frames begin every millisecond, within 0.05
//! % (USB 2.0 section 7.1.12), and the device's microseconds come from the crystal through the PLL.
//! A wrong crystal or multiplier would make every phase longer.

use super::timebase;
use crate::units::Micros;
use core::sync::atomic::{AtomicBool, Ordering};

/// Number of frames in one comparison: 2 s, of which one frame at each end is 0.1 %.
const FRAMES: u32 = 2_000;
/// Largest deviation: 0.2 % and one frame, µs.
const TOLERANCE_US: u32 = FRAMES * 1_000 / 500 + 1_000;
/// Longest time without a new frame, µs; then the bus is suspended or the cable is out. The loop
/// runs every millisecond.
const SILENCE_US: u32 = 3_000;

static DISAGREES: AtomicBool = AtomicBool::new(false);

/// Returns whether a deviation from the host's clock was found since the last call.
pub fn disagrees() -> bool {
    // Called in each window: a load is cheaper than a swap, and usually sufficient.
    DISAGREES.load(Ordering::Relaxed) && DISAGREES.swap(false, Ordering::Relaxed)
}

/// Comparison of USB frames with device time.
pub struct UsbClock {
    /// Number of the latest frame seen.
    frame: u32,
    /// Device time at which `frame` was seen.
    seen: Micros,
    /// Start of the current comparison, device time.
    begun: Micros,
    /// Number of frames since `begun`.
    frames: u32,
}

impl UsbClock {
    /// Starts a comparison at the present frame number.
    pub fn new() -> Self {
        let (frame, now) = (frame_number(), timebase::now());
        Self {
            frame,
            seen: now,
            begun: now,
            frames: 0,
        }
    }

    /// Reads the frame number; call at least every other millisecond.
    pub fn look(&mut self) {
        let (frame, now) = (frame_number(), timebase::now());
        let passed = frame.wrapping_sub(self.frame) & NUMBER;
        if passed == 0 && now.elapsed_since(self.seen) < SILENCE_US {
            return;
        }
        // Restarts the comparison after silence, or if the numbers jump, as after a reset of the
        // bus.
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

/// Mask of the frame number, 11 bits at full speed (USB 2.0 section 8.4.3).
const NUMBER: u32 = 0x7FF;

/// Reads OTG_FS_DSTS.FNSOF (RM0090 section 34.16.4).
fn frame_number() -> u32 {
    const DSTS: *const u32 = 0x5000_0808 as *const u32;
    // SAFETY: this is a status register of this chip that reading does not change; it reads 0 until
    // the USB core has its clock.
    unsafe { DSTS.read_volatile() >> 8 & NUMBER }
}
