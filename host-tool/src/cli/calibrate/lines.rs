//! Lets another program give the orders of a calibration: JSON lines on standard input and output.

use crate::live::{
    AT_ONCE, InputLimiter, State, discard_unread_output, early_refusal, select_orders,
    write_available,
};
use host_core::calibration::{
    Level, Operator, OperatorLoss, OperatorNotice, Order, OrderError, PartialLine, Phase, View,
};
use serde_json::{Value, json};
use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// Largest number of lines that may wait until the other program reads them.
const UNREAD: usize = 1024;

/// Largest number of refused orders in one turn that are reported one by one; the others are
/// reported together.
const TOLD: usize = 16;

/// Time for which the last lines, at the end of a calibration, wait for a reader.
const LAST: Duration = Duration::from_secs(1);

/// Operator who sends orders and receives views as lines of JSON. Each turn reads and writes as
/// much as is possible without waiting, so a slow program never delays the device.
#[derive(Default)]
pub struct Lines {
    inlet: InputLimiter,
    unread: PartialLine,
    /// Orders received since the last turn, each with whether the operator gave it after the
    /// present state was shown.
    asked: Vec<(Order, bool)>,
    nonsense: Vec<OrderError>,
    /// Lines that wait to be written, each with whether it shows the present state.
    told: VecDeque<(Vec<u8>, bool)>,
    shown: Option<ShownState>,
    state: Option<State>,
    /// Whether the state was written after all earlier input was read.
    is_shown: bool,
}

/// Parts of a view that are reported again when they change, besides the state: the phase, whether
/// the muscle is rested, whether the wearer complains.
type ShownState = (Phase, bool, bool);

impl Lines {
    /// Reads all waiting input. If `is_late`, the orders that it contains do not refer to the state
    /// that is shown.
    fn read_orders(&mut self, t_s: f64, is_late: bool) {
        let bytes = self.inlet.read_available(t_s);
        let is_last = self.inlet.loss().is_some();
        for line in self.unread.take_lines(&bytes, is_last) {
            match Order::parse(&line) {
                Ok(order) => self.asked.push((order, self.is_shown && !is_late)),
                Err(error) => self.nonsense.push(error),
            }
        }
    }

    /// Queues a line if the state or the shown parts of the view changed.
    fn show(&mut self, view: &View) {
        let state = State::from_view(view);
        let is_new = self.state.as_ref() != Some(&state);
        if is_new {
            (self.state, self.is_shown) = (Some(state), false);
            self.asked.iter_mut().for_each(|asked| asked.1 = false);
            // Unread lines show an earlier state.
            self.told.iter_mut().for_each(|told| told.1 = false);
        }
        let shown = (view.phase, view.is_rested, view.complains);
        if is_new || self.shown.as_ref() != Some(&shown) {
            self.shown = Some(shown);
            self.queue_line(&view_line(view), is_new);
        }
    }

    fn queue_line(&mut self, value: &Value, is_state: bool) {
        self.told
            .push_back((format!("{value}\n").into_bytes(), is_state));
    }

    /// Writes as much as the pipe accepts. Before a state is written completely, all waiting input
    /// is read.
    fn write(&mut self, t_s: f64) -> Result<(), OperatorLoss> {
        while let Some((bytes, is_state)) = self.told.front() {
            let is_shown = *is_state && bytes.len() <= AT_ONCE;
            if is_shown {
                self.read_orders(t_s, true);
            }
            let Some((bytes, _)) = self.told.front_mut() else {
                break;
            };
            let written = write_available(bytes).map_err(|_| OperatorLoss::Unread)?;
            bytes.drain(..written);
            if written == 0 {
                break;
            }
            if bytes.is_empty() {
                self.told.pop_front();
                self.is_shown |= is_shown;
            }
        }
        match self.told.len() > UNREAD {
            true => Err(OperatorLoss::Unread),
            false => Ok(()),
        }
    }

    /// Reports the orders that were not carried out.
    fn report_refused(&mut self, count: usize) {
        for error in std::mem::take(&mut self.nonsense).into_iter().take(TOLD) {
            self.queue_line(&refusal_json(&error.to_string()), false);
        }
        let refusal = refusal_json(&early_refusal(1).to_string());
        (0..count.min(TOLD)).for_each(|_| self.queue_line(&refusal, false));
        if count > TOLD {
            self.queue_line(
                &refusal_json(&early_refusal(count - TOLD).to_string()),
                false,
            );
        }
    }

    /// Writes the last lines, and gives up if nobody reads them.
    pub fn end(mut self) {
        let mut since = Instant::now();
        while let Some((bytes, _)) = self.told.front_mut() {
            match write_available(bytes) {
                Ok(0) if since.elapsed() < LAST => std::thread::sleep(Duration::from_millis(2)),
                Ok(written) if written > 0 => {
                    bytes.drain(..written);
                    since = Instant::now();
                }
                _ => break,
            }
            if bytes.is_empty() {
                self.told.pop_front();
            }
        }
        discard_unread_output(LAST);
    }
}

/// Returns a view as a JSON line, with the orders that it allows.
fn view_line(view: &View) -> Value {
    let mut line = json!(view);
    line["event"] = "view".into();
    line["orders"] = json!(view.allowed_orders());
    line
}

fn refusal_json(error: &str) -> Value {
    json!({ "event": "refused", "error": error })
}

impl Operator for Lines {
    fn orders(&mut self, view: &View) -> Result<Vec<Order>, OperatorLoss> {
        self.read_orders(view.t_s, false);
        self.show(view);
        let asked = std::mem::take(&mut self.asked);
        let (orders, count) = select_orders(asked, view.given > Level(0));
        self.report_refused(count);
        if orders.contains(&Order::Abort) {
            return Ok(orders);
        }
        if let Some(gone) = self.inlet.loss() {
            return Err(gone);
        }
        // Nothing is stimulated that the other program could not have seen.
        write_available(&[]).map_err(|_| OperatorLoss::Unread)?;
        self.write(view.t_s)?;
        Ok(orders)
    }

    fn notify(&mut self, told: OperatorNotice<'_>, view: &View) {
        let message = match told {
            OperatorNotice::Recorded(entry) => {
                json!({ "event": "recorded", "t_s": view.t_s, "entry": entry })
            }
            OperatorNotice::Refused(refusal) => refusal_json(&refusal.to_string()),
            OperatorNotice::Written => json!({ "event": "written" }),
        };
        self.queue_line(&message, false);
    }
}
