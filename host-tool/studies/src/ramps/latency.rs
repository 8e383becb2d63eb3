//! From a trigger, and from a host's command, to the first edge of a pulse (section 3.2): a
//! train of 40 µs that goes from 0 to 20 mA every second.

use super::device::{Heard, Notes, all, listen};
use super::error::RampsError;
use firmware::link::Request;
use firmware::units::Amplitude;
use hal_sim::body::Drive;
use host_core::link::{Client, Port};
use host_core::run::DeviceName;
use host_core::session::Session;

/// What the oscilloscope of the paper said, µs (section 4.1).
pub const PAPER_US: [u64; 2] = [1_220, 1_300];
/// How often it is tried.
const TIMES: u64 = 20;
/// From one to the next, µs: another phase of everything that repeats each time.
const EVERY_US: u64 = 500_137;
/// The train that is triggered, and the one that waits for its next slot, Hz.
const RATES_HZ: [u32; 2] = [50, 200];

/// From what to the first edge: least and greatest of [`TIMES`], µs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Latency {
    /// From an edge at the trigger input.
    pub trigger_us: [u64; 2],
    /// From a setpoint's last byte leaving the host, at 50 and at 200 Hz: the train runs
    /// silently, and its next slot is waited for.
    pub command_us: [[u64; 2]; 2],
}

/// A session of one channel.
fn session(rate_hz: u32, is_triggered: bool) -> String {
    let triggered = if is_triggered {
        ", triggered = true, repeats = 10"
    } else {
        ""
    };
    format!(
        "title = \"latency\"\nduration_s = 60.0\n[wearer]\nmax_current_ma = 20.0\nrise_ms = 1\n\
         fall_ms = 50\n[[channel]]\nnumber = 1\nname = \"triceps\"\nlimit = 20.0\n\
         stage = {{ kind = \"current\", full_scale_ma = 100.0 }}\n\
         train = {{ shape = \"biphasic-cathodic-first\", width_us = 40, \
         frequency_hz = {rate_hz}.0{triggered} }}\n\
         [setpoints]\nkind = \"amplitudes\"\nrate_hz = 50\nvalues = [{{ channel = 1, value = 20.0 }}]\n\
         [body]\nkind = \"still\"\nload_ohm = 1000\n"
    )
}

/// 0 or 20 mA.
fn wanted(is_on: bool) -> Request {
    Request::Amplitudes {
        mask: 1,
        values: [Amplitude::new(if is_on { 20_000 } else { 0 })]
            .into_iter()
            .collect(),
        widths: Default::default(), // the train's own
    }
}

/// A device that stimulates, and what reaches its electrodes.
struct Opened {
    client: Client<Box<dyn Port>>,
    heard: Heard,
}

impl Opened {
    fn new(device: &DeviceName, text: &str, is_on: bool) -> Result<Self, RampsError> {
        let failed = |why: String| RampsError::Device("latency".to_owned(), why);
        let session = Session::parse("latency.toml", text).map_err(|e| failed(e.to_string()))?;
        let mut port = device.open(&session, 1)?;
        let heard = Heard::default();
        let world = port.world();
        let world = world.ok_or_else(|| failed("it is not simulated".to_owned()))?;
        world.body = Box::new(Notes::new(&heard));
        let told = |e: host_core::link::Error| failed(e.to_string());
        let (mut client, _) = Client::open(port).map_err(told)?;
        for request in session.requests() {
            client.request(request).map_err(told)?;
        }
        client.arm().map_err(told)?;
        client.request(wanted(is_on)).map_err(told)?;
        client.start().map_err(told)?;
        Ok(Self { client, heard })
    }

    /// Says that it is there until `until_us`, with this wish.
    fn hold(&mut self, until_us: u64, is_on: bool) -> Result<(), String> {
        while self.client.port().now_us() + 40_000 < until_us {
            let next_us = self.client.port().now_us() + 20_000;
            self.client.post(wanted(is_on)).map_err(|e| e.to_string())?;
            listen(&mut self.client, next_us)?;
        }
        listen(&mut self.client, until_us)
    }

    /// From `from_us` to the first pulse with a current after it.
    fn to_first(&self, from_us: u64) -> Option<u64> {
        let mut later = all(&self.heard).into_iter().filter(|it| it.t_us >= from_us);
        let first = later.find(|it| it.drive != Drive::Milliamps(0.0))?;
        Some(first.t_us - from_us)
    }
}

/// Least and greatest.
fn ends(all: impl IntoIterator<Item = Option<u64>>) -> Option<[u64; 2]> {
    let all: Option<Vec<u64>> = all.into_iter().collect();
    let all = all?;
    Some([all.iter().copied().min()?, all.iter().copied().max()?])
}

/// Tries it on `device`.
///
/// # Errors
/// The device is not there; E692: it does not play.
pub fn latency(device: &DeviceName) -> Result<Latency, RampsError> {
    let failed = |why: String| RampsError::Device("latency".to_owned(), why);
    let silent = || failed("a pulse did not come".to_owned());
    let mut opened = Opened::new(device, &session(RATES_HZ[0], true), true)?;
    let mut triggered = Vec::new();
    for _ in 0..TIMES {
        let at_us = opened.client.port().now_us() + EVERY_US;
        opened.hold(at_us - 10_000, true).map_err(failed)?;
        if let Some(world) = opened.client.port().world() {
            world.trigger(at_us);
        }
        opened.hold(at_us + 250_000, true).map_err(failed)?;
        triggered.push(opened.to_first(at_us));
    }
    let trigger_us = ends(triggered).ok_or_else(silent)?;
    let command = |rate_hz: u32| {
        let mut opened = Opened::new(device, &session(rate_hz, false), false)?;
        let mut found = Vec::new();
        for _ in 0..TIMES {
            let at_us = opened.client.port().now_us() + EVERY_US;
            opened.hold(at_us, false).map_err(failed)?;
            let sent_us = opened.client.port().now_us();
            opened.hold(sent_us + 250_000, true).map_err(failed)?;
            found.push(opened.to_first(sent_us));
            let off_us = opened.client.port().now_us() + 100_000;
            opened.hold(off_us, false).map_err(failed)?;
        }
        ends(found).ok_or_else(silent)
    };
    Ok(Latency {
        trigger_us,
        command_us: [command(RATES_HZ[0])?, command(RATES_HZ[1])?],
    })
}

impl Latency {
    /// For a page.
    #[must_use]
    pub fn in_words(&self, device: &DeviceName) -> String {
        let [least, most] = self.trigger_us;
        let [[slow_least, slow_most], [fast_least, fast_most]] = self.command_us;
        format!(
            "Latency on --device {}, of {TIMES} each: from an edge at the trigger input to the \
             first edge of its train {least} to {most} µs, by design 1000; from the host's \
             setpoint to the first pulse of a train that waits for it {slow_least} to {slow_most} \
             µs at 50 Hz and {fast_least} to {fast_most} µs at 200 Hz, most of it the wait for the \
             train's next slot. The paper: {} to {} µs from a reference pulse, set by the same \
             program that sent the command, to the first pulse: with its USB, serial line and \
             stimulator in it. The wire of a simulator takes no time, the chip's USB does.",
            device.typed(),
            PAPER_US[0],
            PAPER_US[1]
        )
    }
}
