//! Effects of the wearer's amplitude rise on a session: how long steps take that are known
//! beforehand, and how fast the amplitudes of a control law may rise.

use super::Session;
use super::channel::Channel;
use super::setpoints::Course;
use crate::fields::decimal::format_scaled;
use firmware::control::JointSpec;
use firmware::device::validate_channel;
use firmware::safety::Stimulus;
use firmware::units::Amplitude;

/// Returns a note for each step or control law whose amplitudes the wearer's rise delays.
pub(super) fn notes(session: &Session) -> Vec<String> {
    let mut notes = Vec::new();
    let Ok(wearer) = session.wearer.validate() else {
        return notes; // told
    };
    for channel in &session.channels {
        let Ok(armed) = validate_channel(&channel.spec, channel.force.as_ref(), &wearer) else {
            continue; // told
        };
        let rise = Rise {
            channel,
            start: armed.start,
            slope: armed.slope(&wearer),
            rise_us: u64::from(session.wearer.rise_ms) * 1_000,
            rise_bursts: u64::from(session.wearer.rise_bursts),
        };
        let points = session.joint.iter().flat_map(JointSpec::points);
        let ranges = points
            .filter(|point| point.channel == channel.index())
            .map(|point| [point.threshold, point.max]);
        notes.extend(ranges.filter_map(|range| rise.law_note(range)));
        if let Course::Stimulus(index, course) = &session.setpoints.course
            && *index == channel.index()
        {
            notes.extend(rise.course_note(&course.points, course.is_held, ""));
        }
        let steps = session.setpoints.programs.steps(channel.index());
        notes.extend(steps.and_then(|points| rise.course_note(points, true, " of its program")));
    }
    notes
}

/// Limits of the wearer and of a channel on how fast the channel's amplitude may rise.
struct Rise<'a> {
    channel: &'a Channel,
    start: Amplitude,
    /// Largest increase of the amplitude from one burst to the next.
    slope: Amplitude,
    rise_us: u64,
    rise_bursts: u64,
}

impl Rise<'_> {
    /// Returns a note on how long an amplitude that a control law sets takes from `threshold` to
    /// `max`; `None` if one burst is enough.
    fn law_note(&self, [threshold, max]: [Amplitude; 2]) -> Option<String> {
        let range = max.get().saturating_sub(threshold.get());
        if max <= self.start || range <= self.slope.get() {
            return None;
        }
        let bursts = u64::from(range.div_ceil(self.slope.get().max(1)));
        Some(format!(
            "channel {}: `max` is {} above `threshold`, and the amplitude rises by at most {} per \
             burst (`rise_ms`, `rise_bursts`), so a full rise takes {bursts} bursts, {} s",
            self.channel.number,
            self.channel.format_amplitude(Amplitude::new(range)),
            self.channel.format_amplitude(self.slope),
            self.seconds(bursts * self.period_us()),
        ))
    }

    /// Returns a note on the step of an amplitude course that takes longest; `None` for a ramp, and
    /// if no step takes longer than one period of the train. The times in `points` count from the
    /// start of the session, or from the start of a pass; `suffix` is then added to the text to say so.
    fn course_note(
        &self,
        points: &[(u64, Stimulus)],
        is_held: bool,
        suffix: &str,
    ) -> Option<String> {
        let first = points.first().map(|&(at_us, to)| (0, at_us, to));
        let pairs = points.windows(2).filter_map(|pair| match pair {
            [(_, from), (at_us, to)] => Some((from.amplitude.get(), *at_us, *to)),
            _ => None,
        });
        let steps = first.into_iter().chain(pairs).filter(|_| is_held);
        let taken =
            steps.map(|(from, at_us, to)| (self.rise_time_us(from, to.amplitude), at_us, to));
        let (takes_us, at_us, to) = taken.max_by_key(|(takes_us, ..)| *takes_us)?;
        (takes_us > self.period_us()).then(|| {
            format!(
                "channel {}: the step to {} at {} s{suffix} takes {} s (`rise_ms`, `rise_bursts`)",
                self.channel.number,
                self.channel.format_amplitude(to.amplitude),
                self.seconds(at_us),
                self.seconds(takes_us)
            )
        })
    }

    /// Returns the time that the amplitude needs to rise `from` one value `to` another, µs.
    fn rise_time_us(&self, from: u32, to: Amplitude) -> u64 {
        let by = to.get().saturating_sub(from);
        if to <= self.start || by == 0 {
            return 0;
        }
        match from {
            0 => self.rise_us.max(self.rise_bursts * self.period_us()),
            _ => u64::from(by.div_ceil(self.slope.get().max(1))) * self.period_us(),
        }
    }

    fn period_us(&self) -> u64 {
        self.channel.spec.train.period_us.into()
    }

    fn seconds(&self, us: u64) -> String {
        format_scaled(us.cast_signed(), 6)
    }
}
