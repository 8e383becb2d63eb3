//! Keys of a session that is watched and recorded: pause, intensity, markers.

use super::Order;
use crossterm::event::{KeyCode, KeyEvent, KeyEventKind, KeyModifiers};
use host_core::run::Control;
use std::time::{Duration, Instant};

/// Shortest time between two presses of ↑ that each raise the intensity. A faster repetition comes
/// from a key that is held down or bounces.
const HELD: Duration = Duration::from_millis(150);

/// Time for which the space bar must stay untouched before its next press resumes a paused session.
const SETTLED: Duration = Duration::from_millis(500);

/// Longest text of a marker, characters.
const LONGEST_TEXT: usize = 120;

/// Effect of a key.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Act {
    /// An action on the running session.
    Control(Control),
    /// A command to the program or the device, beside the session.
    Order(Order),
    /// Nothing; the text explains why the key has no effect.
    Note(&'static str),
}

/// The keyboard of a session that is watched and recorded.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Hands {
    /// Channels of the session, from 1, rising.
    pub channels: Vec<u8>,
    /// Index of the selected channel in `channels`.
    pub selected: usize,
    /// Text of the marker that is being typed; `None` while none is typed.
    pub typing: Option<String>,
    /// Intensity of each channel, percent of the session's amplitudes.
    pub intensities: Vec<u16>,
    /// Whether the space bar has paused the session.
    pub is_paused: bool,
    /// Time of the last press of ↑.
    raised: Option<Instant>,
    /// Time of the last press of the space bar.
    spaced: Option<Instant>,
}

impl Hands {
    /// Creates the keyboard's state for these channels, counted from 1, each at an intensity of 100
    /// %.
    #[must_use]
    pub fn new(channels: Vec<u8>) -> Self {
        let intensities = vec![100; channels.len()];
        Self {
            channels,
            intensities,
            ..Self::default()
        }
    }

    /// Returns the selected channel, from 1.
    #[must_use]
    pub fn channel(&self) -> Option<u8> {
        self.channels.get(self.selected).copied()
    }

    /// Returns the effect of `key`, pressed at `now`. Lowering and stopping are never delayed.
    pub fn press(&mut self, key: KeyEvent, now: Instant) -> Option<Act> {
        if key.kind == KeyEventKind::Release {
            return None;
        }
        let is_control = key.modifiers.contains(KeyModifiers::CONTROL);
        if is_control && matches!(key.code, KeyCode::Char('c' | 'd')) {
            return Some(Act::Control(Control::Stop));
        }
        if self.typing.is_some() {
            return self.type_key(key);
        }
        match key.code {
            KeyCode::Char('q' | 'Q') | KeyCode::Esc => Some(Act::Control(Control::Stop)),
            KeyCode::Char(' ') => self.press_space(key.kind, now),
            KeyCode::Up => self.press_up(key.kind, now),
            KeyCode::Down => Some(Act::Control(Control::Lower(self.channel()?))),
            KeyCode::Left => {
                self.selected = self.selected.saturating_sub(1);
                None
            }
            KeyCode::Right => {
                let last = self.channels.len().saturating_sub(1);
                self.selected = (self.selected + 1).min(last);
                None
            }
            KeyCode::Char('m' | 'M') => {
                self.typing = Some(String::new());
                None
            }
            _ => None,
        }
    }

    fn press_space(&mut self, kind: KeyEventKind, now: Instant) -> Option<Act> {
        let before = self.spaced.replace(now);
        if !self.is_paused {
            self.is_paused = true; // until the session reports its state
            return Some(Act::Control(Control::Pause));
        }
        let is_settled = before.is_none_or(|at| now.duration_since(at) >= SETTLED);
        if kind == KeyEventKind::Press && is_settled {
            return Some(Act::Control(Control::Resume));
        }
        Some(Act::Note(
            "paused; release the space bar for half a second, then press it to resume",
        ))
    }

    fn press_up(&mut self, kind: KeyEventKind, now: Instant) -> Option<Act> {
        let before = self.raised.replace(now);
        let is_held = before.is_some_and(|at| now.duration_since(at) < HELD);
        if is_held || kind == KeyEventKind::Repeat {
            return Some(Act::Note(
                "↑ is held down; release it: one press is one step",
            ));
        }
        Some(Act::Control(Control::Raise(self.channel()?)))
    }

    /// Adds a key to a marker's text.
    fn type_key(&mut self, key: KeyEvent) -> Option<Act> {
        let text = self.typing.as_mut()?;
        match key.code {
            KeyCode::Enter => {
                let text = self.typing.take()?;
                Some(Act::Control(Control::Mark(text)))
            }
            KeyCode::Esc => {
                self.typing = None;
                None
            }
            KeyCode::Backspace => {
                text.pop();
                None
            }
            KeyCode::Char(character) if !character.is_control() => {
                if text.chars().count() >= LONGEST_TEXT {
                    return Some(Act::Note("a marker's text has 120 characters at most"));
                }
                text.push(character);
                None
            }
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Keyboard {
        hands: Hands,
        now: Instant,
    }

    impl Keyboard {
        fn new() -> Self {
            let hands = Hands::new(vec![2, 5]);
            let now = Instant::now();
            Self { hands, now }
        }

        fn after(&mut self, ms: u64, code: KeyCode) -> Option<Act> {
            self.now += Duration::from_millis(ms);
            self.hands
                .press(KeyEvent::new(code, KeyModifiers::NONE), self.now)
        }
    }

    #[test]
    fn a_held_arrow_raises_by_its_first_press_and_falls_as_long_as_it_is_held() {
        let mut keyboard = Keyboard::new();
        let raise = Some(Act::Control(Control::Raise(2)));
        assert_eq!(keyboard.after(0, KeyCode::Up), raise);
        for _ in 0..100 {
            let held = keyboard.after(30, KeyCode::Up);
            assert!(matches!(held, Some(Act::Note(_))), "{held:?}");
        }
        assert_eq!(keyboard.after(150, KeyCode::Up), raise);
        for _ in 0..100 {
            let lower = Some(Act::Control(Control::Lower(2)));
            assert_eq!(keyboard.after(1, KeyCode::Down), lower);
        }
    }

    #[test]
    fn a_held_space_bar_pauses_and_does_not_resume() {
        let mut keyboard = Keyboard::new();
        let space = KeyCode::Char(' ');
        let pause = Some(Act::Control(Control::Pause));
        assert_eq!(keyboard.after(0, space), pause);
        for _ in 0..100 {
            assert!(matches!(keyboard.after(30, space), Some(Act::Note(_))));
        }
        let resume = Some(Act::Control(Control::Resume));
        assert_eq!(keyboard.after(500, space), resume);
        keyboard.hands.is_paused = false; // as the session reports
        assert_eq!(keyboard.after(1, space), pause);
    }

    #[test]
    fn channels_are_selected_and_texts_are_typed() {
        let mut keyboard = Keyboard::new();
        keyboard.after(0, KeyCode::Right);
        keyboard.after(0, KeyCode::Right);
        assert_eq!(keyboard.hands.channel(), Some(5));
        assert_eq!(
            keyboard.after(0, KeyCode::Up),
            Some(Act::Control(Control::Raise(5)))
        );
        keyboard.after(0, KeyCode::Left);
        assert_eq!(keyboard.hands.channel(), Some(2));
        for code in ['m', 'q', ' ', 'x'].map(KeyCode::Char) {
            assert_eq!(keyboard.after(0, code), None);
        }
        keyboard.after(0, KeyCode::Backspace);
        let marked = Some(Act::Control(Control::Mark("q ".to_owned())));
        assert_eq!(keyboard.after(0, KeyCode::Enter), marked);
        let stop = Some(Act::Control(Control::Stop));
        assert_eq!(keyboard.after(0, KeyCode::Char('q')), stop);
        keyboard.after(0, KeyCode::Char('m'));
        for _ in 0..LONGEST_TEXT {
            assert_eq!(keyboard.after(0, KeyCode::Char('é')), None);
        }
        let full = keyboard.after(0, KeyCode::Char('é'));
        assert!(matches!(full, Some(Act::Note(_))), "{full:?}");
        let interrupt = KeyEvent::new(KeyCode::Char('c'), KeyModifiers::CONTROL);
        assert_eq!(keyboard.hands.press(interrupt, keyboard.now), stop);
    }
}
