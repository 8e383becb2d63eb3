//! Operators: a person at a terminal, another program, or a stand-in on a simulator.

use super::error::OperatorLoss;
use super::{Entry, Order, Refusal, View};

/// Message to an operator, in addition to the view of the present state.
#[derive(Clone, Copy, Debug)]
pub enum OperatorNotice<'a> {
    /// This entry was added to the journal.
    Recorded(&'a Entry),
    /// A command was not carried out, or the result of a step was refused.
    Refused(&'a Refusal),
    /// The wearer file was written.
    Written,
}

/// Source of an operator's commands. Its methods must return without waiting, because keep-alives
/// must be sent meanwhile.
pub trait Operator {
    /// Receives the present view, and returns the commands to carry out now, the first one first.
    /// The calibration calls this function every 5 ms. A command that raises a level or answers a
    /// question must have been given after the operator saw the state that it refers to.
    ///
    /// # Errors
    /// No more commands can come from the operator.
    fn orders(&mut self, view: &View) -> Result<Vec<Order>, OperatorLoss>;

    /// Receives a message with the present view. The default implementation ignores it.
    fn notify(&mut self, _told: OperatorNotice<'_>, _view: &View) {}
}

impl<O: Operator + ?Sized> Operator for &mut O {
    fn orders(&mut self, view: &View) -> Result<Vec<Order>, OperatorLoss> {
        (**self).orders(view)
    }

    fn notify(&mut self, notice: OperatorNotice<'_>, view: &View) {
        (**self).notify(notice, view);
    }
}
