//! Measures the latency from a trigger, and from a host's command, to the first edge of a pulse
//! (section 3.2). The train has pulses of 40 µs and goes from 0 to 20 mA every second.

use super::error::RampsError;
use crate::laboratory::{ElectrodeLog, Notes};
use firmware::link::Request;
use firmware::units::Amplitude;
use hal_sim::body::Drive;
use host_core::link::Port;
use host_core::run::{Attachments, DeviceName, RunError, SessionFile, StepLimit, Stepper};

/// Latencies that the paper measured with an oscilloscope, µs (section 4.1).
pub const PAPER_US: [u64; 2] = [1_220, 1_300];
/// Number of repetitions of each measurement.
const TIMES: u64 = 20;
/// Time between repetitions, µs. It changes the phase of every periodic process each time.
const EVERY_US: u64 = 500_787;
/// Pulse rate of the triggered train, Hz.
const TRIGGERED_HZ: u32 = 50;
/// Pulse rate of a running train, Hz, and the current from which it goes to 20 mA, mA.
pub const COMMANDS: [(u32, u32); 3] = [(50, 0), (200, 0), (200, 1)];
/// Current above which the step to 20 mA counts as done, mA.
const GONE_MA: f64 = 10.0;

/// Smallest and largest latency to the first edge in [`TIMES`] repetitions, µs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Latency {
    /// Latency from an edge at the trigger input.
    pub trigger_us: [u64; 2],
    /// Latency from the moment at which the last byte of a setpoint leaves the host to the first
    /// pulse with its current, for each of the [`COMMANDS`].
    pub command_us: [[u64; 2]; 3],
}

/// Returns the text of a session with one channel and this pulse rate. If `is_triggered`, the train
/// starts at an edge of the trigger input.
fn session(rate_hz: u32, is_triggered: bool) -> String {
    let triggered = if is_triggered {
        ", triggered = true, repeats = 10"
    } else {
        ""
    };
    format!(
        "title = \"latency\"\nduration_s = 60.0\n[wearer]\nmax_current_ma = 20.0\nrise_ms = 1\n\
         fall_ms = 50\n[[channel]]\nnumber = 1\nname = \"triceps\"\nlimit = 20.0\nstart = 20.0\n\
         stage = {{ kind = \"current\", full_scale_ma = 100.0 }}\n\
         train = {{ shape = \"biphasic-cathodic-first\", width_us = 40, \
         frequency_hz = {rate_hz}.0{triggered} }}\n\
         [setpoints]\nkind = \"amplitudes\"\nrate_hz = 50\nvalues = [{{ channel = 1, value = 20.0 }}]\n\
         [body]\nkind = \"still\"\nload_ohm = 1000\n"
    )
}

/// Returns the setpoint of this current on channel 1, mA.
fn current_request(ma: u32) -> Request {
    Request::Amplitudes {
        at: None,
        mask: 1,
        values: [Amplitude::new(1_000 * ma)].into_iter().collect(),
        widths: Default::default(), // the train's own
    }
}

/// A running device, and the log of the pulses at its electrodes.
struct OpenDevice {
    stepper: Stepper<'static, Box<dyn Port>>,
    heard: ElectrodeLog,
}

impl OpenDevice {
    fn new(device: &DeviceName, text: &str, ma: u32) -> Result<Self, RampsError> {
        let file = SessionFile::parse("latency.toml", text).map_err(failed)?;
        let mut port = device.open(&file.session, 1)?;
        let heard = ElectrodeLog::default();
        let world = port.world();
        let world = world.ok_or_else(|| failed("the device is not a simulator"))?;
        world.body = Box::new(Notes::new(&heard));
        let stepper = begin(file, port, ma).map_err(failed)?;
        Ok(Self { stepper, heard })
    }

    /// Returns the simulated time, µs.
    fn now_us(&mut self) -> u64 {
        self.stepper.port().now_us()
    }

    /// Requests this current and lets time pass until `until_us`.
    fn hold(&mut self, until_us: u64, ma: u32) -> Result<(), RampsError> {
        let epoch_us = self.now_us() - self.stepper.time_us();
        self.stepper.post(current_request(ma)).map_err(failed)?;
        let stepped = self.stepper.step(StepLimit::Time(until_us - epoch_us));
        stepped.map(drop).map_err(failed)
    }

    /// Returns the time from `from_us` to the next pulse of at least `least_ma`, µs.
    fn to_first(&self, from_us: u64, least_ma: f64) -> Option<u64> {
        let is = |drive| matches!(drive, Drive::Milliamps(ma) if ma >= least_ma);
        let mut later = self
            .heard
            .pulses()
            .into_iter()
            .filter(|pulse| pulse.t_us >= from_us);
        Some(later.find(|pulse| is(pulse.drive))?.t_us - from_us)
    }
}

/// Starts a device with this current, mA.
fn begin(
    file: SessionFile,
    port: Box<dyn Port>,
    ma: u32,
) -> Result<Stepper<'static, Box<dyn Port>>, RunError> {
    let mut stepper =
        Stepper::open_owned(file, port, Attachments::default())?.with_live_setpoints();
    stepper.configure()?;
    stepper.arm()?;
    stepper.request(current_request(ma))?;
    stepper.start()?;
    Ok(stepper)
}

/// Returns the smallest and the largest value, or `None` if one is missing.
fn min_and_max(values: impl IntoIterator<Item = Option<u64>>) -> Option<[u64; 2]> {
    let all: Option<Vec<u64>> = values.into_iter().collect();
    let all = all?;
    Some([all.iter().copied().min()?, all.iter().copied().max()?])
}

/// Measures all latencies on `device`.
///
/// # Errors
/// Fails if the device cannot be opened. Returns E692 if it does not play the session.
pub fn latency(device: &DeviceName) -> Result<Latency, RampsError> {
    let [first, second, third] = COMMANDS;
    Ok(Latency {
        trigger_us: trigger_latency(device)?,
        command_us: [
            command_latency(device, first)?,
            command_latency(device, second)?,
            command_latency(device, third)?,
        ],
    })
}

fn failed(why: impl ToString) -> RampsError {
    RampsError::Device("latency".to_owned(), why.to_string())
}

fn silent() -> RampsError {
    failed("no pulse followed within 250 ms")
}

/// Measures the latency from an edge at the trigger input to the first edge of the train.
fn trigger_latency(device: &DeviceName) -> Result<[u64; 2], RampsError> {
    let mut opened = OpenDevice::new(device, &session(TRIGGERED_HZ, true), 20)?;
    let mut found = Vec::new();
    for _ in 0..TIMES {
        let at_us = opened.now_us() + EVERY_US;
        opened.hold(at_us - 10_000, 20)?;
        if let Some(world) = opened.stepper.port().world() {
            world.trigger(at_us);
        }
        opened.hold(at_us + 250_000, 20)?;
        found.push(opened.to_first(at_us, 0.0));
    }
    min_and_max(found).ok_or_else(silent)
}

/// Measures the latency from a setpoint to the first pulse that has its current.
fn command_latency(
    device: &DeviceName,
    (rate_hz, from_ma): (u32, u32),
) -> Result<[u64; 2], RampsError> {
    let mut opened = OpenDevice::new(device, &session(rate_hz, false), from_ma)?;
    let mut found = Vec::new();
    for _ in 0..TIMES {
        let at_us = opened.now_us() + EVERY_US;
        opened.hold(at_us, from_ma)?;
        let sent_us = opened.now_us();
        opened.hold(sent_us + 250_000, 20)?;
        found.push(opened.to_first(sent_us, GONE_MA));
        let off_us = opened.now_us() + 100_000;
        opened.hold(off_us, from_ma)?;
    }
    min_and_max(found).ok_or_else(silent)
}

impl Latency {
    /// Describes the latencies for the report page.
    #[must_use]
    pub fn in_words(&self, device: &DeviceName) -> String {
        let [least, most] = self.trigger_us;
        let commands = COMMANDS.into_iter().zip(self.command_us);
        let commands = commands.map(|((rate_hz, from_ma), [least, most])| {
            format!("{least} to {most} µs at {rate_hz} Hz from {from_ma} mA")
        });
        format!(
            "Latency of --device {}, {TIMES} repetitions each. From an edge at the trigger input \
             to the first edge of its train: {least} to {most} µs; the design value is 1000 µs. \
             From the host's setpoint of 20 mA to the first pulse with that current: {}. A \
             setpoint waits for the next pulse of the running train; the channel's `start` lets \
             that pulse have 20 mA without a rise. The paper states {} to {} µs from a reference \
             pulse, set by the program that sent the command, to the first pulse. This includes \
             its USB, serial line and stimulator. The wire of the native simulator takes no time; \
             the USB of the chip simulator does.",
            device.to_argument(),
            commands.collect::<Vec<_>>().join(", "),
            PAPER_US[0],
            PAPER_US[1]
        )
    }
}
