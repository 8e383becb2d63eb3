//! Determines how long a case with a broken link must run.

use super::bench::Bench;
use super::orders::{Orders, broken_frames, may_restart};
use super::script::{ForkableBoards, Script};
use super::simulated::{FOR_GOOD_US, FaultableDevice};
use hal_sim::lockstep::Device;
use hal_sim::trace::State;
use hal_sim::wire::stream::{Stream, Write};
use host_core::session::{Channel, Session};

/// Time that a case lasts after silence must have ended all stimulation, µs.
const AFTER_US: u64 = 60_000;
/// Time that a case lasts after its fault is over and stimulation has started, in longest burst
/// periods of the session.
const PERIODS: u64 = 10;
/// Time within which a rising amplitude becomes visible, µs.
const RISE_US: u64 = 20_000;

/// Conditions under which a case ends.
pub(super) struct EndCondition<'a> {
    orders: &'a Orders,
    /// Intact frames that the host can have sent.
    sent: &'a [&'a [u8]],
    /// Time from which the device again receives all messages of the script unchanged, µs.
    again_us: u64,
    /// Time within which a forbidden stimulation would become visible in the output, µs.
    shown_us: u64,
    /// Latest end of the case, µs.
    pub end_us: u64,
}

impl<'a> EndCondition<'a> {
    /// Creates the conditions for a script whose fault begins at `moment_us`, is over at
    /// `again_us`, and whose host sends its last message at `last_us`.
    pub fn new<B: ForkableBoards>(
        script: &Script<B>,
        orders: &'a Orders,
        sent: &'a [&'a [u8]],
        [moment_us, again_us, last_us]: [u64; 3],
    ) -> Self {
        let period_us = longest_period_us(&script.file.session);
        let silent_us = orders.silence_us() + AFTER_US;
        let begun_us = again_us.max(script.start.1);
        let end_us = begun_us + silent_us.max(PERIODS * period_us);
        Self {
            orders,
            sent,
            again_us,
            shown_us: FOR_GOOD_US.max(2 * period_us + RISE_US),
            end_us: end_us.min(last_us.max(moment_us) + silent_us),
        }
    }

    /// Returns whether the case may end early. The messages `passed` that the device received must
    /// forbid any output, the outputs must have been isolated for long enough to show it, and none
    /// of the remaining messages `left` may start stimulation.
    pub fn is_over<D: FaultableDevice>(
        &self,
        bench: &Bench<D>,
        passed: &[Write],
        left: &[Write],
    ) -> bool {
        let (now_us, shown_us) = (bench.now_us(), self.shown_us);
        let intact_frames = || broken_frames(&Stream::new(passed.to_vec()), self.sent).0;
        now_us >= self.again_us + shown_us
            && bench.device.is_connected()
            && is_isolated_for(bench, shown_us)
            && !may_restart(left)
            && self
                .orders
                .forbids_output_from(&intact_frames(), now_us - shown_us)
    }
}

/// Returns the longest period between two bursts of any channel of the session, µs.
fn longest_period_us(session: &Session) -> u64 {
    let of_channel = |channel: &Channel| {
        let force = channel.force.as_ref();
        let slowest_us = force.and_then(|force| force.max_period_us);
        channel.spec.train.period_us.max(slowest_us.unwrap_or(0))
    };
    let longest = session.channels.iter().map(of_channel).max();
    longest.unwrap_or(0).into()
}

/// Returns whether all channels have been isolated for at least `for_us`.
pub(super) fn is_isolated_for<D: Device>(bench: &Bench<D>, for_us: u64) -> bool {
    let last = bench.recorder.trace.levels.last();
    last.is_none_or(|(at, levels)| {
        at + for_us <= bench.now_us() && (0..10).all(|c| levels.state(c) == State::Isolated)
    })
}
