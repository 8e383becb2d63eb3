//! Rules that need only one channel: limits, charge, dead time, DAC writes.

use super::super::pulses::ChannelRecord;
use super::expectation::Expectation;
use super::timing::Timed;
use super::violation::{Rule, Violation};

/// Checks width, amplitude, charge and dead time of every pulse.
pub(super) fn judge(
    channel: u8,
    record: &ChannelRecord,
    expected: &Expectation,
    found: &mut Vec<Violation>,
) {
    let mut report = |t_us, rule| found.push(Violation::new(t_us, channel, rule));
    let width = &expected.limits.width_us;
    let max = expected.max_code[usize::from(channel)];
    for pulse in &record.pulses {
        for &width_us in &pulse.width_us[..usize::from(pulse.phases)] {
            let too_short = pulse.complete && width_us < *width.start();
            if too_short || width_us > *width.end() {
                report(pulse.start_us, Rule::Width { width_us });
            }
        }
        if pulse.code > max {
            let code = pulse.code;
            report(pulse.start_us, Rule::Code { code, max });
        }
        let widest_us = pulse.width_us.into_iter().max().unwrap_or(0);
        let code_us = u64::from(pulse.code) * widest_us;
        let max_code_us = expected.max_code_us[usize::from(channel)];
        if code_us > max_code_us {
            let max = max_code_us;
            report(pulse.start_us, Rule::PhaseCharge { code_us, max });
        }
        if pulse.complete && pulse.phases == 2 && pulse.charge != 0 {
            report(pulse.start_us, Rule::Charge { net: pulse.charge });
        }
    }
    for &(t_us, gap_us) in &record.reversals {
        if gap_us < expected.dead_time_us {
            report(t_us, Rule::DeadTime { gap_us });
        }
    }
}

/// Checks that each burst has one amplitude, written early enough before it.
pub(super) fn judge_writes(
    timed: &[Timed<'_>],
    writes: &[u64],
    expected: &Expectation,
    found: &mut Vec<Violation>,
) {
    let mut writes = writes.iter().peekable();
    for timed in timed {
        let (pulse, burst_us) = (timed.pulse, timed.burst_us);
        let quiet_from_us = burst_us.saturating_sub(expected.limits.dac_lead_us);
        while writes.next_if(|&&t_us| t_us <= quiet_from_us).is_some() {}
        while let Some(&t_us) = writes.next_if(|&&t_us| t_us < pulse.end_us()) {
            let rule = match burst_us.checked_sub(t_us) {
                Some(lead_us) if lead_us > 0 => Rule::DacLate { lead_us },
                _ => Rule::DacDuringBurst,
            };
            found.push(Violation::new(t_us, pulse.channel, rule));
        }
    }
}

/// Checks that the bursts of a channel follow each other no faster than the limit, also from one
/// train to the next.
pub(super) fn judge_repetition(
    timed: &[Timed<'_>],
    expected: &Expectation,
    found: &mut Vec<Violation>,
) {
    for pair in timed.windows(2) {
        let since_us = pair[1].burst_us.saturating_sub(pair[0].burst_us);
        if since_us > 0 && since_us < *expected.limits.period_us.start() {
            let (pulse, rule) = (pair[1].pulse, Rule::Repetition { since_us });
            found.push(Violation::new(pulse.start_us, pulse.channel, rule));
        }
    }
}
