//! The procedure alone: properties that hold for any sequence of orders.

use super::scene::plan_with_electrodes;
use host_core::calibration::{Action, Entry, Level, Machine, Order, Phase, Step};
use proptest::prelude::*;

fn order() -> impl Strategy<Value = Order> {
    let moves = Order::Moves {
        moves: vec!["thumb".to_owned()],
    };
    prop_oneof![
        6 => Just(Order::Raise),
        3 => Just(Order::Again),
        2 => Just(Order::Lower),
        5 => Just(Order::Yes),
        4 => Just(Order::No),
        1 => Just(Order::TooMuch),
        1 => Just(Order::Enough),
        1 => Just(Order::Skip),
        3 => Just(moves),
    ]
}

/// Returns an order, or `None` for a stall that invalidates the current level.
fn ordered() -> impl Strategy<Value = Option<Order>> {
    prop_oneof![12 => order().prop_map(Some), 1 => Just(None)]
}

proptest! {
    /// For any orders at any time, and any stalls of this computer: a level rises only after an
    /// order that raises it, never exceeds the ceiling, and a level that was too much never recurs.
    #[test]
    fn nothing_rises_by_itself(orders in proptest::collection::vec((ordered(), 0_u64..1_500_000), 1..200)) {
        let (plan, _) = plan_with_electrodes(2);
        let mut machine = Machine::new(plan, &[]);
        machine.begin();
        let (mut t_us, mut given, mut ceilings) = (0, 0, [24_000_u32; 2]);
        for (order, later_us) in orders {
            t_us += later_us;
            for action in machine.advance_to(t_us) {
                if let Action::Give(_, level) = action {
                    prop_assert_eq!(level, Level(0));
                    given = 0;
                }
            }
            let before = machine.view(t_us);
            let Some(order) = order else {
                machine.discard_level(t_us);
                let after = machine.view(t_us);
                prop_assert!(after.level <= before.level && after.given == Level(0));
                let most = before.level.max(before.raise.unwrap_or_default());
                prop_assert!(after.raise.is_none_or(|raise| raise <= most));
                prop_assert_eq!(after.question, None);
                given = 0;
                continue;
            };
            let Ok(actions) = machine.execute_order(t_us, &order) else {
                let after = machine.view(t_us);
                prop_assert_eq!(before, after, "a refused order changes nothing");
                continue;
            };
            for action in actions {
                match action {
                    Action::Give(channel, level) => {
                        prop_assert!(level.0 <= given || order.raises(), "{order:?}");
                        prop_assert!(level.0 <= ceilings[usize::from(channel - 1)]);
                        given = level.0;
                    }
                    Action::Record(Entry::TooMuch { channel, level }) => {
                        let ceiling = &mut ceilings[usize::from(channel - 1)];
                        *ceiling = (*ceiling).min(level.0.saturating_sub(1));
                    }
                    _ => {}
                }
            }
            for found in machine.results() {
                let (threshold, limit) = (found.threshold, found.limit);
                prop_assert!(limit.is_none() || threshold < limit);
                prop_assert!(found.maximum.is_none() || found.minimum < found.maximum);
                prop_assert!(found.maximum.is_none() || found.maximum <= limit);
            }
            prop_assert_eq!(machine.execute_order(t_us, &Order::Abort), Ok(vec![Action::Abort]));
        }
    }
}

/// Returns a machine that is ready at `step` of its first electrode.
fn at(step: Step) -> (Machine, u64) {
    let (plan, _) = plan_with_electrodes(1);
    let mut machine = Machine::new(plan, &[]);
    machine.begin();
    let mut t_us = 0;
    for _ in 0..100 {
        t_us += 2_000_000;
        machine.advance_to(t_us);
        let view = machine.view(t_us);
        if view.step == step && view.phase == Phase::Ready && view.question.is_none() {
            return (machine, t_us);
        }
        let order = match view.question {
            Some(_) if view.step == Step::Threshold && view.level < Level(9_000) => Order::No,
            Some(_) => Order::Yes,
            None if view.step == Step::Comfort && view.level >= Level(12_000) => Order::Enough,
            None if view.confirms || matches!(view.step, Step::Minimum | Step::Maximum) => {
                Order::Again
            }
            None => Order::Raise,
        };
        machine.execute_order(t_us, &order).unwrap();
        t_us += 1_000_000;
        machine.advance_to(t_us);
    }
    panic!("{step:?} was not reached");
}

#[test]
fn every_refusal_says_what_to_do() {
    let (mut machine, t_us) = at(Step::Threshold);
    let refusal = |machine: &mut Machine, t_us, order: Order| {
        machine.execute_order(t_us, &order).unwrap_err().to_string()
    };
    assert_eq!(
        refusal(&mut machine, t_us, Order::Yes),
        "E671 not now: no question is open"
    );
    machine.execute_order(t_us, &Order::Raise).unwrap();
    assert!(refusal(&mut machine, t_us, Order::Raise).contains("being given"));
    machine.advance_to(t_us + 1_000_000);
    assert!(refusal(&mut machine, t_us + 1_000_000, Order::Raise).contains("answer"));
    machine.execute_order(t_us + 1_000_000, &Order::No).unwrap();
    let soon = refusal(&mut machine, t_us + 1_300_000, Order::Raise);
    assert!(soon.contains("rests for 0.7 s more"), "{soon}");
}

#[test]
fn levels_out_of_order_are_refused_by_name() {
    let (mut machine, t_us) = at(Step::Minimum);
    machine.execute_order(t_us, &Order::Lower).unwrap();
    machine.execute_order(t_us, &Order::Again).unwrap();
    machine.advance_to(t_us + 1_000_000);
    let refusal = machine
        .execute_order(t_us + 1_000_000, &Order::Yes)
        .unwrap_err();
    let message = refusal.to_string();
    assert!(
        message.starts_with("E676 the result of step `minimum`"),
        "{message}"
    );
    assert!(message.contains("below the motor threshold"), "{message}");
}

/// If a level is too much at the maximum, the limit becomes lower and the maximum must be chosen
/// again.
#[test]
fn too_much_later_takes_back_what_was_set() {
    let (mut machine, t_us) = at(Step::Points);
    let limit = machine.results()[0].limit.unwrap();
    machine.execute_order(t_us, &Order::Again).unwrap();
    let actions = machine
        .execute_order(t_us + 300_000, &Order::TooMuch)
        .unwrap();
    assert_eq!(actions.first(), Some(&Action::Give(1, Level(0))));
    let found = &machine.results()[0];
    assert_eq!(found.limit, Some(limit.saturating_sub(Level(500))));
    assert_eq!(found.maximum, None);
    let view = machine.view(t_us + 300_000);
    assert_eq!(
        (view.step, view.top),
        (Step::Maximum, limit.saturating_sub(Level(500)))
    );
}

/// The threshold itself is too much: no such level is given again, and the electrode can be
/// skipped.
#[test]
fn a_threshold_that_is_too_much_leaves_nothing_to_give() {
    let (mut machine, t_us) = at(Step::Minimum);
    let threshold = machine.results()[0].threshold.unwrap();
    machine.execute_order(t_us, &Order::Again).unwrap();
    machine
        .execute_order(t_us + 100_000, &Order::TooMuch)
        .unwrap();
    let later_us = t_us + 5_000_000;
    machine.advance_to(later_us);
    let view = machine.view(later_us);
    assert_eq!((view.step, view.raise), (Step::Comfort, None));
    assert!(view.again.is_none_or(|again| again < threshold), "{view:?}");
    assert!(machine.execute_order(later_us, &Order::Raise).is_err());
    assert!(machine.execute_order(later_us, &Order::Enough).is_err());
    machine.execute_order(later_us, &Order::Skip).unwrap();
    assert!(machine.is_finished());
}

/// A level that a stall interrupted is given again, at every step.
#[test]
fn what_was_cut_short_counts_for_nothing() {
    for step in Step::ALL {
        let (mut machine, t_us) = at(step);
        let ready = machine.view(t_us);
        let order = match ready.raise {
            Some(_) => Order::Raise,
            None => Order::Again,
        };
        machine.execute_order(t_us, &order).unwrap();
        let given = machine.view(t_us).given;
        assert!(given > Level(0), "{step:?}");
        // The stall comes while the level is given, or just after its end.
        for later_us in [500_000, 1_000_000] {
            let mut machine = machine.clone();
            machine.advance_to(t_us + later_us);
            machine.discard_level(t_us + later_us);
            let t_us = t_us + later_us + 1_500_000;
            machine.advance_to(t_us);
            let after = machine.view(t_us);
            assert_eq!(after.phase, Phase::Ready, "{step:?}");
            let same = [(after.level, ready.level), (after.top, ready.top)];
            assert!(
                same.iter().all(|(is, was)| is == was),
                "{step:?}: {after:?}"
            );
            assert_eq!((after.raise, after.again), (ready.raise, ready.again));
            assert_eq!((&after.found, after.question), (&ready.found, None));
            machine.execute_order(t_us, &order).unwrap();
            assert_eq!(machine.view(t_us).given, given, "{step:?}");
        }
    }
}
