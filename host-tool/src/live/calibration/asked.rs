//! Decides which of several simultaneous orders are carried out.

use crate::live::stream;
use host_core::calibration::{Level, OperatorLoss, Order, Phase, Refusal, Step, View};

/// Largest input in one second of device time, bytes; a person never orders so much.
const MOST: usize = 1 << 18;

/// State of the calibration to which a raise or an answer refers. Each state allows one of these
/// orders, and only if the operator gave it after the state was shown.
#[derive(Clone, PartialEq, Debug)]
pub struct State {
    electrode: usize,
    step: Step,
    phase: Phase,
    level: Level,
    raise: Option<Level>,
    again: Option<Level>,
    question: Option<&'static str>,
    confirms: bool,
}

impl State {
    /// Returns the state that this view shows.
    #[must_use]
    pub fn from_view(view: &View) -> Self {
        Self {
            electrode: view.electrode,
            step: view.step,
            // A question stays the same while the muscle rests and afterwards.
            phase: match view.question {
                Some(_) => Phase::Rest,
                None => view.phase,
            },
            level: view.level,
            raise: view.raise,
            again: view.again,
            question: view.question,
            confirms: view.confirms,
        }
    }
}

/// Reader of the operator's input. Closes the input if more bytes come within a second than a
/// person could ever send.
#[derive(Debug, Default)]
pub struct InputLimiter {
    second: u64,
    taken: usize,
    gone: Option<OperatorLoss>,
}

impl InputLimiter {
    /// Reads the waiting bytes; `t_s` is the device time.
    pub fn read_available(&mut self, t_s: f64) -> Vec<u8> {
        let mut bytes = Vec::new();
        if self.gone.is_some() {
            return bytes;
        }
        if self.second != t_s as u64 {
            (self.second, self.taken) = (t_s as u64, 0);
        }
        let goes_on = stream::read_available(&mut bytes, (MOST + 1).saturating_sub(self.taken));
        self.taken += bytes.len();
        if self.taken > MOST {
            self.gone = Some(OperatorLoss::Flooded);
        } else if !goes_on {
            self.gone = Some(OperatorLoss::Ended);
        }
        bytes
    }

    /// Returns the reason why the input has ended, if it has.
    #[must_use]
    pub const fn loss(&self) -> Option<OperatorLoss> {
        self.gone
    }
}

/// Selects the orders to carry out, and returns them with the number of refused orders. `asked`
/// holds the orders in the sequence of their arrival, each with whether it came after the present
/// state was shown. An order that ends stimulation or lowers the level comes first, however late it
/// arrived. Of the other orders only the first is carried out, and only if no order ends or lowers.
#[must_use]
pub fn select_orders(asked: Vec<(Order, bool)>, is_on: bool) -> (Vec<Order>, usize) {
    let has = |wanted: Order| asked.iter().any(|(order, _)| *order == wanted);
    if has(Order::Abort) {
        return (vec![Order::Abort], 0);
    }
    let mut done = Vec::new();
    // Only once: a second one would refer to the level below.
    done.extend(has(Order::TooMuch).then_some(Order::TooMuch));
    done.extend((is_on && has(Order::Skip)).then_some(Order::Skip));
    let (stops, rest): (Vec<_>, Vec<_>) = (asked.into_iter())
        .partition(|(order, _)| order.lowers() || (is_on && *order == Order::Skip));
    let lower = stops.into_iter().map(|(order, _)| order);
    done.extend(lower.filter(|order| *order == Order::Lower));
    let count = rest.len();
    if done.is_empty()
        && let Some((order, true)) = rest.into_iter().next()
    {
        return (vec![order], count - 1);
    }
    (done, count)
}

/// Returns the refusal of `count` orders that came too early or together with another order.
#[must_use]
pub fn early_refusal(count: usize) -> Refusal {
    let subject = match count {
        1 => "this order".to_owned(),
        _ => format!("{count} orders"),
    };
    Refusal::NotNow(format!(
        "{subject} came before the present state was shown, or together with another order; give \
         one order for each state"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sifted(asked: &[(Order, bool)], is_on: bool) -> (Vec<Order>, usize) {
        select_orders(asked.to_vec(), is_on)
    }

    #[test]
    fn what_lowers_or_ends_overtakes_everything() {
        let mut asked = vec![(Order::Raise, true); 3000];
        asked.push((Order::Lower, false));
        asked.push((Order::Lower, false));
        let two = vec![Order::Lower, Order::Lower];
        assert_eq!(sifted(&asked, true), (two, 3000));
        asked.push((Order::TooMuch, false));
        asked.push((Order::TooMuch, false));
        let orders = vec![Order::TooMuch, Order::Lower, Order::Lower];
        assert_eq!(sifted(&asked, true), (orders, 3000));
        asked.push((Order::Skip, false));
        assert_eq!(sifted(&asked, true).0[..2], [Order::TooMuch, Order::Skip]);
        assert_eq!(sifted(&asked, false).1, 3001);
        asked.push((Order::Abort, false));
        assert_eq!(sifted(&asked, true), (vec![Order::Abort], 0));
    }

    #[test]
    fn one_order_for_what_is_shown_and_none_from_before() {
        let raise = vec![Order::Raise];
        assert_eq!(sifted(&[(Order::Raise, true)], false), (raise.clone(), 0));
        assert_eq!(sifted(&[(Order::Raise, false)], false), (vec![], 1));
        let two = [(Order::Raise, true), (Order::No, true)];
        assert_eq!(sifted(&two, false), (raise, 1));
        let late = [(Order::No, false), (Order::Raise, true)];
        assert_eq!(sifted(&late, false), (vec![], 2));
        assert_eq!(sifted(&[(Order::Skip, false)], false), (vec![], 1));
    }
}
