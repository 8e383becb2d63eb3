//! An operator who looks at the limb, without an instrument.

use host_core::calibration::{Auto, Operator, OperatorLoss, Order, Step, View};

/// Operator of a calibration who sees movements, and expects the one that the plan names as the
/// electrode's place.
///
/// The electrode is placed, and the threshold reached, when the expected movement is seen. A level
/// at which anything else moves is not accepted. The threshold becomes the minimum and the limit
/// the maximum, as with [`Auto`].
#[derive(Clone, Copy, Debug, Default)]
pub struct ByEye;

impl ByEye {
    /// Returns the order that suits this view; `None` if there is nothing to do at present.
    #[must_use]
    pub fn decide(view: &View) -> Option<Order> {
        if view.question.is_none() {
            return Auto::decide(view);
        }
        let is_expected = view.moving.contains(&view.place.as_str());
        let is_alone = view.moving.iter().all(|name| *name == view.place);
        let is_yes = match view.step {
            Step::Points => return Auto::decide(view),
            Step::Placement => is_expected && is_alone,
            Step::Threshold => is_expected,
            Step::Comfort => is_alone,
            Step::Minimum | Step::Maximum => true,
        };
        Some(if is_yes { Order::Yes } else { Order::No })
    }
}

impl Operator for ByEye {
    fn orders(&mut self, view: &View) -> Result<Vec<Order>, OperatorLoss> {
        Ok(Self::decide(view).into_iter().collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_expected_movement_alone_is_accepted() {
        let answer = |step, moving: &[&'static str]| {
            ByEye::decide(&View {
                step,
                place: "index flexion".to_owned(),
                moving: moving.to_vec(),
                question: Some(step.question()),
                ..View::default()
            })
        };
        let (index, both) = (["index flexion"], ["index flexion", "thumb flexion"]);
        for (step, moving, order) in [
            (Step::Placement, &index[..], Order::Yes),
            (Step::Placement, &both[..], Order::No),
            (Step::Placement, &[], Order::No),
            (Step::Threshold, &index[..], Order::Yes),
            (Step::Threshold, &both[1..], Order::No),
            (Step::Comfort, &index[..], Order::Yes),
            (Step::Comfort, &both[..], Order::No),
            (Step::Maximum, &index[..], Order::Yes),
        ] {
            assert_eq!(answer(step, moving), Some(order), "{step:?} {moving:?}");
        }
    }
}
