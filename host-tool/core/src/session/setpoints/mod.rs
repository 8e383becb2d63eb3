//! `[setpoints]`: the values that the host streams while the session runs.

mod pairs;
mod read;
mod stimulus;
#[cfg(test)]
mod tests;
mod times;
mod wrench;

use std::f64::consts::TAU;

use super::program::Programs;
use firmware::control::setpoint::ESTIMATED_RATE_MAX;
use firmware::link::Request;
use firmware::safety::{PulseList, Stimulus};
use firmware::units::{Amplitude, Micros};

pub(super) use pairs::{check_stimulus, is_free, read_stimulus};
pub(super) use read::read_setpoints;
pub use stimulus::StimulusCourse;
pub(super) use times::read_time;
pub use wrench::{WrenchCourse, newtons, possible_part};

/// Smallest number of setpoints that the host sends within its timeout (`host_timeout_ms`), after
/// which the device stops the stimulation.
const SIGNS_OF_LIFE: f64 = 3.0;

/// Setpoints that the host streams during a session, and their rate.
#[derive(Clone, PartialEq, Debug)]
pub struct Setpoints {
    /// Setpoints per second, Hz. The time between two setpoints is always shorter than the wearer's
    /// `host_timeout_ms`.
    pub rate_hz: f64,
    /// Values of the main setpoint over time; [`Self::at`] computes them.
    pub course: Course,
    /// Courses of force on further channels (0–9 on the link), sent with every main setpoint.
    pub forces: Vec<(u8, ForceCourse)>,
    /// Constant amplitudes of channels that nothing else drives, sent with every main setpoint.
    /// They are sorted by channel (0–9 on the link).
    pub beside: Vec<(u8, Stimulus)>,
    /// Courses of amplitude on further channels (0–9 on the link), in thousandths of the channel's
    /// unit although [`ForceCourse`] is in mN. They exist only in the trial that tests the range of
    /// `bounds`.
    pub swings: Vec<(u8, ForceCourse)>,
    /// Ranges within which a live client may stream setpoints of its own.
    pub bounds: Vec<Bounds>,
    /// Lists of pulses, each with the time at which it is sent, µs after the start.
    pub lists: Vec<(u64, PulseList)>,
    /// Programs: repeated amplitude patterns of channels that nothing else drives.
    pub programs: Programs,
}

/// Range of the setpoints that a live client may stream to one channel.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Bounds {
    /// Channel index on the link, 0–9.
    pub channel: u8,
    /// Whether the setpoints are forces in mN. Otherwise they are amplitudes in thousandths of the
    /// channel's unit.
    pub is_force: bool,
    /// Smallest setpoint, mN or thousandths of the channel's unit.
    pub least: u32,
    /// Largest setpoint, above `least`, in the same unit.
    pub most: u32,
    /// Largest change of the setpoint per second; `None` if it may change in steps of any size.
    pub per_s: Option<u32>,
    /// Shortest time for which the client keeps a setpoint, µs.
    pub shortest_us: u64,
}

/// Course of the main setpoint over a session.
#[derive(Clone, PartialEq, Debug)]
pub enum Course {
    /// No value: the host only sends keep-alives, which is all that a wall needs.
    KeepAlive,
    /// Constant amplitudes, each with its channel (0–9 on the link), sorted by channel.
    Amplitudes(Vec<(u8, Stimulus)>),
    /// Amplitude and pulse width of one channel (0–9 on the link) over time.
    Stimulus(u8, StimulusCourse),
    /// Joint angle that follows a sine: offset + amplitude · sin(2π·frequency·t).
    AngleSine {
        /// Centre of the sine, as a joint angle in °.
        offset_deg: f64,
        /// Amplitude of the sine: half the distance between its extremes, °.
        amplitude_deg: f64,
        /// Frequency of the sine, Hz.
        frequency_hz: f64,
    },
    /// Joint angles as (time in µs, angle in 0.01°). Each angle is wanted from its time until the
    /// next one. The first time is 0.
    AngleSteps(Vec<(u64, i16)>),
    /// Force of the muscle under one channel (0–9 on the link) over time.
    Force(u8, ForceCourse),
    /// Force at the hand of the session's arm over time.
    Wrench(WrenchCourse),
    /// Whether an object is held, as (time in µs, value). Each value applies from its time until
    /// the next one. The first time is 0.
    Held(Vec<(u64, bool)>),
}

/// Course of the wanted force of a muscle over time.
#[derive(Clone, PartialEq, Debug)]
pub enum ForceCourse {
    /// Forces as (time in µs, force in mN). The first time is 0, the force changes linearly between
    /// the entries, and the last force stays. A change of more than 1000 N/s is a step, over which
    /// the device does not extrapolate.
    Ramp(Vec<(u64, u32)>),
    /// Force that follows a sine: offset + amplitude · sin(2π·frequency·t).
    Sine {
        /// Centre of the sine, N.
        offset_n: f64,
        /// Amplitude of the sine: half the distance between its extremes, N.
        amplitude_n: f64,
        /// Frequency of the sine, Hz.
        frequency_hz: f64,
    },
}

/// One setpoint that the host sends to the device.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Setpoint {
    /// Keep-alive: shows the device that the host still runs, and has no value.
    KeepAlive,
    /// Wanted angle of the session's joint.
    Angle {
        /// Wanted angle, 0.01°.
        centideg: i16,
        /// Rate at which the wanted angle changes, 0.01 °/s; 0 for a course of steps.
        centideg_per_s: i32,
    },
    /// Amplitudes and pulse widths, each with its channel (0–9 on the link), sorted by channel. If
    /// every width is 0, all channels use the width of their train. Otherwise no width is 0.
    Amplitudes(Vec<(u8, Stimulus)>),
    /// Wanted force of the muscle under a channel with force control.
    Force {
        /// Channel index on the link, 0–9.
        channel: u8,
        /// Wanted force, mN.
        millinewton: u32,
        /// Rate at which the wanted force changes, mN/s; 0 during a step.
        millinewton_per_s: i32,
    },
    /// Wanted force at the hand of the arm, mN: backward, to the right and upward, seen from the
    /// thorax.
    Wrench([i32; 3]),
    /// Whether the wearer holds an object; modulated joints are stimulated only while this is true.
    Held(bool),
}

impl Setpoint {
    /// Returns the request that carries the setpoint to the device. Amplitudes, angles and forces
    /// are valid from the device time `at` on, or from their arrival if `at` is `None`.
    #[must_use]
    pub fn to_request(&self, at: Option<Micros>) -> Request {
        match self {
            Self::KeepAlive => Request::KeepAlive,
            &Self::Angle {
                centideg,
                centideg_per_s,
            } => Request::Angle {
                at,
                centideg,
                centideg_per_s: Some(centideg_per_s),
            },
            &Self::Force {
                channel,
                millinewton,
                millinewton_per_s,
            } => Request::Force {
                channel,
                at,
                millinewton,
                millinewton_per_s: Some(millinewton_per_s),
            },
            &Self::Wrench(force_mn) => Request::Wrench { at, force_mn },
            &Self::Held(held) => Request::ObjectHeld { held },
            Self::Amplitudes(values) => {
                let channels = values.iter().map(|(channel, _)| channel);
                let stimuli = || values.iter().map(|(_, stimulus)| stimulus);
                Request::Amplitudes {
                    at,
                    mask: channels.fold(0, |mask, channel| mask | 1 << channel),
                    // There are at most ten channels.
                    values: stimuli().map(|stimulus| stimulus.amplitude).collect(),
                    widths: match stimuli().any(|stimulus| stimulus.width_us != 0) {
                        true => stimuli().map(|stimulus| stimulus.width_us).collect(),
                        false => Default::default(),
                    },
                }
            }
        }
    }
}

impl Setpoints {
    /// Returns setpoints that consist of `programs` and of keep-alives. They are sent at the burst
    /// rate of the fastest train of the programs, and at least three times within `timeout_ms`, the
    /// host silence after which the device stops.
    pub(super) fn from_programs(programs: Programs, timeout_ms: u16) -> Self {
        let period_us = programs.shortest_period_us().unwrap_or(u64::MAX) as f64;
        let alive_us = f64::from(timeout_ms) * 1e3 / SIGNS_OF_LIFE;
        Self {
            rate_hz: 1e6 / period_us.min(alive_us),
            course: Course::KeepAlive,
            forces: Vec::new(),
            beside: Vec::new(),
            swings: Vec::new(),
            bounds: Vec::new(),
            lists: Vec::new(),
            programs,
        }
    }

    /// Returns the main setpoint `t_us` after the start.
    #[must_use]
    pub fn at(&self, t_us: u64) -> Setpoint {
        match &self.course {
            Course::KeepAlive => Setpoint::KeepAlive,
            Course::Amplitudes(values) => Setpoint::Amplitudes(values.clone()),
            &Course::AngleSine {
                offset_deg,
                amplitude_deg,
                frequency_hz,
            } => {
                let turns = frequency_hz * (t_us as f64 / 1e6);
                let (sin, cos) = libm::sincos(TAU * turns.fract());
                let rate = TAU * frequency_hz * amplitude_deg * cos;
                Setpoint::Angle {
                    centideg: to_centi(offset_deg + amplitude_deg * sin) as i16, // ±180°: checked
                    centideg_per_s: to_centi(rate) as i32,
                }
            }
            Course::AngleSteps(steps) => {
                let index = steps.partition_point(|&(at_us, _)| at_us <= t_us);
                let step = steps.get(index.saturating_sub(1));
                Setpoint::Angle {
                    centideg: step.map_or(0, |&(_, centideg)| centideg),
                    centideg_per_s: 0,
                }
            }
            Course::Force(channel, course) => course.setpoint(*channel, t_us),
            Course::Wrench(course) => Setpoint::Wrench(course.at(t_us)),
            Course::Held(points) => {
                let index = points.partition_point(|&(at_us, _)| at_us <= t_us);
                let point = points.get(index.saturating_sub(1));
                Setpoint::Held(point.is_some_and(|&(_, held)| held))
            }
            Course::Stimulus(channel, course) => {
                Setpoint::Amplitudes(vec![(*channel, course.at(t_us))])
            }
        }
    }

    /// Returns the further forces and amplitudes that the host sends together with the main
    /// setpoint, `t_us` after the start.
    pub fn accompanying_at(&self, t_us: u64) -> impl Iterator<Item = Setpoint> {
        let forces = self.forces.iter();
        let forces = forces.map(move |(channel, course)| course.setpoint(*channel, t_us));
        let beside = (!self.beside.is_empty()).then(|| Setpoint::Amplitudes(self.beside.clone()));
        let swings = self.swings.iter().map(move |(channel, course)| {
            let amplitude = Amplitude::new((course.at(t_us).0 * 1e3).round() as u32); // saturates
            Setpoint::Amplitudes(vec![(*channel, Stimulus::with_own_width(amplitude))])
        });
        forces.chain(beside).chain(swings)
    }

    /// Returns the course of the wanted force on a channel (0–9 on the link), or `None` if the host
    /// asks for no force there.
    #[must_use]
    pub fn force_course(&self, channel: u8) -> Option<&ForceCourse> {
        match &self.course {
            Course::Force(driven, course) if *driven == channel => Some(course),
            _ => {
                let mut forces = self.forces.iter();
                let found = forces.find(|(driven, _)| *driven == channel);
                found.map(|(_, course)| course)
            }
        }
    }

    /// Returns the smallest and the largest value that the host streams to a channel (0–9 on the
    /// link): a force in mN, or an amplitude in thousandths of the channel's unit. `None` if it
    /// streams none.
    pub(super) fn extremes(&self, channel: u8) -> Option<(u32, u32)> {
        let milli = |newton: f64| (newton * 1e3).round() as u32; // saturates
        let programmed = self.programs.extremes(channel);
        if programmed.is_some() {
            return programmed;
        }
        if let Course::Stimulus(driven, course) = &self.course
            && *driven == channel
        {
            return course.extremes();
        }
        let constant = match &self.course {
            Course::Amplitudes(values) => values,
            _ => &self.beside,
        };
        let mut constant = constant.iter().filter(|(driven, _)| *driven == channel);
        match self.force_course(channel) {
            None => constant
                .next()
                .map(|(_, stimulus)| (stimulus.amplitude.get(), stimulus.amplitude.get())),
            Some(ForceCourse::Ramp(points)) => {
                let forces = || points.iter().map(|(_, mn)| *mn);
                forces().min().zip(forces().max())
            }
            Some(&ForceCourse::Sine {
                offset_n,
                amplitude_n,
                ..
            }) => Some((milli(offset_n - amplitude_n), milli(offset_n + amplitude_n))),
        }
    }

    /// Returns the largest amplitude that the host streams to a channel (0–9 on the link), in
    /// thousandths of its unit; `None` for a channel whose amplitudes the host does not set.
    #[must_use]
    pub fn peak_amplitude(&self, channel: u8) -> Option<Amplitude> {
        let is_force = self.force_course(channel).is_some();
        let (_, most) = self.extremes(channel).filter(|_| !is_force)?;
        Some(Amplitude::new(most))
    }

    /// Returns the requests for the lists of pulses whose time is after `from_us` and at most
    /// `to_us`.
    pub fn due_lists(&self, from_us: u64, to_us: u64) -> impl Iterator<Item = Request> {
        let due = self.lists.iter();
        let due = due.filter(move |(at, _)| from_us < *at && *at <= to_us);
        due.map(|(_, list)| Request::Pulses {
            channel: list.channel,
            pulses: list.pulses.clone(),
        })
    }

    /// Returns the time at which the setpoint with this `index` (from 0) is due, µs after the
    /// start.
    #[must_use]
    pub fn due_us(&self, index: u64) -> u64 {
        (index as f64 * 1e6 / self.rate_hz).round() as u64
    }
}

impl ForceCourse {
    fn setpoint(&self, channel: u8, t_us: u64) -> Setpoint {
        let (newton, newton_per_s) = self.at(t_us);
        Setpoint::Force {
            channel,
            millinewton: (newton * 1e3).round() as u32, // saturates
            millinewton_per_s: (newton_per_s * 1e3).round() as i32,
        }
    }

    /// Returns the wanted force in N and its rate of change in N/s, `t_us` after the start.
    fn at(&self, t_us: u64) -> (f64, f64) {
        match self {
            Self::Ramp(points) => {
                let next = points.partition_point(|&(at_us, _)| at_us <= t_us);
                let newton = |mn: u32| f64::from(mn) * 1e-3;
                let before = points.get(next.saturating_sub(1));
                let (Some(&(from_us, from)), to) = (before, points.get(next)) else {
                    return (0.0, 0.0); // there is a first point: checked
                };
                let slope = to.map_or(0.0, |&(to_us, to)| {
                    (newton(to) - newton(from)) * 1e6 / (to_us - from_us) as f64
                });
                let is_step = slope.abs() > f64::from(ESTIMATED_RATE_MAX);
                let force = newton(from) + slope * (t_us - from_us) as f64 * 1e-6;
                (force, if is_step { 0.0 } else { slope })
            }
            &Self::Sine {
                offset_n,
                amplitude_n,
                frequency_hz,
            } => {
                let turns = frequency_hz * (t_us as f64 / 1e6);
                let (sin, cos) = libm::sincos(TAU * turns.fract());
                let rate = TAU * frequency_hz * amplitude_n * cos;
                (offset_n + amplitude_n * sin, rate)
            }
        }
    }
}

fn to_centi(value: f64) -> f64 {
    (value * 100.0).round()
}
