//! Derives the required behaviour of a device from a stream of frames: when its output must have
//! stopped, and how many electrode checks it may run.

use super::script::decode_request;
use super::simulated::TWO_WINDOWS_US;
use firmware::link::Request;
use firmware::safety::CHECK_PAUSE_US;
use hal_sim::trace::judge::QuietInterval;
use hal_sim::wire::stream::{Stream, Write};
use host_core::session::Session;

/// Uncertainty of the host timeout, µs: a pause of the host this close to it may or may not end
/// stimulation.
const NEAR_US: u64 = 1_000;

/// Longest duration of an electrode check, µs.
const CHECK_US: u64 = 25_000;

/// Interval in which the judge counts pulses, µs: one second, extended by the electrode check that
/// may precede it.
const COUNTED_US: u64 = 1_000_000 + CHECK_US;

/// Behaviour that a stream of frames requires of the device.
#[derive(Debug, PartialEq)]
pub(super) struct ExpectedEffects {
    /// Intervals in which no output may be driven.
    pub quiet: Vec<QuietInterval>,
    /// Whether a silence of the host ends stimulation after the given moment.
    pub is_silenced: bool,
    /// Largest number of electrode checks whose pulses can fall within one second. Each arming
    /// causes one check.
    pub checks: usize,
}

/// Rules from which the required behaviour follows: the wearer's timing limits, and the session
/// number whose requests count.
pub(super) struct Orders {
    timeout_us: u64,
    fall_us: u64,
    /// Longest time from the arrival of a frame until the device has read it, µs.
    line_us: u64,
    session: u16,
}

impl Orders {
    /// Creates the rules for a session whose host sent the messages `writes`.
    pub fn from_session(session: &Session, writes: &[Write], line_us: u64) -> Self {
        let owner = writes.last().and_then(|write| decode_request(&write.bytes));
        Self {
            timeout_us: 1000 * u64::from(session.wearer.host_timeout_ms),
            fall_us: 1000 * u64::from(session.wearer.fall_ms),
            line_us,
            session: owner.map_or(0, |asked| asked.session),
        }
    }

    /// Returns the longest allowed time from the host's last message to the last output, µs.
    pub const fn silence_us(&self) -> u64 {
        self.timeout_us + self.fall_us + TWO_WINDOWS_US + self.line_us
    }

    /// Returns whether the intact frames `intact` forbid any output from `from_us` until the device
    /// is armed again.
    pub fn forbids_output_from(&self, intact: &[Write], from_us: u64) -> bool {
        let quiet = self.expected_effects(intact, 0, from_us).quiet;
        let last = quiet.last().filter(|last| last.until_us == u64::MAX);
        last.is_some_and(|last| last.from_us <= from_us)
    }

    /// Returns the behaviour that the intact frames `intact` require up to `end_us`. Silences of the
    /// host are reported only if they end stimulation after `moment_us`.
    pub fn expected_effects(
        &self,
        intact: &[Write],
        moment_us: u64,
        end_us: u64,
    ) -> ExpectedEffects {
        let mut quiet: Vec<QuietInterval> = Vec::new();
        let mut armed_us = Vec::new();
        let mut is_silenced = false;
        // Time of the last keep-alive while trains play, start of the interval without output, and
        // whether the device is armed.
        let (mut alive_us, mut off_us, mut is_armed) = (None::<u64>, Some(0), false);
        // Start of the latest check, which waits for the pause after the one before, and the last
        // time at which its pulses may come.
        let (mut begun_us, mut checked_us) = (None::<u64>, 0);
        let until = |off: Option<u64>, until_us| QuietInterval {
            from_us: off.unwrap_or(until_us),
            until_us,
        };
        let end = Write {
            t_us: end_us,
            bytes: Vec::new(),
        };
        for Write { t_us, bytes } in intact.iter().chain([&end]) {
            let t_us = *t_us;
            if let Some(since) = alive_us.filter(|since| since + self.timeout_us + NEAR_US < t_us) {
                is_silenced |= t_us >= moment_us;
                let over_us = (since + self.silence_us()).max(checked_us);
                (alive_us, off_us) = (None, Some(over_us));
                is_armed = false;
            }
            let Some(asked) = decode_request(bytes) else {
                continue;
            };
            let is_own = asked.session == self.session;
            match asked.request {
                Request::Stop => {
                    let over_us = t_us + self.fall_us + TWO_WINDOWS_US + self.line_us;
                    off_us = Some(off_us.map_or(over_us, |off: u64| off.min(over_us)));
                    (alive_us, is_armed, checked_us) = (None, false, 0);
                }
                // The pulses of the electrode check precede any start.
                Request::Arm { .. } if is_own => {
                    quiet.extend(off_us.map(|_| until(off_us, t_us)));
                    armed_us.extend((!is_armed).then_some(t_us));
                    if !is_armed {
                        let paused_us = begun_us.map(|at| at + u64::from(CHECK_PAUSE_US));
                        let at_us = paused_us.map_or(t_us, |paused_us| paused_us.max(t_us));
                        begun_us = Some(at_us);
                        checked_us = at_us + CHECK_US + self.line_us;
                    }
                    (off_us, is_armed) = (None, true);
                }
                Request::Start if is_own && is_armed => {
                    (alive_us, off_us) = (Some(t_us), None);
                }
                _ if is_own && counts_as_keep_alive(&asked.request) => {
                    alive_us = alive_us.map(|_| t_us);
                }
                _ => {}
            }
        }
        quiet.extend(off_us.map(|_| until(off_us, u64::MAX)));
        quiet.retain(|quiet| quiet.from_us < quiet.until_us);
        ExpectedEffects {
            quiet,
            is_silenced,
            checks: most_counted(&armed_us),
        }
    }
}

/// Returns the largest number of these times that lie within one [`COUNTED_US`].
fn most_counted(at_us: &[u64]) -> usize {
    let from = |from: u64| {
        let until = from + COUNTED_US;
        at_us.iter().filter(|&&at| from <= at && at < until).count()
    };
    at_us.iter().map(|&at| from(at)).max().unwrap_or(0)
}

/// Returns whether the request counts as a keep-alive (docs/protocol.md, host silence).
const fn counts_as_keep_alive(request: &Request) -> bool {
    matches!(
        request,
        Request::Amplitudes { .. }
            | Request::Pulses { .. }
            | Request::Angle { .. }
            | Request::Force { .. }
            | Request::Wrench { .. }
            | Request::ObjectHeld { .. }
            | Request::KeepAlive
    )
}

/// Returns whether the messages `writes` contain a request that can start stimulation again, even
/// after a fault.
pub(super) fn may_restart(writes: &[Write]) -> bool {
    let is = |write: &Write| {
        decode_request(&write.bytes).is_some_and(|asked| {
            matches!(
                asked.request,
                Request::Hello { .. } | Request::Arm { .. } | Request::Start | Request::Acknowledge
            )
        })
    };
    writes.iter().any(is)
}

/// Divides the received frames `passed` into intact ones, which equal a frame of `sent` byte for
/// byte, and broken ones; returns the intact frames and the number of broken ones.
pub(super) fn broken_frames(passed: &Stream, sent: &[&[u8]]) -> (Vec<Write>, usize) {
    let sent: std::collections::HashSet<&[u8]> = sent.iter().copied().collect();
    let read = passed.frames().into_iter();
    let (intact, broken): (Vec<Write>, Vec<Write>) =
        read.partition(|frame| sent.contains(&*frame.bytes));
    // A delimiter alone is no frame.
    let broken = broken.iter().filter(|frame| frame.bytes.len() > 1).count();
    (intact, broken)
}

#[cfg(test)]
mod tests {
    use super::*;
    use firmware::link::{ToDevice, encode};

    const ORDERS: Orders = Orders {
        timeout_us: 100_000,
        fall_us: 50_000,
        line_us: 0,
        session: 7,
    };

    /// Encodes frames from times in ms, a session number, and a request.
    fn frames(requests: &[(u64, u16, Request)]) -> Vec<Write> {
        let frame = |(ms, session, request): &(u64, u16, Request)| Write {
            t_us: 1_000 * ms,
            bytes: encode(&ToDevice {
                session: *session,
                seq: 0,
                request: request.clone(),
            })
            .unwrap()
            .to_vec(),
        };
        requests.iter().map(frame).collect()
    }

    /// Returns the intervals without output in ms, and whether a silence ended stimulation.
    fn quiet(requests: &[(u64, u16, Request)]) -> (Vec<(f64, f64)>, bool) {
        let owed = ORDERS.expected_effects(&frames(requests), 0, 1_000_000);
        let ms = |us: u64| us as f64 * 1e-3;
        let intervals = owed.quiet.iter();
        (
            intervals
                .map(|quiet| (ms(quiet.from_us), ms(quiet.until_us.min(2_000_000))))
                .collect(),
            owed.is_silenced,
        )
    }

    const ARM: Request = Request::Arm { setup: 0 };

    #[test]
    fn silence_and_stop_end_what_was_armed_and_started() {
        let begun = [(10, 7, ARM), (40, 7, Request::Start)];
        let alive = |ms| (ms, 7, Request::KeepAlive);
        let silent = [&begun[..], &[alive(100), alive(180)]].concat();
        let until_armed = (0.0, 10.0);
        assert_eq!(quiet(&silent), (vec![until_armed, (330.5, 2000.0)], true));
        let stopped = [&silent[..], &[(190, 0, Request::Stop)]].concat();
        assert_eq!(quiet(&stopped), (vec![until_armed, (240.5, 2000.0)], false));
        // A message after the silence, or from another session, keeps nothing alive.
        let late = [&silent[..], &[alive(290), (150, 9, Request::KeepAlive)]].concat();
        assert_eq!(quiet(&late), quiet(&silent));
        // Arming again allows output; a start alone does not.
        let again = [&stopped[..], &[(600, 7, ARM), (650, 7, Request::Start)]].concat();
        let paused = vec![until_armed, (240.5, 600.0), (800.5, 2000.0)];
        assert_eq!(quiet(&again), (paused, true));
        let started = [&stopped[..], &[(650, 7, Request::Start)]].concat();
        assert_eq!(quiet(&started), quiet(&stopped));
    }

    /// A check that waits for its pause may still emit its pulses although the host falls silent; a
    /// stop prevents them.
    #[test]
    fn a_check_that_waits_is_no_output_past_the_silence() {
        const STOP: Request = Request::Stop;
        let soon = [
            (10, 7, ARM),
            (20, 7, STOP),
            (30, 7, ARM),
            (60, 7, Request::Start),
        ];
        let (intervals, is_silenced) = quiet(&soon);
        assert_eq!(
            (intervals.last(), is_silenced),
            (Some(&(435.0, 2000.0)), true)
        );
        let stopped = [&soon[..], &[(70, 7, STOP)]].concat();
        assert_eq!(quiet(&stopped).0.last(), Some(&(120.5, 2000.0)));
    }

    #[test]
    fn an_electrode_check_may_come_with_each_arming_anew() {
        const STOP: Request = Request::Stop;
        let checks = |requests: &[(u64, u16, Request)]| {
            ORDERS
                .expected_effects(&frames(requests), 0, 9_000_000)
                .checks
        };
        assert_eq!(checks(&[]), 0);
        let armed = [(10, 7, ARM), (11, 7, ARM), (12, 9, ARM)];
        assert_eq!(checks(&armed), 1, "armed already, and a stranger's");
        let again = [&armed[..], &[(20, 0, STOP), (21, 7, ARM), (40, 7, ARM)]].concat();
        assert_eq!(checks(&again), 2);
        let later = [&again[..], &[(1_030, 7, STOP), (1_040, 7, ARM)]].concat();
        assert_eq!(checks(&later), 2, "more than a second after the first");
        // After a silence has ended stimulation, the device may be armed again.
        let silent = [(10, 7, ARM), (40, 7, Request::Start), (500, 7, ARM)];
        assert_eq!(checks(&silent), 2);
    }

    #[test]
    fn frames_are_whole_to_the_byte_or_broken() {
        let writes = frames(&[(1, 7, ARM), (2, 7, Request::Start), (3, 7, Request::Stop)]);
        let sent: Vec<&[u8]> = writes.iter().map(|write| &*write.bytes).collect();
        let mut passed = Stream::new(writes.clone());
        assert_eq!(broken_frames(&passed, &sent), (writes.clone(), 0));
        passed.flip_bits(1, &[9]);
        passed.add(4_000, vec![0]);
        let intact = vec![writes[0].clone(), writes[2].clone()];
        assert_eq!(broken_frames(&passed, &sent), (intact, 1));
    }
}
