//! Counts how much of a wearer's time and charge was spent, from edges and DAC codes only.

use firmware::safety::StageSpec;
use hal_sim::trace::{CHANNELS, State, Trace};
use host_core::session::Session;

/// Additional stimulation time that each reset may cause, µs.
const RESET_US: u64 = 250_000;

/// The time and charge that a wearer may receive between two power-ons.
pub(super) struct Allowed {
    time_us: u64,
    timeout_us: u64,
    dose_uc: f64,
    /// Full scale, mA, charge of the largest burst, µC, and burst period, µs, of each channel;
    /// `None` for an unused channel.
    channels: [Option<(f64, f64, u64)>; CHANNELS],
}

impl Allowed {
    /// Returns the allowance of `session`, all of whose channels must have current stages.
    pub fn from_session(session: &Session) -> Self {
        let mut channels = [None; CHANNELS];
        for channel in &session.channels {
            let (spec, train) = (&channel.spec, &channel.spec.train);
            if let StageSpec::Current { full_scale_ua } = spec.stage {
                let pulses = f64::from(train.burst_count);
                let limit_ma = f64::from(spec.limit.get()) * 1e-3;
                let burst_uc = limit_ma * f64::from(train.width_us) * 1e-3 * pulses;
                let full_scale_ma = f64::from(full_scale_ua) * 1e-3;
                channels[usize::from(channel.index())] =
                    Some((full_scale_ma, burst_uc, train.period_us.into()));
            }
        }
        Self {
            time_us: 1_000_000 * u64::from(session.wearer.max_session_s),
            timeout_us: 1_000 * u64::from(session.wearer.host_timeout_ms),
            dose_uc: 1_000.0 * f64::from(session.wearer.max_dose_mc),
            channels,
        }
    }
}

/// Time and charge of all output since the last power-on, and of the earlier intervals between
/// power-ons.
#[derive(Default)]
pub(super) struct OutputTotals {
    /// Number of resets since the last power-on.
    pub resets: u64,
    now: Sum,
    ended: Vec<(u64, Sum)>,
}

/// Sums over several pieces of stimulation.
#[derive(Clone, Default)]
struct Sum {
    time_us: u64,
    /// Sum over the cathodic phases of DAC code × duration in µs, for each channel.
    charge: [u64; CHANNELS],
}

impl OutputTotals {
    /// Adds the output of a piece that started at `from_us`: the time from its first to its last
    /// edge, and the charge of each cathodic phase.
    pub fn add(&mut self, trace: &Trace, from_us: u64) {
        let (mut first, mut last) = (None, from_us);
        let mut since = [0; CHANNELS];
        let mut before = hal_sim::trace::Levels::ISOLATED;
        for &(t_us, levels) in &trace.levels {
            for channel in levels.changed_channels(before) {
                let index = usize::from(channel);
                if t_us >= from_us && before.state(channel).is_driven() {
                    last = t_us;
                }
                if t_us >= from_us && levels.state(channel).is_driven() {
                    first.get_or_insert(t_us);
                }
                if levels.state(channel) == State::Cathodic {
                    since[index] = t_us;
                } else if before.state(channel) == State::Cathodic && since[index] >= from_us {
                    let code = u64::from(code_at(trace, channel, since[index]));
                    self.now.charge[index] += code * (t_us - since[index]);
                }
            }
            before = levels;
        }
        self.now.time_us += last.saturating_sub(first.unwrap_or(last));
    }

    /// Starts a new interval after a power-on, with which the allowance is full again.
    pub fn power_came_up(&mut self) {
        self.close();
    }

    /// Ends the last interval, so that [`Self::findings`] includes it.
    pub fn close(&mut self) {
        let resets = std::mem::take(&mut self.resets);
        self.ended.push((resets, std::mem::take(&mut self.now)));
    }

    /// Returns whether no charge was emitted at all.
    pub fn is_empty(&self) -> bool {
        let sums = || self.ended.iter().map(|(_, sum)| sum).chain([&self.now]);
        sums().all(|sum| sum.charge.iter().all(|charge| *charge == 0))
    }

    /// Returns a description of each sum that exceeds `allowed` by more than timeout and resets
    /// excuse.
    pub fn findings(&self, allowed: &Allowed) -> Vec<String> {
        let mut findings = Vec::new();
        for (resets, sum) in &self.ended {
            let beyond_us = allowed.timeout_us + RESET_US * resets;
            if sum.time_us > allowed.time_us + beyond_us {
                let (time_ms, s) = (sum.time_us / 1_000, allowed.time_us / 1_000_000);
                findings.push(format!("{time_ms} ms of {s} s, {resets} resets"));
            }
            for (channel, uc) in sum.doses(allowed) {
                let Some((_, burst_uc, period_us)) = allowed.channels[channel] else {
                    continue;
                };
                let more_uc = burst_uc * (beyond_us / period_us + 1) as f64;
                if uc > allowed.dose_uc + more_uc {
                    let number = channel + 1;
                    findings.push(format!(
                        "channel {number}: {uc:.1} uC of {:.0}, {resets} resets",
                        allowed.dose_uc
                    ));
                }
            }
        }
        findings
    }

    /// Returns the largest time and the largest charge of any interval, in words.
    pub fn in_words(&self, allowed: &Allowed) -> String {
        let sums = || self.ended.iter().map(|(_, sum)| sum);
        let time_us = sums().map(|sum| sum.time_us).max().unwrap_or(0);
        let doses = sums().flat_map(|sum| sum.doses(allowed)).map(|(_, uc)| uc);
        let dose_uc = doses.fold(0.0, f64::max);
        format!(
            "{} of {} ms, {dose_uc:.1} of {:.0} uC",
            time_us / 1_000,
            allowed.time_us / 1_000,
            allowed.dose_uc
        )
    }
}

impl Sum {
    fn doses(&self, allowed: &Allowed) -> Vec<(usize, f64)> {
        let channels = allowed.channels.iter().enumerate();
        let doses = channels.filter_map(|(n, channel)| {
            let (full_scale_ma, ..) = (*channel)?;
            let ma_us = self.charge[n] as f64 / 65_535.0 * full_scale_ma;
            Some((n, ma_us * 1e-3))
        });
        doses.collect()
    }
}

/// Returns the DAC code of `channel` at time `t_us`.
fn code_at(trace: &Trace, channel: u8, t_us: u64) -> u16 {
    let end = trace.dac.partition_point(|write| write.t_us <= t_us);
    let writes = trace.dac[..end].iter().rev();
    let own = writes.filter(|write| write.channel == channel);
    own.map(|write| write.code).next().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use hal_sim::trace::Levels;

    /// Ten pulses of half of 100 mA for 200 µs, of which five lie in the piece.
    #[test]
    fn edges_and_codes_of_the_piece_alone_count() {
        let mut trace = Trace::default();
        trace.record_dac(0, 2, 32_768);
        for n in 0..10 {
            let t_us = 10_000 * n;
            for (after_us, state) in [
                (0, State::Cathodic),
                (200, State::Isolated),
                (250, State::Anodic),
                (450, State::Isolated),
            ] {
                let levels = Levels::ISOLATED.with_channel(2, state);
                trace.record_levels(1_000 + t_us + after_us, levels);
            }
        }
        let mut account = OutputTotals::default();
        account.add(&trace, 50_000);
        assert_eq!(account.now.time_us, 40_450);
        assert_eq!(account.now.charge[2], 5 * 200 * 32_768);
        account.resets = 1;
        account.close();
        let mut allowed = Allowed {
            time_us: 1_000_000,
            timeout_us: 20_000,
            dose_uc: 1_000.0,
            channels: [None; CHANNELS],
        };
        allowed.channels[2] = Some((100.0, 10.0, 10_000));
        assert_eq!(account.findings(&allowed), [""; 0]);
        // 50 µC is within the extra 0.27 s, which allows 10 µC every 10 ms.
        allowed.dose_uc = -229.0;
        assert_eq!(account.findings(&allowed), [""; 0]);
        allowed.dose_uc = -231.0;
        assert_eq!(account.findings(&allowed).len(), 1);
        (allowed.time_us, allowed.timeout_us) = (0, 0);
        account.ended[0].0 = 0;
        assert_eq!(account.findings(&allowed).len(), 2);
    }
}
