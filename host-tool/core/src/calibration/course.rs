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

/// Parameters of a calibration: its plan, its files, and the earlier results from which it
/// continues.
pub struct Course<'a> {
    /// Plan of the electrodes to calibrate.
    pub plan: &'a Plan,
    /// Path of the wearer file that the calibration writes.
    pub out: &'a Path,
    /// Destination of the wearer file: the disk, or a substitute in tests.
    pub files: &'a dyn Files,
    /// Entries of an earlier journal from which the calibration continues, including its first
    /// entry; empty for a new calibration.
    pub before: &'a [Entry],
    /// Head of this run: the operator, the device and the date that the journal and the history of
    /// the wearer file name.
    pub head: &'a Head,
}

/// Procedure of a calibration, which also writes the wearer file.
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

    /// Writes the whole wearer file, with all electrodes whose calibration is complete. Returns
    /// their number, or `None` without writing if there are none.
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

/// Carries out a calibration on the device behind `port`. Returns the result of each electrode of
/// the plan, how long the calibration took, and the port unless it was lost. Before it returns, the
/// device is asked to stop, however the calibration ended. The journal and the wearer file are
/// complete files in every case.
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
