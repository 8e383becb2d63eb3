//! Calibrates a simulated body with the procedure of `flexor calibrate`, on the native device.

use super::ByEye;
use hal_sim::body::{Body, CHANNELS};
use host_core::calibration::{
    CalibrationError, Course, ElectrodeResult, Files, Head, Journal, OperatorStation, Plan,
    ProcedureCost, board_session, calibrate,
};
use host_core::run::DeviceName;
use host_core::wearer::Wearer;
use std::cell::RefCell;
use std::fmt::Write as _;
use std::io;
use std::path::Path;

/// A point to calibrate.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct PlannedPoint {
    /// Index of the channel, from 0.
    pub channel: usize,
    /// Movement that the operator expects; see [`hal_sim::body::Body::visible_movements`].
    pub movement: &'static str,
    /// Lowest level with which the search may begin, V.
    pub start_v: f64,
    /// Highest level that may be given, V.
    pub ceiling_v: f64,
}

/// Amplitudes that a session takes from the wearer file for a joint's points.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct CalibratedPoints {
    /// Threshold and maximum on each channel, V; `None` if the file has no electrode there.
    pub ranges_v: [Option<[f64; 2]>; CHANNELS],
    /// Time that the calibration took on the device, s.
    pub device_s: f64,
    /// Number of presentations of a level.
    pub presentations: usize,
}

/// The wearer file that a calibration writes, in memory.
#[derive(Debug, Default)]
struct InMemory(RefCell<String>);

impl Files for InMemory {
    fn append(&self, _: &Path) -> io::Result<Box<dyn io::Write>> {
        Ok(Box::new(io::sink()))
    }

    fn replace(&self, _: &Path, text: &str) -> io::Result<()> {
        text.clone_into(&mut self.0.borrow_mut());
        Ok(())
    }
}

/// Returns the text of the plan: voltage stages, 200 µs and 50 Hz, as Hamana 2022 stimulates.
fn plan_text(points: &[PlannedPoint]) -> String {
    let mut text = "wearer = \"W01\"\n[limits]\nmax_current_ma = 100.0\n".to_owned();
    for point in points {
        let _ = write!(
            text,
            "[[electrode]]\nchannel = {}\nplace = \"{}\"\nstage = \"voltage\"\narea_mm2 = 490\n\
             width_us = 200\nfrequency_hz = 50.0\nstart = {:.3}\nceiling = {:.3}\n",
            point.channel + 1,
            point.movement,
            point.start_v,
            point.ceiling_v
        );
    }
    text
}

/// Calibrates `points` of `body` as `flexor calibrate` does, with the operator [`ByEye`], and reads
/// the wearer file that was written.
///
/// # Errors
/// The device refuses the plan, or ended the calibration.
pub fn calibrate_body(
    body: Box<dyn Body>,
    points: &[PlannedPoint],
    seed: u64,
) -> Result<CalibratedPoints, CalibrationError> {
    let text = plan_text(points);
    let plan = Plan::parse("the plan of a simulated body", &text)?;
    let mut port = DeviceName::Native.open(&board_session(&plan)?, seed)?;
    if let Some(world) = port.world() {
        world.body = body;
    }
    let files = InMemory::default();
    let head = Head {
        operator: "by eye".to_owned(),
        at: "simulated".to_owned(),
        device: "native".to_owned(),
        firmware: "0".to_owned(),
        seed: Some(seed),
        ..Head::new(&plan.wearer, &text)
    };
    let course = Course {
        plan: &plan,
        out: Path::new("a wearer file in memory"),
        files: &files,
        before: &[],
        head: &head,
    };
    let mut station = OperatorStation {
        operator: &mut ByEye,
        interruption: None,
        acknowledges: false,
    };
    let (found, spent, _) = calibrate(port, &course, &mut Journal::discarding(), &mut station);
    let found: Vec<ElectrodeResult> = found?;
    let written = files.0.borrow();
    read_points(&written, &found, spent)
}

/// Reads the amplitudes as a session's joint takes them from the file: `threshold` is the
/// electrode's `joint_threshold`, else its `minimum` or `motor_threshold`, and `max` is its
/// `maximum`, else its `limit`.
fn read_points(
    written: &str,
    found: &[ElectrodeResult],
    spent: ProcedureCost,
) -> Result<CalibratedPoints, CalibrationError> {
    let mut points = CalibratedPoints {
        ranges_v: [None; CHANNELS],
        device_s: spent.t_s,
        presentations: spent.given,
    };
    if found.iter().any(ElectrodeResult::is_complete) {
        let read = Wearer::parse("the calibrated wearer file", written);
        let wearer = read.map_err(|e| CalibrationError::Plan("W01".to_owned(), e.lines()))?;
        for electrode in &wearer.electrodes {
            let least = electrode.minimum.unwrap_or(electrode.motor_threshold);
            let low = electrode.joint_threshold.unwrap_or(least);
            let high = electrode.maximum.unwrap_or(electrode.limit);
            let range = [low, high].map(|amplitude| f64::from(amplitude.get()) / 1000.0);
            points.ranges_v[usize::from(electrode.channel - 1)] = Some(range);
        }
    }
    Ok(points)
}
