//! State that the thread at the device and the thread at the terminal share: keys, orders, contents
//! of the screen.

use super::typed::PendingInput;
use super::{InputLimiter, ScreenState, State, calibration_order, early_refusal, select_orders};
use crossterm::event::KeyEvent;
use host_core::calibration::{
    Level, Operator, OperatorLoss, OperatorNotice, Order, Refusal, Step, View,
};
use host_core::link::{Interruption, Signal};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Largest number of keys in one turn that a person can type; more are pasted text, on terminals
/// that do not report a paste.
const TYPED: usize = 4;

/// State that the thread at the device and the thread at the terminal share.
#[derive(Debug, Default)]
pub struct SharedTerminal {
    /// Contents of the screen.
    pub sight: ScreenState,
    inlet: InputLimiter,
    typed: PendingInput,
    /// Keys since the last turn, each with whether it was pressed after the present state was
    /// shown.
    pressed: Vec<(KeyEvent, bool)>,
    state: Option<State>,
    /// Number of the present state of the calibration, from 1.
    number: u64,
    /// Number of the state that the terminal shows.
    shown: Option<u64>,
    is_small: bool,
    has_left: bool,
}

impl SharedTerminal {
    /// Creates the shared state with these contents of the screen.
    #[must_use]
    pub fn new(sight: ScreenState) -> Self {
        let rest = Self::default();
        Self { sight, ..rest }
    }

    /// Returns the contents to draw, and the number of their state.
    #[must_use]
    pub fn snapshot(&self) -> (ScreenState, u64) {
        (self.sight.clone(), self.number)
    }

    /// Notes that the terminal is about to show the state with this `number`. Keys pressed until
    /// now do not refer to this state. A terminal that `is_small` cannot show the state.
    pub fn mark_shown(&mut self, number: u64, is_small: bool) {
        let shown = Some(number).filter(|_| !is_small);
        if self.shown != shown {
            self.read_keys(false);
            self.pressed.iter_mut().for_each(|key| key.1 = false);
            (self.shown, self.is_small) = (shown, is_small);
        }
    }

    /// Notes that the terminal accepts no output, so that its contents are outdated.
    pub const fn mark_hidden(&mut self) {
        self.shown = None;
    }

    /// Notes that the terminal has closed.
    pub const fn mark_closed(&mut self) {
        self.has_left = true;
    }

    fn read_keys(&mut self, is_turn: bool) {
        let t_s = self.sight.view.as_ref().map_or(0.0, |view| view.t_s);
        let bytes = self.inlet.read_available(t_s);
        let is_shown = self.shown == Some(self.number);
        let keys = self.typed.parse_keys(&bytes, is_turn);
        self.pressed
            .extend(keys.into_iter().map(|key| (key, is_shown)));
    }

    fn orders(&mut self, view: &View) -> Result<Vec<Order>, OperatorLoss> {
        self.read_keys(true);
        let state = State::from_view(view);
        if self.state.as_ref() != Some(&state) {
            self.state = Some(state);
            self.number += 1;
            self.pressed.iter_mut().for_each(|key| key.1 = false);
        }
        self.sight.view = Some(view.clone());
        let asked = self.pressed_orders(view);
        let (orders, count) = select_orders(asked, view.given > Level(0));
        if count > 0 {
            let why = match self.is_small {
                true => Refusal::NotNow("the terminal is too small: 80 x 24 needed".to_owned()),
                false => early_refusal(count),
            };
            self.sight.note(view.t_s, why.to_string(), true);
        }
        match (orders.contains(&Order::Abort), self.inlet.loss()) {
            (true, _) => Ok(orders),
            (false, Some(gone)) => Err(gone),
            (false, None) if self.has_left => Err(OperatorLoss::Unread),
            (false, None) => Ok(orders),
        }
    }

    /// Turns the pressed keys into orders, each with whether it refers to the present state.
    fn pressed_orders(&mut self, view: &View) -> Vec<(Order, bool)> {
        let pressed = std::mem::take(&mut self.pressed);
        let is_typing = view.question.is_some() && view.step == Step::Points;
        let mut is_for_this = is_typing || pressed.len() <= TYPED;
        let mut asked = Vec::new();
        for (key, is_shown) in pressed {
            is_for_this &= is_shown;
            let order = match is_for_this {
                true => calibration_order(key, view, &mut self.sight.typed),
                // Keys pressed before names were requested are no names.
                false => calibration_order(key, &View::default(), &mut String::new()),
            };
            if let Some(order) = order {
                let lowers = order.lowers();
                asked.push((order, is_for_this));
                // Later keys refer to the state after this order.
                is_for_this &= lowers;
            }
        }
        asked
    }
}

/// Operator of the calibration for the thread at the device; the orders come from the keys of the
/// terminal.
pub struct TerminalOperator<'a> {
    /// State shared with the thread at the terminal.
    pub sitting: &'a Mutex<SharedTerminal>,
    /// Receives a hang-up signal when the terminal has closed.
    pub interruption: Interruption,
}

impl TerminalOperator<'_> {
    fn sitting(&self) -> MutexGuard<'_, SharedTerminal> {
        self.sitting.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Operator for TerminalOperator<'_> {
    fn orders(&mut self, view: &View) -> Result<Vec<Order>, OperatorLoss> {
        let orders = self.sitting().orders(view);
        match orders {
            Err(OperatorLoss::Ended | OperatorLoss::Unread) => {
                // A closed terminal counts as SIGHUP.
                self.interruption.raise_signal(Signal::HangUp);
                Ok(Vec::new())
            }
            orders => orders,
        }
    }

    fn notify(&mut self, told: OperatorNotice<'_>, view: &View) {
        self.sitting().sight.add_notice(told, view);
    }
}
