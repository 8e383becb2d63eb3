//! Operators: a person at a terminal, another program, or a stand-in on a simulator.

use super::error::OperatorLoss;
use super::{Entry, Order, Refusal, View};

/// Message to an operator, in addition to the view.
#[derive(Clone, Copy, Debug)]
pub enum OperatorNotice<'a> {
    /// An entry was recorded in the journal.
    Recorded(&'a Entry),
    /// An order was not carried out, or its consequence is not possible.
    Refused(&'a Refusal),
    /// The wearer file was written.
    Written,
}

/// Source of orders. Its methods must never wait, because keep-alives must be sent meanwhile.
pub trait Operator {
    /// Takes the present view, and returns the orders to carry out now, in this order. It is called
    /// every 5 ms. An order that raises or answers must have been given after the state that it
    /// refers to was shown.
    ///
    /// # Errors
    /// Nobody can order any more.
    fn orders(&mut self, view: &View) -> Result<Vec<Order>, OperatorLoss>;

    /// Receives a message.
    fn notify(&mut self, _told: OperatorNotice<'_>, _view: &View) {}
}

impl<O: Operator + ?Sized> Operator for &mut O {
    fn orders(&mut self, view: &View) -> Result<Vec<Order>, OperatorLoss> {
        (**self).orders(view)
    }

    fn notify(&mut self, told: OperatorNotice<'_>, view: &View) {
        (**self).notify(told, view);
    }
}
