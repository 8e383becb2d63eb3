//! Checks the charge, current and duration of channels at their limits, each alone and all
//! together, and reports them with the values that are allowed.

use firmware::device::validate_channel;
use firmware::pulse::{CHANNELS, WINDOW_US};
use firmware::safety::{self, ChannelSpec, SetupError, SumError, Sums, WearerSpec};

use super::channel::Channel;
use crate::fields::decimal::format_scaled;
use crate::fields::error::{Problem, SumBound};
use crate::fields::table::Table;
use crate::wearer;

/// Returns a wearer with the loosest limits that a session may set.
pub(super) fn loosest_wearer() -> WearerSpec {
    WearerSpec {
        fall_ms: WearerSpec::FALL_MS.max as u16, // 100 ms
        host_timeout_ms: WearerSpec::HOST_TIMEOUT_MS.max as u16, // 1 s
        ..WearerSpec::default()
    }
}

/// Returns the channel as checked with the largest electrode area and for the loosest wearer. The
/// charge limit is that of `wearer` if the channel respects it, because the charge limit bounds how
/// long a pulse can be. Returns `None` if the channel fails the check even so.
fn loosest_channel(channel: &Channel, wearer: &WearerSpec) -> Option<safety::Channel> {
    let spec = ChannelSpec {
        area_mm2: ChannelSpec::AREA_MM2.max.cast_unsigned(),
        ..channel.spec
    };
    let on = |wearer: WearerSpec| {
        let wearer = wearer.validate().ok()?;
        validate_channel(&spec, channel.force.as_ref(), &wearer).ok()
    };
    let same_charge = WearerSpec {
        max_charge_nc: wearer.max_charge_nc,
        ..loosest_wearer()
    };
    on(same_charge).or_else(|| on(loosest_wearer()))
}

/// Returns the error for a channel that exceeds one of its own limits, with the value and the
/// limit. Returns `None` if `e` is a mistake of another kind.
pub(super) fn channel_limit_problem(channel: &Channel, e: SetupError) -> Option<Problem> {
    // The loosest wearer and the largest electrode, so that the rms can be computed.
    let milli = |value: u32| format_scaled(value.into(), 3);
    let ma = || {
        loosest_channel(channel, &loosest_wearer()).map_or_else(
            || "more than 50".into(),
            |channel| milli(channel.rms().get()),
        )
    };
    wearer::channel_limit_problem(&channel.spec, channel.unit(), ma, e)
}

/// Reports that the currents through the common return add up to more than the wearer's limit. The
/// error is reported at the last channel of the file. The sum includes `channels`, which are within
/// their own limits. Of the channels in `beyond`, which exceed a limit of their own, it includes
/// those that the loosest wearer allows.
pub(super) fn check_current_sum(
    root: &Table<'_>,
    wearer: &WearerSpec,
    channels: &[Channel],
    beyond: &[Channel],
) {
    let all_channels = || channels.iter().chain(beyond);
    let mut summed = [None; CHANNELS];
    for (slot, channel) in summed.iter_mut().zip(all_channels()) {
        *slot = loosest_channel(channel, wearer);
    }
    let Ok(wearer) = wearer.validate() else {
        return; // told
    };
    let Err(e) = Sums::of(&summed).check(&wearer) else {
        return;
    };
    let mut numbers: Vec<u8> = all_channels()
        .zip(&summed)
        .filter_map(|(channel, slot)| slot.map(|_| channel.number))
        .collect();
    let subject = match numbers.len() == root.tables("channel").len() {
        true => "all channels".into(),
        false => {
            numbers.sort_unstable();
            format!("channels {}", list_in_words(&numbers))
        }
    };
    let milli = |ua: u32| format_scaled(ua.into(), 3);
    let problem = match e {
        SumError::Peak { sum, max } => Problem::SumLimit {
            who: subject,
            sum_ma: milli(sum.get()),
            max_ma: milli(max.get()),
        },
        SumError::Rms { sum, max } => Problem::SumRmsLimit {
            who: subject,
            sum_ma: milli(sum.get()),
            max_ma: milli(max.get()),
            by: match max.get() == wearer.spec().max_sum_rms_ua {
                true => SumBound::Wearer,
                false => SumBound::Area(wearer.spec().return_area_mm2),
            },
        },
    };
    if let Some(last) = root.tables("channel").last() {
        last.report("limit", problem);
    }
}

/// Returns the time, in µs, from the moment at which the device ends stimulation because of
/// `max_session_s` until its outputs are disconnected: the fall of the amplitudes and one window of
/// the pulse tape.
fn fall_us(wearer: &WearerSpec) -> u64 {
    u64::from(wearer.fall_ms) * 1_000 + u64::from(WINDOW_US)
}

/// Reports a session that lasts longer than `max_session_s`. Adds a note to `notes` if the wearer's
/// limits end the stimulation early, or if the amplitude rise of a channel takes as long as the
/// session.
pub(super) fn check_duration(
    root: &Table<'_>,
    wearer: &WearerSpec,
    channels: &[Channel],
    notes: &mut Vec<String>,
) {
    let duration_us: u64 = root.integer_or("duration_s", 0); // told
    let seconds = |us: u64| format_scaled(us.cast_signed(), 6);
    if duration_us > u64::from(wearer.max_session_s) * 1_000_000 {
        let most_s = wearer.max_session_s;
        root.report("duration_s", Problem::SessionTooLong { most_s });
    } else {
        // The fall and one window of the pulser count towards the session time.
        let ends_us = u64::from(wearer.max_session_s) * 1_000_000 - fall_us(wearer);
        if duration_us > ends_us {
            notes.push(format!(
                "the device ends stimulation after {} s, so that the fall is complete within \
                 `wearer.max_session_s` = {} s",
                seconds(ends_us),
                wearer.max_session_s
            ));
        }
    }
    for channel in channels {
        let (number, train) = (channel.number, &channel.spec.train);
        let period_us = u64::from(train.period_us);
        let bursts = u64::from(wearer.rise_bursts) * period_us;
        if train.trigger.is_none() && bursts >= duration_us.max(1) {
            notes.push(format!(
                "channel {number}: the rise of `wearer.rise_bursts` = {} takes {} s, but the \
                 session lasts only {} s",
                wearer.rise_bursts,
                seconds(bursts),
                seconds(duration_us)
            ));
        }
        let stage = channel.spec.stage.validate();
        let ua = stage.map_or(0, |stage| stage.current(channel.spec.limit).get());
        let pulses = u64::from(train.width_us) * u64::from(train.burst_count);
        let burst_pc = u64::from(ua) * pulses; // at most 1e5 · 8 · 500
        let most_pc = u64::from(wearer.max_dose_mc) * 1_000_000_000;
        // Checked channels have a width, a limit and a period.
        let bursts = most_pc / burst_pc.max(1);
        let ends_us = bursts * period_us;
        let has_more = train.repeats == 0 || u64::from(train.repeats) > bursts;
        if train.trigger.is_none() && has_more && ends_us < duration_us {
            notes.push(format!(
                "channel {number}: at its limit it reaches `wearer.max_dose_mc` = {} mC after \
                 {} s, and the device then ends stimulation",
                wearer.max_dose_mc,
                seconds(ends_us)
            ));
        }
    }
}

/// Lists channel numbers in words, for example "1, 2 and 4".
fn list_in_words(numbers: &[u8]) -> String {
    let words: Vec<String> = numbers.iter().map(u8::to_string).collect();
    match words.split_last() {
        Some((last, rest)) if !rest.is_empty() => format!("{} and {last}", rest.join(", ")),
        _ => words.concat(),
    }
}
