//! Fixtures for tests across packages: shipped sessions, a device and its host, plain trains,
//! frames. Functions panic if a fixture cannot be created.

use firmware::device::Identity;
use firmware::link::message::ResetCause;
use firmware::link::{Decoder, HelloInfo, Kind, Request, ToDevice, encode};
use firmware::pulse::TrainSpec;
use firmware::safety::{ChannelSpec, StageSpec, Stages, WearerSpec};
use firmware::units::{Amplitude, Micros};
use hal_sim::body::{Drive, FixedLoad, Load};
use hal_sim::chip::image::Image;
use hal_sim::lockstep::Output;
use hal_sim::native::native;
use hal_sim::trace::{Edge, Trace};
use hal_sim::wire::faults::Faults;
use hal_sim::world::World;
use host_core::link::{Connection, Port, SimulatedPort};
use host_core::run::{DeviceName, Outcome, SessionFile, chip_image, run};
use std::path::{Path, PathBuf};

/// Returns the path of a shipped session's file.
#[must_use]
pub fn session_path(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../host-tool/sessions");
    folder.join(name)
}

/// Returns the session files in a subfolder, sorted by name.
#[must_use]
pub fn session_paths(folder: &str) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(session_path(folder)).unwrap();
    let mut files: Vec<_> = entries.map(|entry| entry.unwrap().path()).collect();
    files.retain(|path| path.extension().is_some_and(|e| e == "toml"));
    files.sort();
    files
}

/// Loads a shipped session.
#[must_use]
pub fn load_session(name: &str) -> SessionFile {
    SessionFile::load(&session_path(name)).unwrap()
}

/// Session that was played to its end: outcome, and the pins of a simulated device.
pub struct PlayedSession {
    /// Outcome that the host recorded.
    pub outcome: Outcome,
    /// Levels and DAC codes that the device emitted.
    pub trace: Trace,
    /// Start of the trains in the port's time, µs.
    pub epoch_us: u64,
    /// End of the recording in the port's time, µs.
    pub end_us: u64,
    /// Loads of the wearer's electrodes at the end.
    pub loads: [Load; 10],
}

impl PlayedSession {
    /// Returns the edges of the pins from the start of the trains on, with times relative to that
    /// start.
    pub fn edges(&self) -> impl Iterator<Item = Edge> {
        let since = self.trace.edges_from(self.epoch_us);
        since.map(|edge| Edge {
            t_us: edge.t_us - self.epoch_us,
            ..edge
        })
    }
}

/// Plays `file` on a simulated device.
#[must_use]
pub fn play(file: &SessionFile, device: &DeviceName) -> PlayedSession {
    let port = device.open(&file.session, 1);
    let port = port.unwrap_or_else(|e| panic!("{} on {device}: {e}", file.name));
    play_on(file, port)
}

/// Plays `file` like [`play`], on the simulated device behind `port`.
#[must_use]
pub fn play_on(file: &SessionFile, port: Box<dyn Port>) -> PlayedSession {
    let (outcome, port) = run(file, port, None, |_| ());
    if let Some(error) = &outcome.error {
        panic!("{}: {error}", file.name);
    }
    let mut port = port.unwrap();
    let world = port.world().unwrap();
    let trace = std::mem::take(&mut world.recorder.trace);
    let epoch_us = outcome.epoch_us.unwrap();
    PlayedSession {
        outcome,
        trace,
        epoch_us,
        end_us: world.now_us(),
        loads: *world.body.loads(),
    }
}

/// Builds the image that boards are flashed with.
#[must_use]
pub fn flashed_image() -> Image {
    chip_image(None).unwrap_or_else(|e| panic!("{e}"))
}

/// Returns current stages of this full scale on all ten channels. No channel belongs to a conducted
/// group.
#[must_use]
pub const fn stages(full_scale_ma: f64) -> [Option<Output>; 10] {
    let full_scale = Drive::Milliamps(full_scale_ma);
    let conducted = false;
    [Some(Output {
        full_scale,
        conducted,
    }); 10]
}

/// Returns a native device that boots at `boot`, on a wearer who does not move.
#[must_use]
pub fn world(boot: Micros) -> World {
    let body = Box::new(FixedLoad::new(0.0));
    World::new(Box::new(native(boot)), body, boot, Faults::default(), 1)
}

/// Opens a session on a native device, and returns its answer to `Hello`.
#[must_use]
pub fn open(boot: Micros) -> (Connection<SimulatedPort>, HelloInfo) {
    Connection::open(SimulatedPort::new(world(boot))).unwrap()
}

/// Returns the identity of a device after power-on.
#[must_use]
pub const fn identity(kind: Kind, first_session: u16) -> Identity {
    Identity {
        kind,
        unique_id: [0; 3],
        reset: ResetCause::PowerOn,
        last_fault: None,
        first_session,
        stages: Stages::AsConfigured,
        option_bytes: None,
        board: "",
        crystal_hz: 0,
        has_boot_loader: false,
    }
}

/// Returns a channel on a current stage with the limit `limit_ua`.
#[must_use]
pub const fn channel(train: TrainSpec, full_scale_ua: u32, limit_ua: u32) -> ChannelSpec {
    ChannelSpec {
        train,
        stage: StageSpec::Current { full_scale_ua },
        limit: Amplitude::new(limit_ua),
        start: Amplitude::new(0),
        area_mm2: ChannelSpec::ASSUMED_AREA_MM2,
    }
}

/// Returns a wearer whose amplitudes rise within 1 ms.
#[must_use]
pub fn wearer(host_timeout_ms: u16) -> WearerSpec {
    WearerSpec {
        rise_ms: 1,
        host_timeout_ms,
        ..WearerSpec::default()
    }
}

/// Request to arm; the sender fills in the checksum of the setup.
pub const ARM: Request = Request::Arm { setup: 0 };

/// Encodes a request as a host's frame.
#[must_use]
pub fn frame(session: u16, seq: u16, request: Request) -> Vec<u8> {
    let message = ToDevice {
        session,
        seq,
        request,
    };
    encode(&message).expect("every request fits").to_vec()
}

/// Decodes the messages in complete frames.
pub fn messages(bytes: &[u8]) -> impl Iterator<Item = Vec<u8>> {
    let mut decoder = Decoder::default();
    bytes.iter().filter_map(move |&byte| {
        let message = decoder.push(byte)?.expect("whole frames").to_vec();
        decoder.clear();
        Some(message)
    })
}
