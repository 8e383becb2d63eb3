//! A calibration from its journal on to its wearer file.

use super::conduct::{Desk, Procedure, Spent, conduct};
use super::{
    Action, CalibrationError, Entry, Files, Found, Head, Journal, Machine, Order, Plan, Refusal,
    View, setup, worn,
};
use crate::link::Port;
use crate::wearer::Wearer;
use firmware::safety::WearerSpec;
use std::path::Path;

/// What is calibrated, from where on, and where it is written.
pub struct Course<'a> {
    /// What is calibrated.
    pub plan: &'a Plan,
    /// The wearer file.
    pub out: &'a Path,
    /// Where files go.
    pub files: &'a dyn Files,
    /// What happened before, of an earlier journal; its head's entry included.
    pub before: &'a [Entry],
    /// Who and what the journal and the file's history name from now on.
    pub head: &'a Head,
}

/// The machine, and what it writes.
struct Writing<'a> {
    machine: Machine,
    course: &'a Course<'a>,
    limits: WearerSpec,
}

impl Procedure for Writing<'_> {
    fn begin(&mut self) -> Vec<Action> {
        self.machine.begin()
    }

    fn pass(&mut self, t_us: u64) -> Vec<Action> {
        self.machine.pass(t_us)
    }

    fn order(&mut self, t_us: u64, order: &Order) -> Result<Vec<Action>, Refusal> {
        self.machine.order(t_us, order)
    }

    fn void(&mut self, t_us: u64) {
        self.machine.void(t_us);
    }

    fn view(&self, t_us: u64) -> View {
        self.machine.view(t_us)
    }

    fn is_on(&self) -> bool {
        self.machine.is_on()
    }

    fn is_over(&self) -> bool {
        self.machine.is_over()
    }

    /// The file as a whole, with all that is complete.
    fn write(&mut self) -> Result<Option<usize>, CalibrationError> {
        let Course {
            plan,
            out,
            files,
            before,
            head,
        } = self.course;
        let mut wearer = worn::wearer(plan, before, head, self.limits, self.machine.found());
        let electrodes = wearer.electrodes.len();
        if electrodes == 0 {
            return Ok(None);
        }
        // What others have added to it since stays.
        if let Ok(old) = Wearer::read(out) {
            wearer.checks = old.checks;
            (wearer.note, wearer.forearm, wearer.elbow) = (old.note, old.forearm, old.elbow);
        }
        worn::write(*files, out, &wearer)?;
        Ok(Some(electrodes))
    }
}

/// Carries out `course` through `port`: what was found by electrode of the plan, what it
/// took, and the port, as far as there is one. Whatever ends it, the device is asked to
/// stop first; journal and wearer file are whole.
pub fn calibrate<P: Port>(
    port: P,
    course: &Course<'_>,
    journal: &mut Journal,
    desk: &mut Desk<'_>,
) -> (Result<Vec<Found>, CalibrationError>, Spent, Option<P>) {
    let sessions = match setup::sessions(course.plan) {
        Ok(sessions) => sessions,
        Err(error) => return (Err(error), Spent::default(), Some(port)),
    };
    let limits = sessions
        .first()
        .map(|session| session.wearer)
        .unwrap_or_default();
    let plan = course.plan;
    if let Err(error) = worn::rehearse(plan, course.head, limits) {
        return (Err(error), Spent::default(), Some(port));
    }
    let mut writing = Writing {
        machine: Machine::new(plan.clone(), course.before),
        limits,
        course,
    };
    let (result, spent, port) = conduct(port, plan, &mut writing, journal, desk, course.head);
    (
        result.map(|()| writing.machine.found().to_vec()),
        spent,
        port,
    )
}
