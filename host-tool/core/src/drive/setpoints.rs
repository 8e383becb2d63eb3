//! Setpoints of one call in everyday units, checked against the session before they are sent.

use crate::session::{Session, Setpoint};
use crate::wearer::Unit;
use firmware::link::Request;
use firmware::pulse::CHANNELS;
use firmware::safety::{StageSpec, Stimulus};
use firmware::units::Amplitude;
use std::collections::BTreeMap;

/// Largest code of an amplitude DAC.
const FULL_CODE: f64 = 65_535.0;

/// Smallest amplitude above 0, mA or V. Every wearer's thresholds are far above it: a smaller value
/// is one in amperes or kilovolts.
pub const LEAST: f64 = 0.05;

/// Values that one call asks for. Channels are numbered from 1.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct SetpointValues {
    /// Amplitudes of channels with current stages, mA; rounded to 0.001 mA.
    pub ma: BTreeMap<u8, f64>,
    /// Amplitudes of channels with voltage stages, V; rounded to 0.001 V.
    pub v: BTreeMap<u8, f64>,
    /// Pulse widths, µs. A channel without an amplitude in this call keeps its latest one.
    pub width_us: BTreeMap<u8, f64>,
    /// Forces of channels under force control, N; rounded to 0.001 N.
    pub force_n: BTreeMap<u8, f64>,
    /// Reference angle of the joint, °, and its rate, °/s; rounded to 0.01.
    pub angle_deg: Option<(f64, f64)>,
    /// Reference force at the hand, N, backward, to the right and upward; rounded to 0.001 N.
    pub endpoint_n: Option<[f64; 3]>,
    /// Whether the wearer holds an object.
    pub held: Option<bool>,
}

/// Reason why a value of a call is refused.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
pub enum SetpointError {
    /// The session has no such channel (E791).
    #[error("E791 {field}: there is no channel {channel} in the setup; its channels are {known}")]
    NoChannel {
        /// Name of the argument.
        field: &'static str,
        /// Number that was given.
        channel: u8,
        /// Channels of the setup.
        known: String,
    },
    /// The unit is that of the other kind of stage, or the channel has no force control (E792).
    #[error("E792 {field}: channel {channel} {has}; {remedy}")]
    OtherKind {
        /// Name of the argument.
        field: &'static str,
        /// Number of the channel.
        channel: u8,
        /// Kind of stage, or control that is missing, as a phrase.
        has: &'static str,
        /// Advice on the argument that fits the channel.
        remedy: &'static str,
    },
    /// The setup lacks the part that the value is for (E792).
    #[error("E792 {field}: the setup has no {part}; set one up before arming")]
    NoPart {
        /// Name of the argument.
        field: &'static str,
        /// Part that is missing, as a phrase.
        part: &'static str,
    },
    /// The value is not a number that the device could play (E793).
    #[error("E793 {field}: {value:?} for channel {channel} is not possible; allowed: {allowed}")]
    OutOfRange {
        /// Name of the argument.
        field: &'static str,
        /// Number of the channel.
        channel: u8,
        /// Refused value, in the unit of the argument.
        value: f64,
        /// Allowed values with their unit.
        allowed: String,
    },
    /// A value that belongs to no channel is out of range (E794).
    #[error("E794 {field}: {value:?} is not possible; allowed: {allowed}")]
    Impossible {
        /// Name of the argument.
        field: &'static str,
        /// Refused value, in the unit of the argument.
        value: f64,
        /// Allowed values with their unit.
        allowed: String,
    },
    /// A width was given for a channel that has no amplitude yet (E795).
    #[error(
        "E795 width_us: channel {channel} has no amplitude yet; give its amplitude in the same call"
    )]
    NoAmplitude {
        /// Number of the channel.
        channel: u8,
    },
}

impl SetpointValues {
    /// Returns the requests that send the values, and notes the amplitudes in `latest`. Amplitudes
    /// and widths are one request, which the device accepts or refuses as a whole.
    ///
    /// # Errors
    /// All mistakes of the call. `latest` is then unchanged.
    pub fn to_requests(
        &self,
        session: &Session,
        latest: &mut LatestAmplitudes,
    ) -> Result<Vec<Request>, Vec<SetpointError>> {
        let mut check = Check {
            session,
            mistakes: Vec::new(),
        };
        let stimuli = check.stimuli(self, latest);
        let mut setpoints = Vec::new();
        if !stimuli.is_empty() {
            setpoints.push(Setpoint::Amplitudes(stimuli.clone()));
        }
        setpoints.extend(check.forces(&self.force_n));
        setpoints.extend(self.angle_deg.and_then(|angle| check.angle(angle)));
        setpoints.extend(self.endpoint_n.and_then(|force| check.endpoint(force)));
        setpoints.extend(self.held.and_then(|is_held| check.held(is_held)));
        if !check.mistakes.is_empty() {
            return Err(check.mistakes);
        }
        for (index, stimulus) in stimuli {
            if let Some(slot) = latest.0.get_mut(usize::from(index)) {
                *slot = Some(stimulus.amplitude);
            }
        }
        let requests = setpoints.iter().map(|setpoint| setpoint.to_request(None));
        Ok(requests.collect())
    }
}

/// Latest amplitude that was sent to each channel.
#[derive(Clone, Debug, Default)]
pub struct LatestAmplitudes([Option<Amplitude>; CHANNELS]);

struct Check<'a> {
    session: &'a Session,
    mistakes: Vec<SetpointError>,
}

impl Check<'_> {
    /// Returns amplitudes and widths by channel index, sorted. Either all have a width, or none.
    fn stimuli(
        &mut self,
        wanted: &SetpointValues,
        latest: &LatestAmplitudes,
    ) -> Vec<(u8, Stimulus)> {
        let mut amplitudes = BTreeMap::new();
        for (field, unit, values) in [
            ("ma", Unit::Milliampere, &wanted.ma),
            ("v", Unit::Volt, &wanted.v),
        ] {
            for (&number, &value) in values {
                if let Some(amplitude) = self.amplitude(field, unit, number, value) {
                    amplitudes.insert(number, amplitude);
                }
            }
        }
        for &number in wanted.width_us.keys() {
            let is_given = wanted.ma.contains_key(&number) || wanted.v.contains_key(&number);
            if is_given || !self.has_channel("width_us", number) {
                continue;
            }
            let index = usize::from(number.saturating_sub(1));
            match latest.0.get(index).copied().flatten() {
                Some(amplitude) => drop(amplitudes.insert(number, amplitude)),
                None => self
                    .mistakes
                    .push(SetpointError::NoAmplitude { channel: number }),
            }
        }
        let has_widths = !wanted.width_us.is_empty();
        let mut stimuli = Vec::new();
        for (number, amplitude) in amplitudes {
            let width_us = match (has_widths, wanted.width_us.get(&number)) {
                (false, _) => Some(0),
                (true, Some(&width_us)) => self.width(number, width_us),
                (true, None) => self.own_width(number),
            };
            let Some(width_us) = width_us else { continue };
            let stimulus = Stimulus {
                amplitude,
                width_us,
            };
            stimuli.push((number.saturating_sub(1), stimulus));
        }
        stimuli
    }

    fn amplitude(
        &mut self,
        field: &'static str,
        unit: Unit,
        number: u8,
        value: f64,
    ) -> Option<Amplitude> {
        if !self.has_channel(field, number) {
            return None;
        }
        let channel = self.session.channel(number - 1)?; // from 1
        if channel.unit() != unit {
            let (has, remedy) = match unit {
                Unit::Milliampere => ("has a voltage stage", "give its amplitude in volts: v="),
                Unit::Volt => ("has a current stage", "give its amplitude in mA: ma="),
            };
            self.mistakes.push(SetpointError::OtherKind {
                field,
                channel: number,
                has,
                remedy,
            });
            return None;
        }
        let limit = f64::from(channel.spec.limit.get()) / 1e3;
        let step = full_scale(&channel.spec.stage) / FULL_CODE;
        let least = step.max(LEAST);
        let is_possible = value == 0.0 || (least..=limit).contains(&value);
        if !is_possible {
            let symbol = unit.symbol();
            let mut allowed = format!("0, or {least} {symbol} to {limit} {symbol}, its limit");
            if value < least && (least..=limit).contains(&(value * 1e3)) {
                allowed += &format!("; did you mean {} {symbol}?", value * 1e3);
            }
            self.refuse(field, number, value, allowed);
            return None;
        }
        Some(Amplitude::new((value * 1e3).round() as u32)) // at most the limit
    }

    fn width(&mut self, number: u8, width_us: f64) -> Option<u16> {
        let train = self.session.channel(number - 1)?.spec.train; // it exists: checked
        let (least, most) = (10, train.max_width_us.max(train.width_us));
        let is_fixed =
            train.max_width_us <= train.width_us && width_us != f64::from(train.width_us);
        let is_possible = width_us.fract() == 0.0
            && (f64::from(least)..=f64::from(most)).contains(&width_us)
            && !is_fixed;
        if !is_possible {
            let allowed = match train.max_width_us > train.width_us {
                true => format!("whole µs from {least} to {most}"),
                false => format!(
                    "only {most} µs, because the train has no max_width_us above its width_us"
                ),
            };
            self.refuse("width_us", number, width_us, allowed);
            return None;
        }
        Some(width_us as u16) // at most 500
    }

    fn own_width(&self, number: u8) -> Option<u16> {
        Some(self.session.channel(number - 1)?.spec.train.width_us)
    }

    fn forces(&mut self, forces: &BTreeMap<u8, f64>) -> Vec<Setpoint> {
        let mut setpoints = Vec::new();
        for (&number, &newton) in forces {
            if !self.has_channel("force_n", number) {
                continue;
            }
            let channel = self.session.channel(number - 1); // from 1
            if channel.is_some_and(|channel| channel.force.is_none()) {
                self.mistakes.push(SetpointError::OtherKind {
                    field: "force_n",
                    channel: number,
                    has: "is not under force control",
                    remedy: "give it a muscle and force control before arming",
                });
                continue;
            }
            if !(0.0..=4e6).contains(&newton) {
                self.refuse("force_n", number, newton, "0 N and more".to_owned());
                continue;
            }
            setpoints.push(Setpoint::Force {
                channel: number - 1,
                millinewton: (newton * 1e3).round() as u32, // at most 4e9
                millinewton_per_s: 0,
            });
        }
        setpoints
    }

    fn angle(&mut self, (deg, deg_per_s): (f64, f64)) -> Option<Setpoint> {
        let has_reference = self.session.joint.is_some() || self.session.wall.is_some();
        self.needs("angle_deg", has_reference, "joint or wall")?;
        let range = self.session.joint.as_ref().map(|joint| {
            [joint.angle_min_mdeg, joint.angle_max_mdeg].map(|mdeg| f64::from(mdeg) / 1e3)
        });
        let [min, max] = range.unwrap_or([-180.0, 180.0]);
        if !(min..=max).contains(&deg) {
            let whose = if range.is_some() { " of the joint" } else { "" };
            let allowed = format!("{min} to {max}°, the range{whose}");
            self.mistakes.push(impossible("angle_deg", deg, allowed));
            return None;
        }
        if !deg_per_s.is_finite() || deg_per_s.abs() > 10_000.0 {
            let allowed = "−10 000 to 10 000 °/s".to_owned();
            self.mistakes
                .push(impossible("rate_deg_per_s", deg_per_s, allowed));
            return None;
        }
        Some(Setpoint::Angle {
            centideg: (deg * 100.0).round() as i16, // at most 18 000
            centideg_per_s: (deg_per_s * 100.0).round() as i32, // at most 1 000 000
        })
    }

    fn held(&mut self, is_held: bool) -> Option<Setpoint> {
        let has_modulation = !self.session.modulations.is_empty();
        self.needs("held", has_modulation, "modulation")?;
        Some(Setpoint::Held(is_held))
    }

    /// Notes a mistake and returns `None` unless the setup has the `part` that an argument is for.
    fn needs(&mut self, field: &'static str, is_there: bool, part: &'static str) -> Option<()> {
        if !is_there {
            self.mistakes.push(SetpointError::NoPart { field, part });
        }
        is_there.then_some(())
    }

    fn endpoint(&mut self, force_n: [f64; 3]) -> Option<Setpoint> {
        let has_limb = self.session.limb.is_some();
        self.needs("endpoint_n", has_limb, "force at the hand (`endpoint`)")?;
        for newton in force_n {
            if !newton.is_finite() || newton.abs() > 1000.0 {
                let allowed = "−1000 to 1000 N in each direction".to_owned();
                self.mistakes
                    .push(impossible("endpoint_n", newton, allowed));
                return None;
            }
        }
        let millinewton = force_n.map(|newton| (newton * 1e3).round() as i32); // at most 1e6
        Some(Setpoint::Wrench(millinewton))
    }

    /// Returns whether the setup has the channel; otherwise notes the mistake.
    fn has_channel(&mut self, field: &'static str, number: u8) -> bool {
        let found = check_channel(self.session, field, number);
        let is_known = found.is_ok();
        self.mistakes.extend(found.err());
        is_known
    }

    fn refuse(&mut self, field: &'static str, channel: u8, value: f64, allowed: String) {
        self.mistakes.push(SetpointError::OutOfRange {
            field,
            channel,
            value,
            allowed,
        });
    }
}

fn impossible(field: &'static str, value: f64, allowed: String) -> SetpointError {
    SetpointError::Impossible {
        field,
        value,
        allowed,
    }
}

/// Returns the index on the link (0–9) of the channel with this number.
///
/// # Errors
/// The session has no such channel. `field` is the argument that names it.
pub fn check_channel(
    session: &Session,
    field: &'static str,
    number: u8,
) -> Result<u8, SetpointError> {
    let mut channels = session.channels.iter();
    if let Some(channel) = channels.find(|channel| channel.number == number) {
        return Ok(channel.index());
    }
    let numbers = session.channels.iter().map(|c| c.number.to_string());
    let known = numbers.collect::<Vec<_>>().join(", ");
    Err(SetpointError::NoChannel {
        field,
        channel: number,
        known,
    })
}

/// Returns the output at the full DAC code, mA or V.
fn full_scale(stage: &StageSpec) -> f64 {
    f64::from(stage.full_scale().get()) / 1e3
}
