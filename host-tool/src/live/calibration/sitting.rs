//! Who sits at the terminal, for both threads: keys in, orders out, and what is shown.

use super::typed::PendingInput;
use super::{InputLimiter, ScreenState, State, calibration_order, early_refusal, select_orders};
use crossterm::event::KeyEvent;
use host_core::calibration::{
    Level, Operator, OperatorLoss, OperatorNotice, Order, Refusal, Step, View,
};
use host_core::link::{Interruption, Signal};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Most keys of one turn that are typed: more is a paste, where nobody says so.
const TYPED: usize = 4;

/// What the thread at the device and the thread at the terminal share.
#[derive(Debug, Default)]
pub struct SharedTerminal {
    /// What is shown.
    pub sight: ScreenState,
    inlet: InputLimiter,
    typed: PendingInput,
    /// What was pressed since the last turn, and whether it is for what is shown.
    pressed: Vec<(KeyEvent, bool)>,
    state: Option<State>,
    /// The state's, from 1.
    number: u64,
    /// That is on the terminal.
    shown: Option<u64>,
    is_small: bool,
    has_left: bool,
}

impl SharedTerminal {
    /// At this sight.
    #[must_use]
    pub fn new(sight: ScreenState) -> Self {
        let rest = Self::default();
        Self { sight, ..rest }
    }

    /// What is to be drawn, and the number of its state.
    #[must_use]
    pub fn snapshot(&self) -> (ScreenState, u64) {
        (self.sight.clone(), self.number)
    }

    /// What was pressed until now is not for state `number`, which is on the terminal next;
    /// on one that `is_small` it cannot be seen.
    pub fn mark_shown(&mut self, number: u64, is_small: bool) {
        let shown = Some(number).filter(|_| !is_small);
        if self.shown != shown {
            self.read_keys(false);
            self.pressed.iter_mut().for_each(|key| key.1 = false);
            (self.shown, self.is_small) = (shown, is_small);
        }
    }

    /// The terminal takes nothing: what is on it is not what it should be.
    pub const fn mark_hidden(&mut self) {
        self.shown = None;
    }

    /// The terminal has gone.
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

    /// What was pressed, as orders.
    fn pressed_orders(&mut self, view: &View) -> Vec<(Order, bool)> {
        let pressed = std::mem::take(&mut self.pressed);
        let is_typing = view.question.is_some() && view.step == Step::Points;
        let mut is_for_this = is_typing || pressed.len() <= TYPED;
        let mut asked = Vec::new();
        for (key, is_shown) in pressed {
            is_for_this &= is_shown;
            let order = match is_for_this {
                true => calibration_order(key, view, &mut self.sight.typed),
                // Nobody typed a name before it was asked for.
                false => calibration_order(key, &View::default(), &mut String::new()),
            };
            if let Some(order) = order {
                let lowers = order.lowers();
                asked.push((order, is_for_this));
                // What follows is for what comes of it.
                is_for_this &= lowers;
            }
        }
        asked
    }
}

/// The operator behind the terminal, for the thread at the device.
pub struct TerminalOperator<'a> {
    /// Who sits there.
    pub sitting: &'a Mutex<SharedTerminal>,
    /// Asked to end when the terminal has gone.
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
                // As the system says it, to those whose terminal it is.
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
