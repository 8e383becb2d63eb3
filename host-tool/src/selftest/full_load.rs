//! A long session at full load: setpoints and telemetry at 1 kHz, ten channels at 200 Hz,
//! and now and then an over-current within a pulse. Nothing lost, nothing missed, and no
//! charge but what the faults' records tell.

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

/// Setpoints and telemetry come every millisecond.
const TICK_US: u64 = 1_000;

/// 200 Hz; one channel after the other.
const PERIOD_US: u32 = 5_000;

/// So often, about, a comparator trips, µs.
const BETWEEN_FAULTS_US: u64 = 60_000_000;

/// Ramps are over this long after the first setpoint, µs.
const RISEN_US: u64 = 100_000;

/// From a setpoint to the last pulse that may still not have it, µs: `latency` measures
/// 0.6 ms.
const LATE_US: u64 = 1_000;

/// What was waited for has come this long after it was sent, µs.
const SETTLED_US: u64 = 50_000;

/// What a session at full load came to. All counts but those of what was sent, played and
/// truncated must be 0, and `net` must be `recorded`.
#[derive(Clone, Debug, Default)]
pub struct FullLoad {
    /// Simulated time, s.
    pub seconds: u64,
    /// Setpoints sent.
    pub setpoints: u64,
    /// Those that were not acknowledged.
    pub unacknowledged: u64,
    /// Samples of telemetry.
    pub samples: u64,
    /// Samples that did not come a millisecond after the one before.
    pub sample_gaps: u64,
    /// Pulses begun, electrode checks included.
    pub pulses: u64,
    /// Pulses that did not begin 5 ms after the one before, to the microsecond.
    pub misplaced: u64,
    /// Pulses whose amplitude no setpoint of the last millisecond asked for.
    pub unasked: u64,
    /// Over-currents that were put in, each of which truncated what was playing.
    pub truncations: u64,
    /// Faults that nobody put in: a missed deadline, a tape that slipped, any other.
    pub faults: u64,
    /// Stops that nobody ordered.
    pub stops: u64,
    /// What the device counts as lost, bad, refused, dropped or strange.
    pub counted: u64,
    /// Net charge that came out, code·µs, anodic positive.
    pub net: [i64; CHANNELS],
    /// What the faults' records tell of it.
    pub recorded: [i64; CHANNELS],
}

impl FullLoad {
    /// Whether nothing was lost, missed or unasked for, and all charge is accounted for.
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

/// Runs `seconds` of it from 60 s before the device's clock wraps. `progress` hears the
/// part done.
///
/// # Errors
/// The simulated device refused.
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

/// A session under way.
struct Load {
    client: Connection<SimulatedPort>,
    random: Random,
    found: FullLoad,
    /// What was asked and not answered yet.
    asked: HashMap<u16, [u16; CHANNELS]>,
    /// When what was accepted, in codes.
    accepted: VecDeque<(u64, [u16; CHANNELS])>,
    /// Of the last sample, and whether another must follow a millisecond later.
    sampled: Option<u64>,
    /// From when on pulses must be as asked.
    risen_us: u64,
    /// From when on they need not, because they fall.
    falls_us: u64,
    /// Whether a fault is expected.
    tripped: bool,
    /// Whether a stop is expected.
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

    /// Arms, starts, and streams setpoints until then.
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

    /// Random amplitudes of 5 to 15 mA for all channels.
    fn send(&mut self) -> Result<(), Error> {
        let mut draw = || 5_000 + self.random.below(10_000) as u32;
        let values: [u32; CHANNELS] = std::array::from_fn(|_| draw());
        let request = Request::Amplitudes {
            at: None,
            mask: (1 << CHANNELS) - 1,
            values: values.into_iter().map(Amplitude::new).collect(),
            widths: Default::default(),
        };
        // 100 mA at code 65 535, rounded down.
        let codes = values.map(|ua| (u64::from(ua) * 65_535 / 100_000) as u16);
        let seq = self.client.post(request)?;
        self.asked.insert(seq, codes);
        self.found.setpoints += 1;
        Ok(())
    }

    /// Takes what comes until then.
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
                // Counted by the device, too.
                Incoming::Hello(_) | Incoming::Refused(..) | Incoming::Status(..) => {}
            }
        }
        Ok(())
    }

    /// Within the next pulse, or the gap after it, a comparator trips; then the fault is
    /// acknowledged.
    fn trip_over_current(&mut self) -> Result<(), Error> {
        let at = self.now_us() + self.random.below(PERIOD_US.into());
        self.receive_until(at)?;
        // What was sent is answered before the fault, or refused after it.
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
        self.found.faults += u64::from(self.tripped); // it was not told
        self.tripped = false;
        self.outputs.forget_pulse_starts();
        self.client.acknowledge()?;
        let grounded = self.now_us() + 150_000;
        self.receive_until(grounded)
    }

    /// Takes the outputs so far from the recorder, and judges what is settled.
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
            // The newest of those that are late may still be in force.
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
            counters.lost,
            counters.refused,
            counters.dropped,
            counters.lost_posts,
            counters.strangers,
        ];
        self.found.counted = counted.into_iter().map(u64::from).sum();
        self.found.unacknowledged = self.asked.len() as u64;
        self.found.seconds = seconds;
        Ok(self.found)
    }
}

/// What came out, edge by edge.
#[derive(Default)]
struct Outputs {
    pending: VecDeque<Edge>,
    /// Of each channel: how it stands, since when, and the code then.
    now: [Option<(State, u64, u16)>; CHANNELS],
    /// When the last pulse began.
    began: [Option<u64>; CHANNELS],
}

impl Outputs {
    /// Takes an edge in. Of one that begins a pulse: when the one before began.
    fn add_edge(&mut self, edge: Edge, found: &mut FullLoad) -> Option<Option<u64>> {
        let index = usize::from(edge.channel);
        let before = self.now[index];
        if before.is_some_and(|(state, _, _)| state == edge.state) {
            return None; // known already
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

    /// Whatever comes next begins anew.
    fn forget_pulse_starts(&mut self) {
        self.began = [None; CHANNELS];
    }
}
