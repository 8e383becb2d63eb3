//! Runs a calibration on a device: carries out the machine's actions, with one electrode armed at a
//! time, sends keep-alives, and reads the instrument.

mod device;
mod stall;

use super::instrument::{Instrument, READ_US};
use super::plan::HOST_TIMEOUT_MS;
use super::{
    Action, CalibrationError, Entry, Head, Journal, Operator, OperatorNotice, Order, Phase, Plan,
    Refusal, View, setup,
};
use crate::link::{Connection, Interruption, Port};
use crate::run::acknowledge;
use crate::session::Session;
use firmware::safety::StopCause;
use std::collections::VecDeque;
use std::time::Duration;

/// Time between two calls of the operator and the procedure, µs.
const LOOK_US: u64 = 5_000;

/// Procedure on the plan's electrodes, either a calibration or a drift check. It receives commands
/// and the time, and returns actions.
pub(super) trait Procedure {
    /// Starts the procedure, and returns its first actions.
    fn begin(&mut self) -> Vec<Action>;
    /// Advances the time to `t_us`, and returns the actions that are due, such as the end of a
    /// level.
    fn advance_to(&mut self, t_us: u64) -> Vec<Action>;
    /// Carries out a command at `t_us` completely and returns its actions, or refuses it and
    /// changes nothing.
    fn execute_order(&mut self, t_us: u64, order: &Order) -> Result<Vec<Action>, Refusal>;
    /// Discards the level that is being given at `t_us`, or about which a question is open, because
    /// the stimulation was interrupted. The next raise gives the same level again.
    fn discard_level(&mut self, t_us: u64);
    /// Returns the state at `t_us` as an operator sees it.
    fn view(&self, t_us: u64) -> View;
    /// Returns whether a level is being given at present.
    fn is_stimulating(&self) -> bool;
    /// Returns whether no electrode remains, so that the procedure is over.
    fn is_finished(&self) -> bool;
    /// Writes the results to the wearer file. Returns the number of electrodes with results, or
    /// `None` if there was nothing to write.
    fn write_wearer_file(&mut self) -> Result<Option<usize>, CalibrationError>;
}

/// Operator of a calibration or drift check, and the means to interrupt it.
pub struct OperatorStation<'a> {
    /// Source of the operator's commands.
    pub operator: &'a mut dyn Operator,
    /// Signal, such as Ctrl-C, that ends the procedure at once; `None` if there is none.
    pub interruption: Option<Interruption>,
    /// Whether a latched fault of the device is acknowledged before the procedure begins.
    pub acknowledges: bool,
}

/// Time and stimulation that a calibration or drift check took, whether or not it reached its end.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct ProcedureCost {
    /// Duration in the device's time, s, from the opening of the device.
    pub t_s: f64,
    /// Number of presentations, in each of which one level was given.
    pub given: usize,
}

/// Procedure that is in progress on a device.
struct Conduct<'a, 'd, P, M> {
    client: Connection<P>,
    sessions: Vec<Session>,
    machine: &'a mut M,
    journal: &'a mut Journal,
    desk: &'a mut OperatorStation<'d>,
    instrument: Instrument,
    /// Latest observations for the operator's view: the reading and the verdict of the instrument,
    /// and the reactions of a simulated wearer.
    seen: View,
    /// Time at which the next keep-alive is due, in the port's time, µs.
    due_us: u64,
    /// Whether a separate thread sends the keep-alives, so that this one need not.
    is_kept: bool,
    read_us: u64,
    begun_us: u64,
    keep_alive_us: u64,
    is_armed: bool,
    /// Whether the device may be giving a level above 0: one was requested, and no level of 0 was
    /// accepted since.
    is_given: bool,
    /// Reason why the device ended stimulation by itself; `None` if it did not.
    ended: Option<StopCause>,
    /// Times of this computer's stalls within the last minute, µs.
    stalls: VecDeque<u64>,
    given: usize,
}

/// Carries out the procedure `machine` on the device behind `port`, and returns the port unless it
/// was lost. Before it returns, the device is asked to stop, however the procedure ended.
pub(super) fn conduct<P: Port, M: Procedure>(
    port: P,
    plan: &Plan,
    machine: &mut M,
    journal: &mut Journal,
    desk: &mut OperatorStation<'_>,
    head: &Head,
) -> (Result<(), CalibrationError>, ProcedureCost, Option<P>) {
    let (sessions, mut client) = match open(port, plan, desk) {
        Ok(opened) => opened,
        Err(error) => return (Err(error), ProcedureCost::default(), None),
    };
    let begun_us = client.port().now_us();
    let keep_alive_us = u64::from(host_timeout_ms(&sessions)) * 1000 / 4;
    let is_kept = match client.start_keep_alive_thread(Duration::from_micros(keep_alive_us)) {
        Ok(is_kept) => is_kept,
        Err(error) => {
            return (
                Err(error.into()),
                ProcedureCost::default(),
                Some(client.into_port()),
            );
        }
    };
    let mut conduct = Conduct {
        client,
        sessions,
        machine,
        journal,
        desk,
        instrument: Instrument::default(),
        seen: View::default(),
        due_us: begun_us,
        read_us: begun_us,
        begun_us,
        keep_alive_us,
        is_kept,
        is_armed: false,
        is_given: false,
        ended: None,
        stalls: VecDeque::new(),
        given: 0,
    };
    let result = conduct.run(head);
    conduct.close(result)
}

fn open<P: Port>(
    port: P,
    plan: &Plan,
    desk: &OperatorStation<'_>,
) -> Result<(Vec<Session>, Connection<P>), CalibrationError> {
    let sessions = setup::sessions(plan)?;
    let port = match desk.acknowledges {
        true => acknowledge(port)?,
        false => port,
    };
    let (client, _) = Connection::open_interruptible(port, desk.interruption.clone())?;
    Ok((sessions, client))
}

impl<P: Port, M: Procedure> Conduct<'_, '_, P, M> {
    fn run(&mut self, head: &Head) -> Result<(), CalibrationError> {
        let entry = Entry::Begun(head.clone());
        self.record(&entry)?;
        let first = self.machine.begin();
        let mut done = self.perform_actions(first);
        loop {
            done = match done {
                Ok(()) if self.machine.is_finished() => return self.record(&Entry::Done),
                Ok(()) => self.run_cycle(),
                // A calibration that a stall of this computer interrupted continues at the same
                // step.
                Err(error) => match self.host_pause(&error)? {
                    Some(pause) => self.recover(pause),
                    None => return Err(error),
                },
            };
        }
    }

    fn run_cycle(&mut self) -> Result<(), CalibrationError> {
        let until_us = self.client.port().now_us() + LOOK_US;
        self.wait_until(until_us)?;
        self.poll_all()
    }

    /// Stops the device if it is armed. Then records in the journal why the procedure ended early,
    /// if it did.
    fn close(
        mut self,
        result: Result<(), CalibrationError>,
    ) -> (Result<(), CalibrationError>, ProcedureCost, Option<P>) {
        self.client.ignore_signals();
        let stopped = match self.is_armed {
            true => self.stop(),
            false => Ok(()),
        };
        let result = result.and(stopped.map_err(CalibrationError::from));
        if let Err(error) = &result {
            let why = error.to_string();
            let _ = self.record(&Entry::Ended { why }); // the first error is the one to tell
        }
        let spent = ProcedureCost {
            t_s: self.t_us() as f64 / 1e6,
            given: self.given,
        };
        (result, spent, Some(self.client.into_port()))
    }

    fn t_us(&mut self) -> u64 {
        self.client.port().now_us().saturating_sub(self.begun_us)
    }

    /// Runs one cycle: reads the instrument, advances the procedure, and carries out the operator's
    /// commands.
    fn poll_all(&mut self) -> Result<(), CalibrationError> {
        self.read_instrument();
        let t_us = self.t_us();
        let was_on = self.machine.is_stimulating();
        let actions = self.machine.advance_to(t_us);
        let is_given = was_on && !self.machine.is_stimulating();
        self.perform_actions(actions)?;
        if is_given {
            self.judge_movement()?;
        }
        let view = self.view();
        let orders = self.desk.operator.orders(&view);
        let orders =
            orders.map_err(|gone| CalibrationError::Gone(gone, describe_position(&view)))?;
        orders.iter().try_for_each(|order| self.carry_out(order))
    }

    fn carry_out(&mut self, order: &Order) -> Result<(), CalibrationError> {
        let t_us = self.t_us();
        let was_on = self.machine.is_stimulating();
        match self.machine.execute_order(t_us, order) {
            Ok(actions) => {
                if order.raises() || (was_on && !self.machine.is_stimulating()) {
                    self.clear_observations();
                }
                self.perform_actions(actions)
            }
            Err(refusal) => {
                self.notify_refusal(&refusal);
                Ok(())
            }
        }
    }

    fn notify_refusal(&mut self, refusal: &Refusal) {
        let view = self.view();
        self.desk
            .operator
            .notify(OperatorNotice::Refused(refusal), &view);
    }

    fn perform_actions(&mut self, actions: Vec<Action>) -> Result<(), CalibrationError> {
        // Silence comes first, then everything that may take time. If the device refused an action,
        // everything is still recorded, except that the level was given.
        let mut refused = Ok(());
        for action in actions {
            match action {
                Action::Arm(_) | Action::Give(..) if refused.is_err() => {}
                Action::Record(Entry::Given { .. }) if refused.is_err() => {}
                Action::Arm(at) => refused = self.arm(at),
                Action::Give(channel, level) => refused = self.set_level(channel, level),
                Action::Record(entry) => self.record(&entry)?,
                Action::Write => self.store_wearer()?,
                Action::Tell(refusal) => self.notify_refusal(&refusal),
                Action::Abort => {
                    let view = self.view();
                    return Err(CalibrationError::Aborted(describe_position(&view)));
                }
            }
        }
        refused
    }

    fn record(&mut self, entry: &Entry) -> Result<(), CalibrationError> {
        let t_s = self.t_us() as f64 / 1e6;
        if matches!(entry, Entry::Given { .. }) {
            self.given += 1;
        }
        self.journal.add(t_s, entry)?;
        let view = self.view();
        self.desk
            .operator
            .notify(OperatorNotice::Recorded(entry), &view);
        Ok(())
    }

    fn store_wearer(&mut self) -> Result<(), CalibrationError> {
        if let Some(electrodes) = self.machine.write_wearer_file()? {
            self.record(&Entry::Written { electrodes })?;
            let view = self.view();
            self.desk.operator.notify(OperatorNotice::Written, &view);
        }
        Ok(())
    }

    /// Reads the instrument and the reactions of a simulated wearer, if a reading is due.
    fn read_instrument(&mut self) {
        let now_us = self.client.port().now_us();
        if now_us < self.read_us {
            return;
        }
        self.read_us = now_us + READ_US;
        let t_us = self.t_us();
        let is_on = self.machine.is_stimulating();
        let Some(world) = self.client.port().world() else {
            return;
        };
        // Readings are taken now, because the output of long ago is not kept.
        let (reading, moving) = (world.body.instrument_n(), world.body.visible_movements());
        self.seen.complains = world.body.is_complaining();
        self.seen.reading_n = reading;
        if is_on {
            self.seen.moving = moving;
        }
        if let Some(n) = reading {
            self.instrument.add_reading(t_us, n, is_on);
        }
    }

    fn judge_movement(&mut self) -> Result<(), CalibrationError> {
        self.seen.judged = self.instrument.judge()?;
        if let Some(judged) = self.seen.judged {
            let channel = self.machine.view(0).channel;
            self.record(&Entry::Judged {
                channel,
                moved: judged.moved,
                deviation_n: judged.deviation_n,
                bound_n: judged.bound_n,
            })?;
        }
        Ok(())
    }

    fn clear_observations(&mut self) {
        self.seen.judged = None;
        self.seen.moving.clear();
    }

    fn view(&mut self) -> View {
        let t_us = self.t_us();
        let view = self.machine.view(t_us);
        View {
            reading_n: self.seen.reading_n,
            is_rested: self.seen.reading_n.is_none() || self.instrument.has_baseline(),
            judged: self.seen.judged,
            moving: self.seen.moving.clone(),
            complains: self.seen.complains,
            ..view
        }
    }
}

/// Returns the host silence after which the device ends stimulation, ms. It is the same in the
/// sessions of all electrodes.
fn host_timeout_ms(sessions: &[Session]) -> u16 {
    let first = sessions.first();
    first.map_or(HOST_TIMEOUT_MS, |session| session.wearer.host_timeout_ms)
}

/// Describes the present place in the procedure, for example "electrode 2 of 5 (channel 3),
/// threshold".
fn describe_position(view: &View) -> String {
    match view.phase {
        Phase::Done => "the end".to_owned(),
        _ => format!(
            "electrode {} of {} (channel {}), {}",
            view.electrode,
            view.of,
            view.channel,
            view.step.name()
        ),
    }
}
