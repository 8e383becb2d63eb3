//! What of a stream of frames a device owes: when it must have stopped.

use super::script::request;
use super::simulated::TWO_WINDOWS_US;
use firmware::link::Request;
use hal_sim::trace::judge::Quiet;
use hal_sim::wire::stream::{Stream, Write};
use host_core::session::Session;

/// A pause this near to the timeout may end stimulation or not, µs.
const NEAR_US: u64 = 1_000;

/// The wearer's times, and whose orders count.
pub(super) struct Orders {
    timeout_us: u64,
    fall_us: u64,
    /// Longest from a write to when the device has read it.
    pub line_us: u64,
    session: u16,
}

impl Orders {
    /// Of a session, whose host said `said`.
    pub fn of(session: &Session, said: &[Write], line_us: u64) -> Self {
        let owner = said.last().and_then(|write| request(&write.bytes));
        Self {
            timeout_us: 1000 * u64::from(session.wearer.host_timeout_ms),
            fall_us: 1000 * u64::from(session.wearer.fall_ms),
            line_us,
            session: owner.map_or(0, |asked| asked.session),
        }
    }

    /// From the last word to the last output that is allowed, µs.
    pub const fn silence_us(&self) -> u64 {
        self.timeout_us + self.fall_us + TWO_WINDOWS_US + self.line_us
    }

    /// Times up to `end_us` in which nothing may be driven, by the whole frames that came;
    /// and whether from `moment_us` on a silence ends what plays.
    pub fn quiet(&self, whole: &[Write], moment_us: u64, end_us: u64) -> (Vec<Quiet>, bool) {
        let mut quiet: Vec<Quiet> = Vec::new();
        let mut is_silenced = false;
        // When the host last counted while the trains play; and when they may not.
        let (mut alive_us, mut off_us, mut is_armed) = (None, Some(0), false);
        let until = |off: Option<u64>, until_us| Quiet {
            from_us: off.unwrap_or(until_us),
            until_us,
        };
        let end = Write {
            t_us: end_us,
            bytes: Vec::new(),
        };
        for Write { t_us, bytes } in whole.iter().chain([&end]) {
            let t_us = *t_us;
            if let Some(since) = alive_us.filter(|since| since + self.timeout_us + NEAR_US < t_us) {
                is_silenced |= t_us >= moment_us;
                (alive_us, off_us) = (None, Some(since + self.silence_us()));
            }
            let Some(asked) = request(bytes) else {
                continue;
            };
            let is_own = asked.session == self.session;
            match asked.request {
                Request::Stop => {
                    let over_us = t_us + self.fall_us + TWO_WINDOWS_US + self.line_us;
                    off_us = Some(off_us.map_or(over_us, |off: u64| off.min(over_us)));
                    (alive_us, is_armed) = (None, false);
                }
                // Its pulses of the electrodes' check come before any start.
                Request::Arm { .. } if is_own => {
                    quiet.extend(off_us.map(|_| until(off_us, t_us)));
                    (off_us, is_armed) = (None, true);
                }
                Request::Start if is_own && is_armed => {
                    (alive_us, off_us) = (Some(t_us), None);
                }
                _ if is_own && counts(&asked.request) => {
                    alive_us = alive_us.map(|_| t_us);
                }
                _ => {}
            }
        }
        quiet.extend(off_us.map(|_| until(off_us, u64::MAX)));
        quiet.retain(|it| it.from_us < it.until_us);
        (quiet, is_silenced)
    }
}

/// Whether it says that the host is there (docs/protocol.md, host silence).
const fn counts(request: &Request) -> bool {
    matches!(
        request,
        Request::Amplitudes { .. }
            | Request::Pulses { .. }
            | Request::Angle { .. }
            | Request::Force { .. }
            | Request::Wrench { .. }
            | Request::Held { .. }
            | Request::KeepAlive
    )
}

/// The frames of `passed` that are to the byte one of those `sent`, and how many are not.
pub(super) fn broken_frames(passed: &Stream, sent: &[&[u8]]) -> (Vec<Write>, usize) {
    let sent: std::collections::HashSet<&[u8]> = sent.iter().copied().collect();
    let read = passed.frames().into_iter();
    let (whole, broken): (Vec<Write>, Vec<Write>) =
        read.partition(|frame| sent.contains(&*frame.bytes));
    // A delimiter alone is no frame.
    let broken = broken.iter().filter(|frame| frame.bytes.len() > 1).count();
    (whole, broken)
}
