//! Who orders: a person at a terminal, another program, or nobody on a simulator.

use super::error::Gone;
use super::{Entry, Order, Refusal, View};

/// What an operator is told beside the view.
#[derive(Clone, Copy, Debug)]
pub enum Told<'a> {
    /// Something was recorded.
    Recorded(&'a Entry),
    /// An order was not carried out, or what it led to is not possible.
    Refused(&'a Refusal),
    /// The wearer file was written.
    Written,
}

/// Who orders. Never waits: the device must hear of its host meanwhile.
pub trait Operator {
    /// What is to be seen now, asked for every 5 ms; what is to be done now, in this order.
    /// What raises or answers was ordered after the state that it is for was shown.
    ///
    /// # Errors
    /// Nobody is there any more.
    fn orders(&mut self, view: &View) -> Result<Vec<Order>, Gone>;

    /// Something happened.
    fn tell(&mut self, _told: Told<'_>, _view: &View) {}
}

impl<O: Operator + ?Sized> Operator for &mut O {
    fn orders(&mut self, view: &View) -> Result<Vec<Order>, Gone> {
        (**self).orders(view)
    }

    fn tell(&mut self, told: Told<'_>, view: &View) {
        (**self).tell(told, view);
    }
}
