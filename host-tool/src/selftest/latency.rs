//! From the last byte of a setpoint to the earliest slot it can change.

use super::{Random, channel, open_with};
use crate::link::{Client, Error, Incoming, SimulatedPort};
use firmware::control::{HoldPolicy, JointSpec, LawSpec, PointSpec, SensorSource};
use firmware::link::Request;
use firmware::pulse::{CHANNELS, WINDOW_US};
use firmware::safety::WearerSpec;
use firmware::units::Amplitude;
use hal_sim::body::Still;
use hal_sim::trace::State;
use hal_sim::wire::faults::Faults;

/// Which way a setpoint takes through the device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Path {
    /// A direct amplitude.
    Direct,
    /// An angle through the control law.
    Control,
}

/// What was found over all arrivals, µs, from the outputs alone.
#[derive(Clone, Copy, Debug, Default)]
pub struct Latency {
    /// Setpoints sent.
    pub arrivals: u32,
    /// Longest time from a last byte to the first window that it changed.
    pub worst_us: u64,
    /// Shortest such time.
    pub best_us: u64,
    /// Setpoints that never showed, or showed against the order of arrival.
    /// Anything but 0 is a defect.
    pub contradictions: u32,
}

/// Bursts come every 5.003 ms, so that arrivals meet every phase of the
/// windows and of the control tick.
const PERIOD_US: u32 = 5_003;

/// Everything in the device repeats with the control tick, µs.
const TICK_US: u64 = 1_000;

/// Windows after the tick's start that are looked at.
const WINDOWS: usize = 16;

/// For each window after the start of the tick in which bytes arrive: the
/// latest phase of arrival that still changed it and the earliest that did not.
#[derive(Default)]
struct Deadlines {
    made: [Option<u64>; WINDOWS],
    missed: [Option<u64>; WINDOWS],
}

impl Deadlines {
    fn note(&mut self, arrival_us: u64, burst_us: u64, is_new: bool) {
        let phase = (arrival_us - u64::from(super::BOOT.0)) % TICK_US;
        let window = (window_start(burst_us) + phase - arrival_us) / u64::from(WINDOW_US);
        let index = usize::try_from(window).unwrap_or(WINDOWS);
        let (made, missed) = (self.made.get_mut(index), self.missed.get_mut(index));
        match (is_new, made, missed) {
            (true, Some(made), _) => *made = (*made).max(Some(phase)),
            (false, _, Some(missed)) => *missed = Some(missed.map_or(phase, |m| m.min(phase))),
            _ => {}
        }
    }

    /// Worst and best time to the first window that can be made, over every
    /// phase of arrival, and how many windows contradict a deadline.
    fn summary(&self) -> (u64, u64, u32) {
        let to_first = |phase: u64| {
            let first = self
                .made
                .iter()
                .position(|made| made.is_some_and(|last| phase <= last));
            first.map(|window| window as u64 * u64::from(WINDOW_US) - phase)
        };
        let times: Vec<_> = (0..TICK_US).map_while(to_first).collect();
        let both = self.made.iter().zip(&self.missed);
        let wrong = both.filter(|(made, missed)| {
            made.zip(**missed)
                .is_some_and(|(made, missed)| missed <= made)
        });
        let (worst, best) = (times.iter().max(), times.iter().min());
        (
            worst.copied().unwrap_or(0),
            best.copied().unwrap_or(0),
            wrong.count() as u32,
        )
    }
}

/// Sends `arrivals` setpoints at random times and looks for each in the trace.
///
/// # Errors
/// The simulated device refused.
pub fn latency(path: Path, arrivals: u32, seed: u64) -> Result<Latency, Error> {
    let mut random = Random(seed);
    let mut client = prepared(path)?;
    let mut deadlines = Deadlines::default();
    let mut unseen = 0;
    for index in 0..arrivals {
        let at = client.port().world.now_us() + random.below(TICK_US);
        run_to(&mut client, at)?;
        let old = latest_codes(&mut client);
        client.port().world.recorder.forget();
        client.post(setpoint(path, index))?;
        run_to(&mut client, at + 2 * u64::from(PERIOD_US))?;
        let mut seen = false;
        for (channel, start, code) in bursts(&mut client) {
            let is_new = old[usize::from(channel)] != Some(code);
            seen |= is_new;
            if start > at {
                deadlines.note(at, start, is_new);
            }
        }
        unseen += u32::from(!seen);
    }
    let (worst_us, best_us, wrong) = deadlines.summary();
    Ok(Latency {
        arrivals,
        worst_us,
        best_us,
        contradictions: unseen + wrong,
    })
}

/// The code in force on each channel.
fn latest_codes(client: &mut Client<SimulatedPort>) -> [Option<u16>; CHANNELS] {
    let mut codes = [None; CHANNELS];
    for (channel, _, code) in bursts(client) {
        codes[usize::from(channel)] = Some(code);
    }
    codes
}

/// Windows begin at multiples of 250 µs after boot.
fn window_start(t_us: u64) -> u64 {
    let boot = u64::from(super::BOOT.0);
    t_us - (t_us - boot) % u64::from(WINDOW_US)
}

/// Channel, start and amplitude code of every recorded burst.
fn bursts(client: &mut Client<SimulatedPort>) -> Vec<(u8, u64, u16)> {
    let trace = &client.port().world.recorder.trace;
    let starts = trace.edges().filter(|edge| edge.state == State::Cathodic);
    starts
        .map(|edge| (edge.channel, edge.t_us, edge.dac_code))
        .collect()
}

/// Two setpoints in turn, far apart.
fn setpoint(path: Path, index: u32) -> Request {
    let high = index.is_multiple_of(2);
    match path {
        Path::Direct => {
            let value = Amplitude(if high { 15_000 } else { 10_000 });
            Request::Amplitudes {
                mask: 0x3FF,
                values: [value; CHANNELS].into_iter().collect(),
            }
        }
        Path::Control => {
            let centideg = if high { 9_000 } else { 100 };
            Request::Angle {
                at: None,
                centideg,
                centideg_per_s: Some(0),
            }
        }
    }
}

fn run_to(client: &mut Client<SimulatedPort>, until_us: u64) -> Result<(), Error> {
    while let Some(incoming) = client.next(until_us)? {
        if let Incoming::Refused(_, refused) = incoming {
            return Err(Error::Refused(refused));
        }
    }
    Ok(())
}

fn prepared(path: Path) -> Result<Client<SimulatedPort>, Error> {
    // A joint that rests in the middle, seen by the board's converter.
    let mut client = open_with(Box::new(Still::new(50.0)), Faults::default(), 1)?;
    client.port().world.joint_adc = Some((40.0, 48.0));
    client.wearer(WearerSpec {
        rise_ms: 1,
        ..WearerSpec::default()
    })?;
    let channels = if path == Path::Control {
        3
    } else {
        CHANNELS as u32
    };
    for index in 0..channels {
        client.channel(
            index as u8,
            channel(PERIOD_US, index * PERIOD_US / channels),
        )?;
    }
    if path == Path::Control {
        client.joint(joint())?;
    }
    client.arm()?;
    client.start()?;
    client.request(setpoint(path, 1))?;
    let now = client.port().world.now_us();
    run_to(&mut client, now + 30_000)?;
    Ok(client)
}

/// Proportional control with nothing that remembers: the setpoint alone
/// decides the amplitude.
fn joint() -> JointSpec {
    let point = |channel| PointSpec {
        channel,
        threshold: Amplitude(5_000),
        max: Amplitude(20_000),
    };
    JointSpec {
        law: LawSpec::Pid {
            kp_milli: 1_000,
            ki_milli: 0,
            kd_milli: 0,
        },
        law_period_ms: 1,
        cutoff_mhz: 6_000,
        flexors: [point(0), point(1)].into_iter().collect(),
        extensor: point(2),
        hold: HoldPolicy::Hold,
        angle_min_mdeg: 0,
        angle_max_mdeg: 100_000,
        sensor: SensorSource::Adc {
            code_at_0: 48,
            code_at_100: 4_048,
        },
        stale_after_ms: 50,
    }
}
