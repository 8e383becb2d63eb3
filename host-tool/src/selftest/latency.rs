//! Measures the latency from the last byte of a setpoint to the first pulse slot that it can
//! change.

use super::channel;
use super::subject::{OpenSubject, Subject};
use firmware::control::{HoldPolicy, JointSpec, LawSpec, PointSpec, SensorSource};
use firmware::link::Request;
use firmware::pulse::{CHANNELS, WINDOW_US};
use firmware::safety::WearerSpec;
use firmware::units::Amplitude;
use hal_sim::body::FixedLoad;
use hal_sim::random::Random;
use hal_sim::trace::State;
use host_core::link::{Connection, Error, Incoming, SimulatedPort};
use host_core::run::OpenError;

/// Path of a setpoint through the device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Path {
    /// The setpoint is an amplitude, which goes to the channels directly.
    Direct,
    /// The setpoint is an angle, from which the control law computes the amplitudes.
    Control,
}

/// Histogram of latencies in steps of 100 µs, with minimum and maximum.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Distribution {
    /// Smallest latency, µs.
    pub best_us: u64,
    /// Largest latency, µs.
    pub worst_us: u64,
    /// Number of latencies in each step of the histogram, which begins at 0 µs. The last step is
    /// not empty.
    pub counts: Vec<u32>,
}

impl Distribution {
    /// Width of a step of the histogram, µs.
    pub const STEP_US: u64 = 100;

    fn from_times(times: impl Iterator<Item = u64>) -> Self {
        let mut found = Self {
            best_us: u64::MAX,
            worst_us: 0,
            counts: Vec::new(),
        };
        for time in times {
            found.best_us = found.best_us.min(time);
            found.worst_us = found.worst_us.max(time);
            let step = (time / Self::STEP_US) as usize;
            if step >= found.counts.len() {
                found.counts.resize(step + 1, 0);
            }
            found.counts[step] += 1;
        }
        found
    }
}

/// Latencies, measured at the outputs alone: the time from a setpoint to the first window of pulses
/// that the setpoint can still change.
#[derive(Clone, Debug)]
pub struct Latency {
    /// Number of setpoints sent.
    pub arrivals: u32,
    /// Latencies of all setpoints from the arrival of their last byte at the device.
    pub device: Distribution,
    /// Latencies of all setpoints from the host's write.
    pub whole: Distribution,
    /// Largest latency from the arrival at the device, µs, over all phases of the control tick,
    /// including the phases at which no setpoint arrived.
    pub worst_phase_us: u64,
    /// Uncertainty of the measured deadlines, µs: the largest time, over all windows, by which the
    /// last arrival that still changed a window came after the first arrival that did not.
    /// Latencies are computed from the first arrival that did not.
    pub blur_us: u64,
    /// Number of setpoints that never changed an output. Any number but 0 is a defect.
    pub unseen: u32,
}

/// Time between pulses of a channel, µs. The ten channels take turns, so one of them pulses every
/// 525.1 µs. Each pulse comes 25 µs later within the control tick than the one before, so after a
/// few arrivals every window has had pulses. (With 5.003 ms, half of the windows would have no
/// pulses for seconds.)
const PERIOD_US: u32 = 5_251;

/// Control tick, µs: the period with which all work of the device repeats.
const TICK_US: u64 = 1_000;

/// Number of windows that are compared, counted from the start of the tick in which a setpoint
/// arrives.
const WINDOWS: usize = 16;

/// For each window after the start of the tick in which a setpoint arrives: the latest phase of
/// arrival that still changed the window (`made`), and the earliest phase that did not (`missed`).
#[derive(Default)]
struct Deadlines {
    made: [Option<u64>; WINDOWS],
    missed: [Option<u64>; WINDOWS],
}

impl Deadlines {
    /// Records a burst that starts `after_us` after the start of the tick in which a setpoint
    /// arrived at `phase`. `is_new` tells whether the burst has the new amplitude.
    fn add_burst(&mut self, phase: u64, after_us: u64, is_new: bool) {
        let index = usize::try_from(after_us / u64::from(WINDOW_US)).unwrap_or(WINDOWS);
        let (made, missed) = (self.made.get_mut(index), self.missed.get_mut(index));
        match (is_new, made, missed) {
            (true, Some(made), _) => *made = (*made).max(Some(phase)),
            (false, _, Some(missed)) => *missed = Some(missed.map_or(phase, |m| m.min(phase))),
            _ => {}
        }
    }

    /// Returns the time from `phase` to the first window that every arrival at this phase changes,
    /// µs; `None` if there was no such window.
    fn time_to_first_us(&self, phase: u64) -> Option<u64> {
        let pairs = self.made.iter().zip(&self.missed);
        let is_made = |(made, missed): (&Option<u64>, &Option<u64>)| {
            made.is_some_and(|last| phase <= last) && missed.is_none_or(|first| phase < first)
        };
        let first = pairs.map(is_made).position(|made| made);
        first.map(|window| window as u64 * u64::from(WINDOW_US) - phase)
    }

    fn blur(&self) -> u64 {
        let pairs = self.made.iter().zip(&self.missed);
        let blurs =
            pairs.filter_map(|(made, missed)| (*made)?.checked_sub((*missed)?)?.checked_add(1));
        blurs.max().unwrap_or(0)
    }
}

/// Sends `arrivals` setpoints at random times and searches for each in the trace.
///
/// # Errors
/// Fails if the simulated device refuses or does not run.
pub fn latency(
    subject: Subject<'_>,
    path: Path,
    arrivals: u32,
    seed: u64,
) -> Result<Latency, OpenError> {
    let mut random = Random::new(seed);
    let mut deadlines = Deadlines::default();
    let mut sent = Vec::new();
    let mut unseen = 0;
    let boots = subject.boot_count(arrivals);
    for boot in 0..boots {
        let shift_us = TICK_US * u64::from(boot) / u64::from(boots);
        let mut opened = prepare(subject, path, shift_us)?;
        let first = sent.len() as u32;
        let last = (u64::from(arrivals) * u64::from(boot + 1) / u64::from(boots)) as u32;
        // Each boot begins with the low setpoint in force, so the high one comes first.
        for index in 0..last - first {
            let at = opened.client.port().world.now_us() + random.below(PERIOD_US.into());
            let (arrived, is_seen) = send(&mut opened, path, index, at, &mut deadlines)?;
            sent.push((at, arrived, (arrived - opened.epoch_us()) % TICK_US));
            unseen += u32::from(!is_seen);
        }
    }
    let device = |&(_, _, phase): &(u64, u64, u64)| deadlines.time_to_first_us(phase);
    let total = |times: &(u64, u64, u64)| Some(times.1 - times.0 + device(times)?);
    Ok(Latency {
        arrivals,
        device: Distribution::from_times(sent.iter().filter_map(device)),
        whole: Distribution::from_times(sent.iter().filter_map(total)),
        worst_phase_us: (0..TICK_US)
            .filter_map(|phase| deadlines.time_to_first_us(phase))
            .max()
            .unwrap_or(0),
        blur_us: deadlines.blur(),
        unseen,
    })
}

/// Sends one setpoint at `at` and records each burst for two periods. Returns the time of its
/// arrival at the device, µs, and whether it changed an output.
fn send(
    opened: &mut OpenSubject,
    path: Path,
    index: u32,
    at: u64,
    deadlines: &mut Deadlines,
) -> Result<(u64, bool), Error> {
    let client = &mut opened.client;
    run_to(client, at)?;
    let old = latest_codes(client);
    client.port().world.recorder.discard_trace();
    client.post(setpoint(path, index))?;
    run_to(client, at + 2 * u64::from(PERIOD_US))?;
    let bursts = bursts(client);
    let (arrived, epoch) = (opened.arrived_us(at), opened.epoch_us());
    let phase = (arrived - epoch) % TICK_US;
    let mut is_seen = false;
    for (channel, start, code) in bursts {
        let is_new = old[usize::from(channel)] != Some(code);
        is_seen |= is_new;
        if start > arrived {
            deadlines.add_burst(phase, start - (arrived - phase), is_new);
        }
    }
    Ok((arrived, is_seen))
}

/// Returns the amplitude code of the latest burst on each channel; `None` for a channel without
/// bursts.
fn latest_codes(client: &mut Connection<SimulatedPort>) -> [Option<u16>; CHANNELS] {
    let mut codes = [None; CHANNELS];
    for (channel, _, code) in bursts(client) {
        codes[usize::from(channel)] = Some(code);
    }
    codes
}

/// Returns channel, start and amplitude code of every recorded burst.
fn bursts(client: &mut Connection<SimulatedPort>) -> Vec<(u8, u64, u16)> {
    let trace = &client.port().world.recorder.trace;
    let starts = trace.edges().filter(|edge| edge.state == State::Cathodic);
    starts
        .map(|edge| (edge.channel, edge.t_us, edge.dac_code))
        .collect()
}

/// Returns the setpoint for `index`: a high one for even numbers and a low one for odd numbers, so
/// that each setpoint changes the output clearly.
fn setpoint(path: Path, index: u32) -> Request {
    let high = index.is_multiple_of(2);
    match path {
        Path::Direct => {
            let value = Amplitude::new(if high { 15_000 } else { 10_000 });
            Request::Amplitudes {
                at: None,
                mask: 0x3FF,
                values: [value; CHANNELS].into_iter().collect(),
                widths: Default::default(),
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

fn run_to(client: &mut Connection<SimulatedPort>, until_us: u64) -> Result<(), Error> {
    while let Some(incoming) = client.next(until_us)? {
        if let Incoming::Refused(_, refused) = incoming {
            return Err(Error::Refused(refused));
        }
    }
    Ok(())
}

fn prepare(subject: Subject<'_>, path: Path, shift_us: u64) -> Result<OpenSubject, OpenError> {
    // A joint that rests in the middle of its range, measured by the board's converter.
    let mut opened = subject.open(Box::new(FixedLoad::new(50.0)), shift_us)?;
    let client = &mut opened.client;
    client.port().world.connect_joint(40.0, 48.0);
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
    run_to(client, now + 30_000)?;
    Ok(opened)
}

/// Returns a proportional controller without memory: the setpoint alone decides the amplitude.
fn joint() -> JointSpec {
    let point = |channel| PointSpec {
        channel,
        threshold: Amplitude::new(5_000),
        max: Amplitude::new(20_000),
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
        wearer: None,
        response: None,
    }
}
