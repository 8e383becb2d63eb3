//! Runs a calibration, from an earlier journal to the wearer file.

use super::conduct::{OperatorStation, Procedure, ProcedureCost, conduct};
use super::{
    Action, CalibrationError, ElectrodeResult, Entry, Files, Head, Journal, Machine, Order, Plan,
    Refusal, View, setup, worn,
};
use crate::link::Port;
use crate::wearer::Wearer;
use firmware::safety::WearerSpec;
use std::path::Path;

/// Parameters of a calibration: the plan, the state to continue from, and the files.
pub struct Course<'a> {
    /// Plan of the electrodes to calibrate.
    pub plan: &'a Plan,
    /// Path of the wearer file.
    pub out: &'a Path,
    /// Destination of the files.
    pub files: &'a dyn Files,
    /// Entries of an earlier journal to continue from, including the entry of its head.
    pub before: &'a [Entry],
    /// Head that names the operator, the device and the date in the journal and in the file's
    /// history from now on.
    pub head: &'a Head,
}

/// Calibration machine together with the parameters of the files it writes.
struct Writing<'a> {
    machine: Machine,
    course: &'a Course<'a>,
    limits: WearerSpec,
}

impl Procedure for Writing<'_> {
    fn begin(&mut self) -> Vec<Action> {
        self.machine.begin()
    }

    fn advance_to(&mut self, t_us: u64) -> Vec<Action> {
        self.machine.advance_to(t_us)
    }

    fn execute_order(&mut self, t_us: u64, order: &Order) -> Result<Vec<Action>, Refusal> {
        self.machine.execute_order(t_us, order)
    }

    fn discard_level(&mut self, t_us: u64) {
        self.machine.discard_level(t_us);
    }

    fn view(&self, t_us: u64) -> View {
        self.machine.view(t_us)
    }

    fn is_stimulating(&self) -> bool {
        self.machine.is_stimulating()
    }

    fn is_finished(&self) -> bool {
        self.machine.is_finished()
    }

    /// Writes the whole wearer file, with every electrode that is complete.
    fn write_wearer_file(&mut self) -> Result<Option<usize>, CalibrationError> {
        let Course {
            plan,
            out,
            files,
            before,
            head,
        } = self.course;
        let mut wearer =
            worn::compose_wearer(plan, before, head, self.limits, self.machine.results());
        let electrodes = wearer.electrodes.len();
        if electrodes == 0 {
            return Ok(None);
        }
        // Entries that others have added to the file since then are kept.
        if let Ok(old) = Wearer::read(out) {
            wearer.checks = old.checks;
            (wearer.note, wearer.forearm, wearer.elbow) = (old.note, old.forearm, old.elbow);
        }
        worn::write(*files, out, &wearer)?;
        Ok(Some(electrodes))
    }
}

/// Carries out `course` through `port`. Returns the results by electrode of the plan, the extent of
/// the calibration, and the port unless it was lost. The device is asked to stop first, however the
/// calibration ended; journal and wearer file are complete files in every case.
pub fn calibrate<P: Port>(
    port: P,
    course: &Course<'_>,
    journal: &mut Journal,
    desk: &mut OperatorStation<'_>,
) -> (
    Result<Vec<ElectrodeResult>, CalibrationError>,
    ProcedureCost,
    Option<P>,
) {
    let sessions = match setup::sessions(course.plan) {
        Ok(sessions) => sessions,
        Err(error) => return (Err(error), ProcedureCost::default(), Some(port)),
    };
    let limits = sessions
        .first()
        .map(|session| session.wearer)
        .unwrap_or_default();
    let plan = course.plan;
    if let Err(error) = worn::check_planned_wearer(plan, course.head, limits) {
        return (Err(error), ProcedureCost::default(), Some(port));
    }
    let mut writing = Writing {
        machine: Machine::new(plan.clone(), course.before),
        limits,
        course,
    };
    let (result, spent, port) = conduct(port, plan, &mut writing, journal, desk, course.head);
    (
        result.map(|()| writing.machine.results().to_vec()),
        spent,
        port,
    )
}
