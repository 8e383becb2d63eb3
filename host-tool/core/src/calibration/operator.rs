//! Who orders: a person at a terminal, another program, or nobody on a simulator.

use super::{Entry, Order, OrderError, Refusal, View};

/// What an operator is told beside the view.
#[derive(Clone, Copy, Debug)]
pub enum Told<'a> {
    /// Something was recorded.
    Recorded(&'a Entry),
    /// An order was not carried out, or what it led to is not possible.
    Refused(&'a Refusal),
    /// What was sent is no order.
    Nonsense(&'a OrderError),
    /// The wearer file was written.
    Written,
}

/// Why no orders come any more.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Gone;

/// Who orders. Never waits: the device must hear of its host meanwhile.
pub trait Operator {
    /// What is to be seen now, asked for every 5 ms; an order if there is one.
    ///
    /// # Errors
    /// Nobody is there any more.
    fn order(&mut self, view: &View) -> Result<Option<Result<Order, OrderError>>, Gone>;

    /// Something happened.
    fn tell(&mut self, _told: Told<'_>, _view: &View) {}
}

impl<O: Operator + ?Sized> Operator for &mut O {
    fn order(&mut self, view: &View) -> Result<Option<Result<Order, OrderError>>, Gone> {
        (**self).order(view)
    }

    fn tell(&mut self, told: Told<'_>, view: &View) {
        (**self).tell(told, view);
    }
}
