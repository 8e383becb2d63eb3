//! Simulated world: a device, a wearer and a wire in one virtual time.
//!
//! In: bytes from a host and the time to advance to. Out: bytes for the host, the trace of
//! everything that the device emitted, and the wearer's motion.

use crate::body::{Body, BrokenSensor, CHANNELS, Lead, Load, Pulse};
use crate::lockstep::{Device, Output};
use crate::trace::{Levels, State, Trace, Unwrap};
use crate::wire::faults::{Faults, FaultyLine};
use firmware::link::{Decoder, Request, ToDevice, encode};
use firmware::lockstep::{Sensors, Sink, cost};
use firmware::units::{DacCode, Micros};
use std::collections::VecDeque;

/// Step of the world, µs: one control tick.
const STEP_US: u64 = 1000;

/// Everything that a device emitted, with times that do not wrap.
#[derive(Clone, Debug, Default)]
pub struct Recorder {
    /// Output levels and DAC writes.
    pub trace: Trace,
    /// Bytes for the host with their times, µs.
    pub bytes: VecDeque<(u64, Vec<u8>)>,
    level_time: Unwrap,
    dac_time: Unwrap,
    byte_time: Unwrap,
    levels: Levels,
    codes: [u16; CHANNELS],
    cathodic_since: [u64; CHANNELS],
    pulses: Vec<(u64, usize, u16, u32)>,
    leads: Vec<(u64, usize, u16, State)>,
}

impl Recorder {
    fn new(boot: Micros) -> Self {
        let mut recorder = Self::default();
        for time in [
            &mut recorder.level_time,
            &mut recorder.dac_time,
            &mut recorder.byte_time,
        ] {
            time.unwrap_time(boot.get());
        }
        recorder
    }
}

impl Recorder {
    /// Discards the recorded levels and DAC writes, for runs without an end.
    pub fn discard_trace(&mut self) {
        self.trace.dac.clear();
        for (channel, code) in (0u8..).zip(self.codes) {
            self.trace
                .record_dac(self.trace.levels.last().map_or(0, |l| l.0), channel, code);
        }
        // The last levels stay, because only changes from them are recorded.
        let last = self.trace.levels.len().saturating_sub(1);
        self.trace.levels.drain(..last);
    }

    /// Sets the device time to the lower 32 bits of `now_us`. The world calls this after each step:
    /// without it, output after 36 silent minutes would get the time of one wrap earlier.
    fn set_time(&mut self, now_us: u64) {
        for time in [
            &mut self.level_time,
            &mut self.dac_time,
            &mut self.byte_time,
        ] {
            time.unwrap_time(now_us as u32);
        }
    }
}

impl Sink for Recorder {
    fn write_levels(&mut self, at: Micros, levels: firmware::pulse::Levels) {
        let t = self.level_time.unwrap_time(at.get());
        let (before, now) = (self.levels, Levels(levels.0));
        self.levels = now;
        self.trace.record_levels(t, now);
        for channel in now.changed_channels(before) {
            let index = usize::from(channel);
            let lead = (t, index, self.codes[index], now.state(channel));
            self.leads.push(lead);
            // The cathodic phase is the one that excites the muscle.
            if now.state(channel) == State::Cathodic {
                self.cathodic_since[index] = t;
            } else if before.state(channel) == State::Cathodic {
                let start = self.cathodic_since[index];
                self.pulses
                    .push((start, index, self.codes[index], (t - start) as u32));
            }
        }
    }

    fn write_dac(&mut self, at: Micros, channel: u8, code: DacCode) {
        let t = self.dac_time.unwrap_time(at.get());
        self.codes[usize::from(channel)] = code.get();
        self.trace.record_dac(t, channel, code.get());
    }

    fn write_trip(&mut self, at: Micros, bank: u8, code: DacCode) {
        let t = self.dac_time.unwrap_time(at.get());
        self.trace.record_trip(t, bank, code.get());
    }

    fn write_bytes(&mut self, at: Micros, bytes: &[u8]) {
        let t = self.byte_time.unwrap_time(at.get());
        self.bytes.push_back((t, bytes.to_vec()));
    }
}

/// A device and its wearer, coupled in virtual time.
///
/// ```
/// use firmware::link::{BROADCAST, Request, SCHEMA, ToDevice, encode};
/// use firmware::units::Micros;
/// use hal_sim::body::FixedLoad;
/// use hal_sim::native::native;
/// use hal_sim::wire::faults::Faults;
/// use hal_sim::world::World;
///
/// let boot = Micros::new(0);
/// let body = Box::new(FixedLoad::new(0.0));
/// let mut world = World::new(Box::new(native(boot)), body, boot, Faults::default(), 1);
/// let request = Request::Hello { schema: SCHEMA };
/// world.send(&encode(&ToDevice { session: BROADCAST, seq: 0, request }).unwrap());
/// world.run_until(10_000)?; // 10 ms of virtual time
/// assert!(world.received().count() > 0); // the device has answered
/// # Ok::<(), std::io::Error>(())
/// ```
pub struct World {
    device: Box<dyn Device>,
    /// Simulated limb of the wearer.
    pub body: Box<dyn Body>,
    /// Recorder of the device's output.
    pub recorder: Recorder,
    /// Inputs of the board. The joint angle and the electrode loads come from the body.
    pub sensors: Sensors,
    /// Wire from the host to the device.
    pub wire: FaultyLine,
    /// Output configuration by channel, used if the device cannot report its own.
    pub outputs: [Option<Output>; CHANNELS],
    /// Angle sensor: ADC counts per degree and at 0°; `None` if no sensor is connected.
    joint_adc: Option<(f64, f64)>,
    /// Defect of the angle sensor, if it is broken.
    pub broken_joint: Option<BrokenSensor>,
    /// Whether the sensor was read since the body last moved.
    is_sensed: bool,
    /// Pending edges of the trigger input: time of the rising edge, and time for which the input is
    /// then held, both µs.
    triggers: VecDeque<(u64, u64)>,
    /// Time at which the trigger input is released, µs, while it is held.
    release_us: Option<u64>,
    now_us: u64,
    /// Whether the device has served a trial before.
    is_used: bool,
    /// Electrode loads that were last passed to the device.
    loads: [Load; CHANNELS],
}

impl World {
    /// Creates a world that begins at `boot`, when `device` boots. The wire has `faults`, which
    /// depend on `seed`.
    pub fn new(
        device: Box<dyn Device>,
        body: Box<dyn Body>,
        boot: Micros,
        faults: Faults,
        seed: u64,
    ) -> Self {
        Self {
            device,
            body,
            recorder: Recorder::new(boot),
            sensors: Sensors::default(),
            wire: FaultyLine::new(faults, seed),
            outputs: [None; CHANNELS],
            joint_adc: None,
            broken_joint: None,
            is_sensed: false,
            triggers: VecDeque::new(),
            release_us: None,
            now_us: boot.get().into(),
            is_used: false,
            // differs from the loads of every body, so that the first update sends them
            loads: [Load::Ohms(f64::NAN); CHANNELS],
        }
    }

    /// Copies the world around `device`, which must be a fork of this world's device. Returns
    /// `None` if the wearer cannot be copied.
    #[must_use]
    pub fn fork(&self, device: Box<dyn Device>) -> Option<Self> {
        Some(Self {
            device,
            body: self.body.fork()?,
            recorder: self.recorder.clone(),
            sensors: self.sensors,
            wire: self.wire.clone(),
            outputs: self.outputs,
            joint_adc: self.joint_adc,
            broken_joint: self.broken_joint.clone(),
            is_sensed: self.is_sensed,
            triggers: self.triggers.clone(),
            release_us: self.release_us,
            now_us: self.now_us,
            is_used: self.is_used,
            loads: self.loads,
        })
    }

    /// Copies the world; the copy advances independently. Returns `None` if the device or the
    /// wearer cannot be copied.
    #[must_use]
    pub fn snapshot(&self) -> Option<Self> {
        self.fork(self.device.fork()?)
    }

    /// Returns the virtual time, µs; device time is its lower 32 bits.
    #[must_use]
    pub const fn now_us(&self) -> u64 {
        self.now_us
    }

    /// Schedules an edge on the trigger input at `at_us`, or now if that time is past. Of several
    /// edges within a refill of 250 µs the device sees only the last one, because its timer has one
    /// capture register.
    pub fn trigger(&mut self, at_us: u64) {
        self.hold_trigger(at_us, 0);
    }

    /// Schedules an edge like [`Self::trigger`] and holds the input for `held_us`, during which no
    /// other edge may come.
    pub fn hold_trigger(&mut self, at_us: u64, held_us: u64) {
        let at_us = at_us.max(self.now_us);
        if let Err(place) = self.triggers.binary_search_by_key(&at_us, |edge| edge.0) {
            self.triggers.insert(place, (at_us, held_us));
        }
    }

    /// Connects an angle sensor that reads `per_degree` ADC counts per degree and `zero` at 0°.
    pub const fn connect_joint(&mut self, per_degree: f64, zero: f64) {
        self.joint_adc = Some((per_degree, zero));
        self.is_sensed = false;
    }

    /// Sends one frame from the host to the device now.
    pub fn send(&mut self, frame: &[u8]) {
        self.wire.push(self.now_us, frame);
    }

    /// Advances the world to `to_us`.
    ///
    /// # Errors
    /// Fails if the device cannot be reached any more.
    pub fn run_until(&mut self, to_us: u64) -> std::io::Result<()> {
        self.update_loads();
        while self.now_us < to_us {
            let mut step = to_us.min((self.now_us / STEP_US + 1) * STEP_US);
            // A step contains at most one edge: a second edge begins the next step.
            if let Some(&(second, _)) = self.triggers.get(1) {
                step = step.min(second.max(self.now_us + 1));
            }
            step = self.release_trigger(step);
            // A device that processes bytes may be ahead by the time that the processing takes.
            let ahead = step + u64::from(cost::SESSION_US);
            if let Some(&(at, held_us)) = self.triggers.front().filter(|edge| edge.0 < ahead) {
                self.sensors.trigger = Some(Micros::new(at as u32));
                self.sensors.held = held_us != 0;
            }
            self.triggers.pop_front_if(|edge| edge.0 < step);
            self.update_joint_sensor();
            let mut is_asked = false;
            while let Some((at, mut bytes)) = self.wire.pop_until(step - 1).next() {
                is_asked |= replace_trigger(&mut bytes);
                let at = Micros::new(at.max(self.now_us) as u32);
                self.device
                    .receive(at, &bytes, &self.sensors, &mut self.recorder)?;
            }
            if is_asked {
                // This is the first time that no device has passed yet.
                self.trigger(ahead);
            }
            self.device
                .advance(Micros::new(step as u32), &self.sensors, &mut self.recorder)?;
            self.sensors.trigger = None;
            self.sensors.held = self.release_us.is_some();
            self.now_us = step;
            self.recorder.set_time(step);
            self.excite();
            self.is_sensed &= !self.body.advance(step);
        }
        Ok(())
    }

    /// Releases the trigger input if its release is due. Returns the end of the next step: `to_us`,
    /// or the time of the next release if that is earlier. The release after an edge within the
    /// step counts too.
    fn release_trigger(&mut self, to_us: u64) -> u64 {
        if self.release_us.take_if(|at| *at <= self.now_us).is_some() {
            self.sensors.held = false;
        }
        let edge = self.triggers.front();
        if self.release_us.is_none()
            && let Some((at, held_us)) = edge.filter(|edge| edge.0 < to_us && edge.1 != 0)
        {
            self.release_us = Some(at + held_us);
        }
        self.release_us.map_or(to_us, |at| to_us.min(at))
    }

    /// Prepares the same device and wearer for another trial: discards the recorded output and
    /// keeps the wearer's state.
    pub fn begin_trial(&mut self) {
        self.is_used = true;
        self.recorder.discard_trace();
        self.body.begin_trial();
    }

    /// Returns whether the device has served a trial before, so that its counters are not zero.
    #[must_use]
    pub const fn is_used(&self) -> bool {
        self.is_used
    }

    /// Advances by `for_us` without messages from a host, and discards the bytes that the device
    /// sends.
    ///
    /// # Errors
    /// Fails if the device cannot be reached any more.
    pub fn run_silently(&mut self, for_us: u64) -> std::io::Result<()> {
        self.run_until(self.now_us.saturating_add(for_us))?;
        self.recorder.bytes.clear();
        Ok(())
    }

    /// Returns whether bytes have arrived at the host that it has not taken yet.
    #[must_use]
    pub fn has_received(&self) -> bool {
        self.recorder
            .bytes
            .front()
            .is_some_and(|(t, _)| *t <= self.now_us)
    }

    /// Takes the bytes that have arrived at the host.
    pub fn received(&mut self) -> impl Iterator<Item = Vec<u8>> {
        std::iter::from_fn(|| {
            let ready = self.has_received();
            self.recorder
                .bytes
                .pop_front_if(|_| ready)
                .map(|(_, bytes)| bytes)
        })
    }

    /// Updates the ADC reading of the joint sensor, if the body has moved or the sensor is broken.
    fn update_joint_sensor(&mut self) {
        // The reading of a broken sensor changes even if nothing moves.
        let is_known = self.is_sensed && self.broken_joint.is_none();
        if let Some((per_degree, zero)) = self.joint_adc.filter(|_| !is_known) {
            let (now_us, mut deg) = (self.now_us, self.body.sensed_deg());
            if let Some(broken) = &mut self.broken_joint {
                deg = broken.read(now_us, deg);
            }
            let code = (zero + per_degree * deg).round();
            self.sensors.joint = Some(code.clamp(0.0, 4095.0) as u16);
            self.is_sensed = true;
        }
    }

    /// Updates the loads on the device's output stages from the body's electrodes. They do not
    /// change while time advances.
    fn update_loads(&mut self) {
        if self.loads != *self.body.loads() {
            self.loads = *self.body.loads();
            self.sensors.load_ohm = self.loads.map(|load| match load {
                Load::Ohms(ohm) => ohm as u32,
                Load::Open => u32::MAX,
            });
        }
    }

    fn excite(&mut self) {
        for (t_us, channel, code, state) in self.recorder.leads.drain(..) {
            let drive = self.device.output(channel).or(self.outputs[channel]);
            let drive = drive.map(|output| output.drives(code));
            let lead = match (state, drive) {
                (State::Cathodic, Some(drive)) => Lead::Cathodic(drive),
                (State::Anodic, Some(drive)) => Lead::Anodic(drive),
                (State::Grounded, _) => Lead::Grounded,
                (State::Isolated, _) | (_, None) => Lead::Floating,
            };
            self.body.set_lead(t_us, channel, lead);
        }
        for (t_us, channel, code, width_us) in self.recorder.pulses.drain(..) {
            let Some(output) = self.device.output(channel).or(self.outputs[channel]) else {
                continue;
            };
            self.body.pulse(&Pulse {
                t_us,
                channel,
                drive: output.drives(code),
                width_us,
                conducted: output.conducted,
            });
        }
    }
}

/// Maximum length of a frame with a [`Request::SimulateTrigger`], bytes.
const TRIGGER_FRAME: usize = 16;

/// Returns whether `bytes` contain a simulated trigger, and replaces that request with a keep-alive
/// of the same sequence number. The device answers the keep-alive as usual, and the edge comes from
/// the world.
fn replace_trigger(bytes: &mut [u8]) -> bool {
    let mut is_there = false;
    for frame in bytes.split_inclusive_mut(|&byte| byte == 0) {
        if let Some(alive) = keepalive_for_trigger(frame) {
            frame.copy_from_slice(&alive);
            is_there = true;
        }
    }
    is_there
}

/// Returns the keep-alive that replaces `frame`, if the frame is a simulated trigger.
fn keepalive_for_trigger(frame: &[u8]) -> Option<Vec<u8>> {
    if frame.len() > TRIGGER_FRAME {
        return None;
    }
    let mut decoder = Decoder::default();
    let read = |byte: &u8| Some(decoder.push(*byte)?.ok()?.to_vec());
    let message = frame.iter().find_map(read)?;
    let asked: ToDevice = postcard::from_bytes(&message).ok()?;
    if asked.request != Request::SimulateTrigger {
        return None;
    }
    let alive = encode(&ToDevice {
        request: Request::KeepAlive,
        ..asked
    })?;
    (alive.len() == frame.len()).then(|| alive.to_vec())
}
