//! Operator that stands in for a person on simulators.

use super::error::OperatorLoss;
use super::{Operator, Order, Phase, Step, View};

/// Operator that stands in for a person, on simulators only. It raises the level when it may, and
/// answers according to the instrument and the simulated wearer. It takes the threshold as the
/// minimum and the limit as the maximum. On a board, a person must be asked.
#[derive(Clone, Copy, Debug, Default)]
pub struct Auto;

impl Auto {
    /// Returns the command that suits this view; `None` if there is nothing to do at present.
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
