//! Plays one lift on the whole native device (link, guard, scheduler) and compares it with the fast
//! simulation, which has none of these parts.

use super::calibration::{ARMS, CHANNELS, Curves, curves, specs};
use super::control::LearntTorque;
use super::declaration::{Condition, Study};
use super::device::Device;
use super::error::LiftError;
use super::person::LiftWearer;
use super::trial::{Trace, Worker};
use firmware::haptics::ModulationSpec;
use firmware::link::{Event, Request};
use firmware::pulse::TrainSpec;
use firmware::safety::{ChannelSpec, StageSpec, WearerSpec};
use firmware::units::{Amplitude, Micros};
use hal_sim::body::FixedLoad;
use hal_sim::body::sagittal::{ELBOW, JOINTS};
use hal_sim::native::native;
use hal_sim::wire::faults::Faults;
use hal_sim::world::World;
use host_core::link::{Connection, Error, Incoming, Port, SimulatedPort};
use serde::Serialize;
use std::collections::BTreeMap;

/// Full scale of the output stages, µA, in the form of [`StageSpec::Current`].
const FULL_SCALE_UA: u32 = 100_000;
/// Largest code of the DAC.
const CODES: u64 = 65_535;
/// Interphase gap, µs.
const GAP_US: u16 = 50;
/// Offset between the bursts of successive channels, µs, which keeps them from overlapping.
const APART_US: u64 = 1_000;
/// Interval of the encoder readings, µs.
const WORD_US: u64 = 1_000;
/// Number of encoder readings between messages that the object is held.
const HELD_EVERY: usize = 20;
/// Largest lag and step of the search for the best lag, µs.
const LAGS_US: (u64, usize) = (8_000, 50);
/// Rise time of an amplitude, ms. It affects only the first burst.
const RISE_MS: u16 = 1;

/// Comparison of the whole device's bursts in a lift with those of the fast simulation. A burst is
/// one biphasic pulse.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct DeviceComparison {
    /// Bursts of the fast simulation, without each channel's first, in which the amplitude rises.
    pub bursts: usize,
    /// Bursts of the fast simulation that the device emits at the same time and within one DAC
    /// code.
    pub same: usize,
    /// Bursts that only the device has.
    pub alone: usize,
    /// Additional age of the device's angles, µs: the lag at which most bursts agree.
    pub lag_us: u64,
}

/// Amplitudes of all channels at each millisecond.
type Course = Vec<[Amplitude; CHANNELS]>;
/// DAC codes of first phases, by channel and time, µs from the start.
type Bursts = BTreeMap<(u8, u64), u64>;

/// Simulates one lift of a participant: first with the fast simulation, then with its encoder
/// readings on the whole device. `lift` is the index of the height and the seed of all randomness.
///
/// # Errors
/// Fails if the lift cannot be simulated, or with E759 if the device stops.
pub fn compare_whole_device(
    study: &Study,
    person: &LiftWearer,
    condition: Condition,
    lift: (usize, u64),
) -> Result<DeviceComparison, LiftError> {
    let own = &person.arms[0];
    let curves = curves(study, own.stature_m, own.mass_kg)?;
    let (trace, course) = simulate_fast(study, person, (&curves, condition), lift)?;
    let joints = specs(study, &curves, condition, &person.told);
    let bursts = play_on_device(study, &joints, &trace)?;
    let (most, step) = LAGS_US;
    let lags = (0..=most).step_by(step);
    let comparisons = lags.map(|lag_us| compare_bursts(study, (&course, &bursts), lag_us));
    // Keeps the first lag with the most agreement.
    let best = comparisons.reduce(|best, candidate| {
        if candidate.same > best.same {
            candidate
        } else {
            best
        }
    });
    Ok(best.unwrap_or(DeviceComparison {
        bursts: 0,
        same: 0,
        alone: bursts.len(),
        lag_us: 0,
    }))
}

/// Returns the encoder readings of a lift, and the amplitudes of the device's modulation alone.
fn simulate_fast(
    study: &Study,
    person: &LiftWearer,
    (curves, condition): (&Curves, Condition),
    lift: (usize, u64),
) -> Result<(Trace, Course), LiftError> {
    let mut device = Device::new(study, curves, condition, &person.told)?;
    let mut trace = Trace::default();
    let mut learnt = [LearntTorque::NOTHING; 2];
    let mut worker = Worker::new(study, person)?;
    worker.lift(&mut device, lift, [0.0; 2], &mut learnt, Some(&mut trace))?;
    device.reset();
    let amplitudes = trace.encoders_deg.iter().map(|deg| {
        device.tick(deg.map(|arm| arm[ELBOW]));
        device.amplitudes(*deg)
    });
    let course = amplitudes.collect();
    Ok((trace, course))
}

/// Returns the first phases of all bursts that a native device emits for these encoder readings.
fn play_on_device(
    study: &Study,
    joints: &[ModulationSpec],
    trace: &Trace,
) -> Result<Bursts, LiftError> {
    let boot = Micros::new(0);
    let body = Box::new(FixedLoad::new(0.0));
    let world = World::new(Box::new(native(boot)), body, boot, Faults::default(), 1);
    let (mut client, _) = Connection::open(SimulatedPort::new(world))?;
    set_up(&mut client, study, joints)?;
    client.arm()?;
    if let Some(degrees) = trace.encoders_deg.first() {
        for word in measurement_requests(degrees, client.port().now_us()) {
            client.request(word)?;
        }
        client.request(Request::ObjectHeld { held: true })?;
    }
    let begin_us = client.start()?; // device time is world time
    let mut due_us = begin_us;
    for (nth, degrees) in trace.encoders_deg.iter().enumerate() {
        advance_until(&mut client, due_us)?;
        for word in measurement_requests(degrees, due_us) {
            client.post(word)?;
        }
        if nth.is_multiple_of(HELD_EVERY) {
            client.post(Request::ObjectHeld { held: true })?;
        }
        due_us += WORD_US;
    }
    advance_until(&mut client, due_us)?;
    let Some(world) = client.port().world() else {
        return Ok(Bursts::new());
    };
    let edges = world.recorder.trace.edges_from(begin_us);
    let driven = edges.filter(|edge| edge.state.is_driven() && edge.t_us < due_us);
    let mut bursts = Bursts::new();
    for edge in driven {
        let at_us = edge.t_us - begin_us;
        // Skips the second phase of a burst.
        let phase_us = u64::from(study.protocol.width_us) + u64::from(GAP_US);
        let is_second = at_us
            .checked_sub(phase_us)
            .is_some_and(|first_us| bursts.contains_key(&(edge.channel, first_us)));
        if !is_second {
            bursts.insert((edge.channel, at_us), u64::from(edge.dac_code));
        }
    }
    Ok(bursts)
}

/// Configures the channels and joints of the study.
fn set_up(
    client: &mut Connection<SimulatedPort>,
    study: &Study,
    joints: &[ModulationSpec],
) -> Result<(), Error> {
    client.wearer(WearerSpec {
        rise_ms: RISE_MS,
        ..WearerSpec::default()
    })?;
    let (width_us, period_us) = (study.protocol.width_us as u16, study.period_us() as u32);
    for joint in joints {
        for muscle in joint.muscles() {
            let train = TrainSpec {
                offset_us: offset_us(muscle.channel) as u32,
                ..TrainSpec::biphasic(width_us, GAP_US, period_us)
            };
            let spec = ChannelSpec {
                train,
                stage: StageSpec::Current {
                    full_scale_ua: FULL_SCALE_UA,
                },
                limit: muscle.base,
                start: Amplitude::new(0),
                area_mm2: ChannelSpec::ASSUMED_AREA_MM2,
            };
            client.channel(muscle.channel, spec)?;
        }
        client.request(Request::Modulation(*joint))?;
    }
    Ok(())
}

/// Returns the offset of a channel's train from the start of the period, µs.
fn offset_us(channel: u8) -> u64 {
    APART_US * (1 + u64::from(channel))
}

/// Returns the measurement requests of all four joints with the time stamp `at_us`.
fn measurement_requests(
    degrees: &[[f64; JOINTS]; ARMS],
    at_us: u64,
) -> impl Iterator<Item = Request> {
    let at = Micros::new(at_us as u32); // modulo 2^32
    let angles = degrees.iter().flatten();
    (0u8..)
        .zip(angles)
        .map(move |(joint, deg)| Request::Measurement {
            joint,
            centideg: (100.0 * deg).round() as i16, // within ±180°
            at,
        })
}

/// Runs to `until_us`; fails if the device refuses a request or reports a fault.
fn advance_until(client: &mut Connection<SimulatedPort>, until_us: u64) -> Result<(), LiftError> {
    while let Some(incoming) = client.next(until_us)? {
        match incoming {
            Incoming::Refused(_, refused) => return Err(Error::Refused(refused).into()),
            Incoming::Event(_, Event::Faulted(record)) => {
                return Err(LiftError::Faulted(format!("{:?}", record.fault)));
            }
            _ => {}
        }
    }
    Ok(())
}

/// Compares each expected burst with the amplitude of the fast simulation `lag_us` earlier.
fn compare_bursts(
    study: &Study,
    (course, bursts): (&Course, &Bursts),
    lag_us: u64,
) -> DeviceComparison {
    let end_us = WORD_US * course.len() as u64;
    let mut found = DeviceComparison {
        bursts: 0,
        same: 0,
        alone: 0,
        lag_us,
    };
    for channel in 0..CHANNELS as u8 {
        let mut has_risen = false;
        let times_us = (0..).map(|nth: u64| offset_us(channel) + nth * study.period_us());
        for due_us in times_us.take_while(|due_us| *due_us < end_us) {
            let before = due_us.checked_sub(lag_us).map(|us| us / WORD_US);
            let wanted = before.and_then(|ms| course.get(ms as usize));
            let wanted = wanted.map_or(0, |amplitudes| amplitudes[usize::from(channel)].get());
            let got = bursts.get(&(channel, due_us));
            match (wanted, got) {
                (0, got) => found.alone += usize::from(got.is_some()),
                (_, _) if !has_risen => has_risen = true,
                (wanted, got) => {
                    let code = u64::from(wanted) * CODES / u64::from(FULL_SCALE_UA);
                    found.bursts += 1;
                    found.same += usize::from(got.is_some_and(|got| got.abs_diff(code) <= 1));
                }
            }
        }
    }
    found
}
