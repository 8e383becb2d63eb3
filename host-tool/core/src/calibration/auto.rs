//! Operator that stands in for a person on simulators.

use super::error::OperatorLoss;
use super::{Operator, Order, Phase, Step, View};

/// Operator that follows the instrument and the simulated wearer: it raises when it may, answers as
/// the instrument judged, and takes threshold and limit as minimum and maximum. It is for
/// simulators alone; on a board a person must be asked.
#[derive(Clone, Copy, Debug, Default)]
pub struct Auto;

impl Auto {
    /// Returns the order for this view; `None` if there is nothing to order now.
    #[must_use]
    pub fn decide(view: &View) -> Option<Order> {
        if view.complains && view.given.0 > 0 {
            return Some(Order::TooMuch);
        }
        if view.question.is_some() {
            return Some(Self::answer(view));
        }
        if view.phase != Phase::Ready || !view.is_rested {
            return None;
        }
        let is_chosen = matches!(view.step, Step::Minimum | Step::Maximum | Step::Points);
        Some(match (view.raise, view.again) {
            (_, Some(_)) if is_chosen || view.confirms => Order::Again,
            (Some(_), _) => Order::Raise,
            _ => Order::Skip,
        })
    }

    fn answer(view: &View) -> Order {
        let moved = view.judged.is_some_and(|judged| judged.moved);
        match view.step {
            Step::Points => Order::Moves {
                moves: view.moving.iter().map(|&name| name.to_owned()).collect(),
            },
            Step::Placement | Step::Threshold if !moved => Order::No,
            _ => Order::Yes,
        }
    }
}

impl Operator for Auto {
    fn orders(&mut self, view: &View) -> Result<Vec<Order>, OperatorLoss> {
        Ok(Self::decide(view).into_iter().collect())
    }
}
