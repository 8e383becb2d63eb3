//! Determines how long a case with a broken link must run.

use super::bench::Bench;
use super::orders::{Orders, broken_frames, may_restart};
use super::script::{ForkableBoards, Script};
use super::simulated::{FOR_GOOD_US, FaultableDevice};
use hal_sim::lockstep::Device;
use hal_sim::trace::State;
use hal_sim::wire::stream::{Stream, Write};
use host_core::session::{Channel, Session};

/// Time after the latest moment at which silence has ended everything, µs.
const AFTER_US: u64 = 60_000;
/// Number of the session's longest periods to run after everything is undisturbed again and
/// stimulates.
const PERIODS: u64 = 10;
/// Time within which a rising amplitude exceeds zero, µs.
const RISE_US: u64 = 20_000;

/// Conditions for the end of a case.
pub(super) struct EndCondition<'a> {
    orders: &'a Orders,
    /// Frames that the host may have sent.
    sent: &'a [&'a [u8]],
    /// Time from which all messages are sent and received as in the script again, µs.
    again_us: u64,
    /// Time within which a forbidden stimulation would become visible, µs.
    shown_us: u64,
    /// Latest end of the case, µs.
    pub end_us: u64,
}

impl<'a> EndCondition<'a> {
    /// Creates the condition for a script that is broken at `moment_us` and undisturbed again from
    /// `again_us`; its host sends its last message at `last_us`.
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

    /// Returns whether the case may end early: the writes that `bench` received forbid any output,
    /// there was none for as long as it would take to become visible, and none of the remaining
    /// writes starts anything.
    pub fn is_over<D: FaultableDevice>(
        &self,
        bench: &Bench<D>,
        passed: &[Write],
        left: &[Write],
    ) -> bool {
        let (now_us, shown_us) = (bench.now_us(), self.shown_us);
        let whole = || broken_frames(&Stream::new(passed.to_vec()), self.sent).0;
        now_us >= self.again_us + shown_us
            && bench.device.is_connected()
            && is_isolated_for(bench, shown_us)
            && !may_restart(left)
            && self.orders.forbids_output_from(&whole(), now_us - shown_us)
    }
}

/// Returns the longest burst period of the session, µs.
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
