//! A calibration of simulated electrodes, and disturbances that may interrupt it.

use firmware::units::Micros;
use hal_sim::body::bench::SensorSpec;
use hal_sim::body::{Array, Load};
use hal_sim::native::native_seeded;
use hal_sim::world::World;
use host_core::calibration::{
    Auto, CalibrationError, Course, ElectrodeResult, Entry, Files, Head, Journal, OnDisk, Operator,
    OperatorLoss, OperatorStation, Order, Phase, Plan, ProcedureCost, Step, View, board_session,
    calibrate, journal_path, read,
};
use host_core::link::{Port, SimulatedPort};
use host_core::run::simulated_port;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

pub const SEED: u64 = 1;

/// Returns an empty folder for one test.
pub fn folder(test: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"))
        .join("calibration")
        .join(test);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

/// Plans electrodes 1 to `count`, each with a ceiling of 24 mA.
pub fn plan_with_electrodes(count: u8) -> (Plan, String) {
    let mut text = "wearer = \"W01\"\n[limits]\nmax_current_ma = 30.0\n".to_owned();
    for channel in 1..=count {
        text += &format!(
            "[[electrode]]\nchannel = {channel}\nplace = \"p{channel}\"\nceiling = 24.0\n"
        );
    }
    (Plan::parse("plan", &text).unwrap(), text)
}

pub fn head_of(text: &str) -> Head {
    Head {
        operator: "auto".to_owned(),
        at: "simulated".to_owned(),
        device: "native".to_owned(),
        firmware: "0.1.0".to_owned(),
        body: Some("array".to_owned()),
        seed: Some(SEED),
        ..Head::new("W01", text)
    }
}

/// Opens a native device with the random electrode array of `seed`.
pub fn array_port(plan: &Plan, seed: u64, sensor: SensorSpec) -> SimulatedPort {
    let device = Box::new(native_seeded(Micros::new(0), seed));
    let mut port =
        simulated_port(&board_session(plan).unwrap(), seed, device, Micros::new(0)).unwrap();
    port.world.body = Box::new(Array::new(seed, sensor).unwrap());
    port
}

/// Disturbance of a calibration.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Disturbance {
    /// The operator presses the abort key.
    Abort,
    /// The cable breaks, and sending and receiving fail.
    Cut,
    /// Messages are lost in both directions, without an error.
    Freeze,
    /// The current electrode falls off.
    Off,
}

/// Time of the disturbance: the first time that this electrode is in this step and phase, whether
/// or not an answer is pending.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Moment {
    pub electrode: usize,
    pub step: Step,
    pub phase: Phase,
    /// While a level is given: remaining time of its second at the disturbance, s.
    pub left_s: f64,
}

/// Progress of the disturbance.
#[derive(Clone, Copy, Debug, Default)]
pub struct DisturbanceState {
    pub has_come: bool,
    /// Time at which the device's side noticed the disturbance, µs.
    pub at_us: Option<u64>,
    channel: usize,
}

/// The automatic operator, until the disturbance.
pub struct DisturbedOperator {
    pub moment: Moment,
    pub way: Disturbance,
    pub come: Arc<Mutex<DisturbanceState>>,
}

impl Operator for DisturbedOperator {
    fn orders(&mut self, view: &View) -> Result<Vec<Order>, OperatorLoss> {
        let (at, now) = (self.moment, (view.electrode, view.step, view.phase));
        let is_time = view.phase != Phase::On || view.left_s < at.left_s;
        let mut come = self.come.lock().unwrap();
        if now == (at.electrode, at.step, at.phase) && is_time && !come.has_come {
            come.has_come = true;
            come.channel = usize::from(view.channel - 1);
            if self.way == Disturbance::Abort {
                return Ok(vec![Order::Abort]);
            }
        }
        Auto.orders(view)
    }
}

/// A port with a disturbance.
pub struct DisturbedPort {
    pub port: SimulatedPort,
    pub way: Disturbance,
    pub come: Arc<Mutex<DisturbanceState>>,
}

impl DisturbedPort {
    /// Returns whether messages still pass.
    fn is_wire_intact(&mut self) -> bool {
        let mut come = self.come.lock().unwrap();
        if !come.has_come {
            return true;
        }
        if come.at_us.is_none() {
            come.at_us = Some(self.port.world.now_us());
            if self.way == Disturbance::Off {
                self.port.world.body.loads_mut()[come.channel] = Load::Open;
            }
        }
        matches!(self.way, Disturbance::Abort | Disturbance::Off)
    }
}

impl Port for DisturbedPort {
    fn now_us(&mut self) -> u64 {
        self.port.now_us()
    }

    fn send(&mut self, frame: &[u8]) -> io::Result<()> {
        match self.is_wire_intact() {
            true => self.port.send(frame),
            false if self.way == Disturbance::Cut => Err(io::Error::other("cut")),
            false => Ok(()),
        }
    }

    fn receive(&mut self, until_us: u64) -> io::Result<Vec<u8>> {
        match self.is_wire_intact() {
            true => self.port.receive(until_us),
            false if self.way == Disturbance::Cut => Err(io::Error::other("cut")),
            false => {
                self.port.world.run_until(until_us)?;
                self.port.world.received().for_each(drop);
                Ok(Vec::new())
            }
        }
    }

    fn world(&mut self) -> Option<&mut World> {
        self.port.world()
    }
}

/// Access to a port that the test inspects afterwards.
impl Port for &mut DisturbedPort {
    fn now_us(&mut self) -> u64 {
        (**self).now_us()
    }

    fn send(&mut self, frame: &[u8]) -> io::Result<()> {
        (**self).send(frame)
    }

    fn receive(&mut self, until_us: u64) -> io::Result<Vec<u8>> {
        (**self).receive(until_us)
    }

    fn world(&mut self) -> Option<&mut World> {
        (**self).world()
    }
}

/// Result and cost of a calibration, and the port.
pub type CalibrationEnd<P> = (
    Result<Vec<ElectrodeResult>, CalibrationError>,
    ProcedureCost,
    Option<P>,
);

/// Calibrates through `port`, and continues from the journal beside `out` if there is one.
pub fn run_calibration<P: Port>(
    port: P,
    (plan, text): &(Plan, String),
    out: &Path,
    files: &dyn Files,
    operator: &mut dyn Operator,
) -> CalibrationEnd<P> {
    let path = journal_path(out);
    let kept = match path.exists() {
        true if std::fs::read(&path).unwrap().contains(&b'\n') => Some(read(&path).unwrap()),
        _ => None,
    };
    if kept.is_none() {
        let _ = std::fs::remove_file(&path);
    }
    let head = head_of(text);
    let course = Course {
        plan,
        out,
        files,
        before: kept.as_ref().map_or(&[], |kept| &kept.entries),
        head: &head,
    };
    let mut journal = match Journal::open(files, &path, kept.as_ref()) {
        Ok(journal) => journal,
        Err(error) => return (Err(error), ProcedureCost::default(), Some(port)),
    };
    let mut desk = OperatorStation {
        operator,
        interruption: None,
        acknowledges: false,
    };
    calibrate(port, &course, &mut journal, &mut desk)
}

/// Runs a whole calibration with the automatic operator; returns its results, its cost and the
/// file.
pub fn run_whole_calibration(
    order: &(Plan, String),
    out: &Path,
) -> (Vec<ElectrodeResult>, ProcedureCost, String) {
    let port = array_port(&order.0, SEED, SensorSpec::default());
    let (found, spent, _) = run_calibration(port, order, out, &OnDisk, &mut Auto);
    (found.unwrap(), spent, std::fs::read_to_string(out).unwrap())
}

/// Returns the complete entries of the journal.
pub fn entries(out: &Path) -> Vec<Entry> {
    read(&journal_path(out)).unwrap().entries
}

/// Returns the time from `since_us` to the last output, µs. Checks that the outputs are isolated
/// for another half second.
pub fn silent_after(world: &mut World, since_us: u64) -> u64 {
    let now_us = world.now_us();
    world.run_until(now_us + 500_000).unwrap();
    let trace = &world.recorder.trace;
    assert_eq!(trace.last_levels().0, 0, "outputs are isolated");
    let last_us = trace.levels.last().map_or(0, |(t_us, _)| *t_us);
    last_us.saturating_sub(since_us)
}

/// Returns the time after `since_us` at which a channel is first driven.
pub fn driven_after(world: &World, since_us: u64) -> Option<u64> {
    let edges = world.recorder.trace.edges_from(since_us);
    let mut driven = edges.filter(|edge| edge.state.is_driven() && edge.t_us >= since_us);
    driven.next().map(|edge| edge.t_us)
}
