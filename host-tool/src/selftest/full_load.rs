//! A long session at full load: setpoints and telemetry at 1 kHz, ten channels at 200 Hz, and an
//! occasional over-current within a pulse. Nothing may be lost or missed, and all net charge must
//! be in the faults' records.

use super::{channel, open};
use firmware::link::{Event, Request};
use firmware::pulse::CHANNELS;
use firmware::safety::{Fault, WearerSpec};
use firmware::units::Amplitude;
use hal_sim::random::Random;
use hal_sim::trace::{Edge, State};
use hal_sim::wire::faults::Faults;
use host_core::link::{Connection, Error, Incoming, SimulatedPort};
use std::collections::{HashMap, VecDeque};

/// Time between setpoints and between telemetry samples, µs.
const TICK_US: u64 = 1_000;

/// Time between pulses of a channel, µs (200 Hz); the channels take turns.
const PERIOD_US: u32 = 5_000;

/// Mean time between two over-currents that are injected, µs.
const BETWEEN_FAULTS_US: u64 = 60_000_000;

/// Time after the first setpoint from which on all amplitudes have completed their rise, µs.
const RISEN_US: u64 = 100_000;

/// Time after a setpoint within which pulses may still have the previous amplitude, µs. `latency`
/// measures 0.6 ms.
const LATE_US: u64 = 1_000;

/// Time after which every answer to a message has arrived, µs.
const SETTLED_US: u64 = 50_000;

/// Result of a session at full load. The session passes ([`Self::holds`]) if all counts except
/// those of sent setpoints, samples, pulses and truncations are 0, and `net` equals `recorded`.
#[derive(Clone, Debug, Default)]
pub struct FullLoad {
    /// Simulated time, s.
    pub seconds: u64,
    /// Number of setpoints sent.
    pub setpoints: u64,
    /// Number of setpoints that were not acknowledged.
    pub unacknowledged: u64,
    /// Number of telemetry samples.
    pub samples: u64,
    /// Number of samples that did not follow the previous one by 1 ms.
    pub sample_gaps: u64,
    /// Number of pulses begun, electrode checks included.
    pub pulses: u64,
    /// Number of pulses that did not begin exactly 5 ms after the previous one.
    pub misplaced: u64,
    /// Number of pulses whose amplitude no setpoint of the last millisecond asked for.
    pub unasked: u64,
    /// Number of injected over-currents, each of which truncated the pulse that was playing.
    pub truncations: u64,
    /// Number of faults that were not injected, such as a missed deadline or a shifted tape.
    pub faults: u64,
    /// Number of stops that nobody ordered.
    pub stops: u64,
    /// Number of frames that the device counts as lost, bad, refused, dropped or from strangers.
    pub counted: u64,
    /// Net charge of each channel at the outputs, code·µs (amplitude code times time), anodic
    /// positive.
    pub net: [i64; CHANNELS],
    /// Net charge of each channel in the device's fault records, code·µs, anodic positive. Only a
    /// truncated pulse leaves a net charge, so this must equal `net`.
    pub recorded: [i64; CHANNELS],
}

impl FullLoad {
    /// Returns whether nothing was lost, missed or unasked for, and all charge is accounted for.
    #[must_use]
    pub fn holds(&self) -> bool {
        let broken = [
            self.unacknowledged,
            self.sample_gaps,
            self.misplaced,
            self.unasked,
            self.faults,
            self.stops,
            self.counted,
        ];
        broken == [0; 7] && self.net == self.recorded
    }
}

/// Runs `seconds` at full load, from 60 s before the device's clock wraps. `progress` receives the
/// finished part.
///
/// # Errors
/// Fails if the simulated device refuses.
pub fn full_load(
    seconds: u64,
    seed: u64,
    mut progress: impl FnMut(f64),
) -> Result<FullLoad, Error> {
    let mut client = open(Faults::default(), seed)?;
    client.wearer(WearerSpec {
        rise_ms: 10,
        ..WearerSpec::default()
    })?;
    for index in 0..CHANNELS as u8 {
        let offset_us = PERIOD_US / CHANNELS as u32 * u32::from(index);
        client.channel(index, channel(PERIOD_US, offset_us))?;
    }
    client.request(Request::Subscribe { period_ms: 1 })?;
    let mut load = Load::new(client, seed);
    let begin = load.now_us();
    let end = begin + seconds * 1_000_000;
    while load.now_us() < end {
        let pause_us = BETWEEN_FAULTS_US / 2 + load.random.below(BETWEEN_FAULTS_US);
        let until = load.now_us() + pause_us;
        load.stimulate(until.min(end), |now| {
            progress((now - begin) as f64 / (end - begin) as f64);
        })?;
        if until < end {
            load.trip_over_current()?;
        }
    }
    load.finish(seconds)
}

/// A full-load session in progress.
struct Load {
    client: Connection<SimulatedPort>,
    random: Random,
    found: FullLoad,
    /// Amplitude codes of the setpoints that the device has not answered yet, by request number.
    asked: HashMap<u16, [u16; CHANNELS]>,
    /// Accepted setpoints: time of acceptance, µs, and amplitude codes of all channels.
    accepted: VecDeque<(u64, [u16; CHANNELS])>,
    /// Time of the last sample, µs; the next must follow 1 ms later. `None` before the first.
    sampled: Option<u64>,
    /// Time from which pulses must have the requested amplitude, µs.
    risen_us: u64,
    /// Time at which the host stops the device, µs. From then on amplitudes fall, and pulses are
    /// not compared.
    falls_us: u64,
    /// Whether an over-current was injected whose fault the device has not reported yet.
    tripped: bool,
    /// Whether the host has asked for the stop, so that a stop is no error.
    is_ending: bool,
    outputs: Outputs,
}

impl Load {
    fn new(client: Connection<SimulatedPort>, seed: u64) -> Self {
        Self {
            client,
            random: Random::new(seed),
            found: FullLoad::default(),
            asked: HashMap::new(),
            accepted: VecDeque::new(),
            sampled: None,
            risen_us: 0,
            falls_us: u64::MAX,
            tripped: false,
            is_ending: false,
            outputs: Outputs::default(),
        }
    }

    fn now_us(&mut self) -> u64 {
        self.client.port().world.now_us()
    }

    /// Arms and starts the device, then sends a setpoint every millisecond until `until_us`.
    fn stimulate(&mut self, until_us: u64, mut progress: impl FnMut(u64)) -> Result<(), Error> {
        self.client.arm()?;
        self.client.start()?;
        let mut now = self.now_us();
        self.risen_us = now + RISEN_US;
        let mut ticks = 0_u32;
        while now < until_us {
            self.send()?;
            now += TICK_US;
            self.receive_until(now)?;
            ticks += 1;
            if ticks.is_multiple_of(1_000) {
                self.judge();
                progress(now);
            }
        }
        Ok(())
    }

    /// Sends one setpoint with random amplitudes of 5 to 15 mA for all channels.
    fn send(&mut self) -> Result<(), Error> {
        let mut draw = || 5_000 + self.random.below(10_000) as u32;
        let values: [u32; CHANNELS] = std::array::from_fn(|_| draw());
        let request = Request::Amplitudes {
            at: None,
            mask: (1 << CHANNELS) - 1,
            values: values.into_iter().map(Amplitude::new).collect(),
            widths: Default::default(),
        };
        // 100 mA is code 65 535; rounded down.
        let codes = values.map(|ua| (u64::from(ua) * 65_535 / 100_000) as u16);
        let seq = self.client.post(request)?;
        self.asked.insert(seq, codes);
        self.found.setpoints += 1;
        Ok(())
    }

    /// Handles everything that arrives until `until_us`.
    fn receive_until(&mut self, until_us: u64) -> Result<(), Error> {
        while let Some(incoming) = self.client.next(until_us)? {
            match incoming {
                Incoming::Acknowledged(seq, at) => {
                    let codes = self.asked.remove(&seq);
                    self.accepted.extend(codes.map(|codes| (at, codes)));
                }
                Incoming::Telemetry(at_us, _) => {
                    let is_due = self.sampled.is_none_or(|last| last + 1_000 == at_us);
                    self.found.samples += 1;
                    self.found.sample_gaps += u64::from(!is_due);
                    self.sampled = Some(at_us);
                }
                Incoming::Event(
                    _,
                    Event::Electrode { .. }
                    | Event::Recovered
                    | Event::TriggerEdge
                    | Event::SyncEdge,
                ) => {}
                Incoming::Event(_, Event::Faulted(record)) => {
                    let is_ours = self.tripped && record.fault == Fault::OverCurrent;
                    self.tripped &= !is_ours;
                    self.found.faults += u64::from(!is_ours);
                    for (sum, left) in self.found.recorded.iter_mut().zip(record.residual) {
                        *sum += i64::from(left);
                    }
                }
                Incoming::Event(..) => self.found.stops += u64::from(!self.is_ending),
                // The device counts these, too.
                Incoming::Hello(_) | Incoming::Refused(..) | Incoming::Status(..) => {}
            }
        }
        Ok(())
    }

    /// Injects an over-current at a random moment within 5 ms, checks that the device reports the
    /// fault, and acknowledges the fault.
    fn trip_over_current(&mut self) -> Result<(), Error> {
        let at = self.now_us() + self.random.below(PERIOD_US.into());
        self.receive_until(at)?;
        // Earlier messages are answered before the fault, or refused after it.
        self.receive_until(at + SETTLED_US)?;
        self.send()?;
        let at = self.now_us() + 2 * TICK_US + self.random.below(PERIOD_US.into());
        self.receive_until(at)?;
        self.tripped = true;
        self.client.port().world.sensors.over_current = true;
        self.receive_until(at + 1)?;
        self.client.port().world.sensors.over_current = false;
        self.receive_until(at + SETTLED_US)?;
        self.judge();
        self.found.truncations += 1;
        self.found.faults += u64::from(self.tripped); // the fault was not reported
        self.tripped = false;
        self.outputs.forget_pulse_starts();
        self.client.acknowledge()?;
        let grounded = self.now_us() + 150_000;
        self.receive_until(grounded)
    }

    /// Takes the edges from the recorder, and judges those that are at least [`SETTLED_US`] old,
    /// for which every answer of the device has arrived.
    fn judge(&mut self) {
        let recorder = &mut self.client.port().world.recorder;
        self.outputs.pending.extend(recorder.trace.edges());
        recorder.discard_trace();
        let settled = self.now_us() - SETTLED_US;
        while let Some(edge) = self
            .outputs
            .pending
            .pop_front_if(|edge| edge.t_us <= settled)
        {
            let Some(began) = self.outputs.add_edge(edge, &mut self.found) else {
                continue;
            };
            if !(self.risen_us..self.falls_us).contains(&edge.t_us) {
                continue;
            }
            self.found.misplaced += u64::from(began != Some(edge.t_us - u64::from(PERIOD_US)));
            let late = |at: u64| at + LATE_US < edge.t_us;
            // The newest of the late setpoints may still be in force.
            while self.accepted.get(1).is_some_and(|next| late(next.0)) {
                self.accepted.pop_front();
            }
            let index = usize::from(edge.channel);
            let mut asked = self.accepted.iter().take_while(|pair| pair.0 <= edge.t_us);
            let is_asked = asked.any(|(_, codes)| codes[index] == edge.dac_code);
            self.found.unasked += u64::from(!is_asked);
        }
    }

    fn finish(mut self, seconds: u64) -> Result<FullLoad, Error> {
        self.is_ending = true;
        self.falls_us = self.now_us();
        self.client.stop()?;
        let end = self.now_us() + 4 * SETTLED_US;
        self.receive_until(end)?;
        self.judge();
        let counters = self.client.status()?.counters;
        let counted = [
            counters.bad_frames,
            counters.lost_frames,
            counters.refused,
            counters.dropped,
            counters.lost_posts,
            counters.unknown_sessions,
        ];
        self.found.counted = counted.into_iter().map(u64::from).sum();
        self.found.unacknowledged = self.asked.len() as u64;
        self.found.seconds = seconds;
        Ok(self.found)
    }
}

/// Edges that are not judged yet, and the state of each channel after the judged edges.
#[derive(Default)]
struct Outputs {
    pending: VecDeque<Edge>,
    /// For each channel: its state, the time since which it has that state, µs, and the amplitude
    /// code at that time; `None` before the first edge.
    now: [Option<(State, u64, u16)>; CHANNELS],
    /// For each channel: start of the last pulse, µs; `None` if the next pulse has no previous one
    /// to compare with.
    began: [Option<u64>; CHANNELS],
}

impl Outputs {
    /// Processes an edge. If the edge begins a pulse, returns the start of the channel's previous
    /// pulse, µs, if there was one.
    fn add_edge(&mut self, edge: Edge, found: &mut FullLoad) -> Option<Option<u64>> {
        let index = usize::from(edge.channel);
        let before = self.now[index];
        if before.is_some_and(|(state, _, _)| state == edge.state) {
            return None; // the state is unchanged
        }
        if let Some((state, since, code)) = before {
            let charge = (edge.t_us - since) as i64 * i64::from(code);
            found.net[index] += match state {
                State::Anodic => charge,
                State::Cathodic => -charge,
                State::Isolated | State::Grounded => 0,
            };
        }
        self.now[index] = Some((edge.state, edge.t_us, edge.dac_code));
        (edge.state == State::Cathodic).then(|| {
            found.pulses += 1;
            self.began[index].replace(edge.t_us)
        })
    }

    /// Forgets the previous pulses, so that the next one is not compared with them.
    fn forget_pulse_starts(&mut self) {
        self.began = [None; CHANNELS];
    }
}
