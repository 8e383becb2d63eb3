//! Keys of the calibration and their orders.

use crossterm::event::{KeyCode, KeyEvent, KeyEventKind, KeyModifiers};
use host_core::calibration::{Order, Step, View};

/// Longest line of names that can be typed, characters.
const LONGEST: usize = 200;

/// Returns the operator's command for `key` in this view; `None` if the key has no command. While
/// the view asks for the names of what moved, keys edit the line `typed`; Esc and Ctrl-C still end
/// the calibration. A key that is held down repeats no raise or answer, if the terminal
/// distinguishes repeated keys.
pub fn order(key: KeyEvent, view: &View, typed: &mut String) -> Option<Order> {
    if key.kind == KeyEventKind::Release {
        return None;
    }
    let has_control = key.modifiers.contains(KeyModifiers::CONTROL);
    match key.code {
        KeyCode::Char('c' | 'd') if has_control => return Some(Order::Abort),
        KeyCode::Esc => return Some(Order::Abort),
        _ => {}
    }
    if view.question.is_some() && view.step == Step::Points {
        return edit_names(key.code, typed);
    }
    typed.clear();
    let is_pressed = key.kind == KeyEventKind::Press;
    match key.code {
        KeyCode::Char(' ' | 'q' | 'Q') => Some(Order::Abort),
        KeyCode::Down | KeyCode::Char('-') => Some(Order::Lower),
        KeyCode::Char('t' | 'T') => Some(Order::TooMuch),
        _ if !is_pressed => None,
        KeyCode::Up | KeyCode::Char('+') => Some(Order::Raise),
        KeyCode::Char('a' | 'A') => Some(Order::Again),
        KeyCode::Char('y' | 'Y') => Some(Order::Yes),
        KeyCode::Char('n' | 'N') => Some(Order::No),
        KeyCode::Char('e' | 'E') => Some(Order::Enough),
        KeyCode::Char('x' | 'X') => Some(Order::Skip),
        _ => None,
    }
}

/// Applies a key to the line of names that is being typed. Enter completes the line and returns its
/// names.
fn edit_names(key: KeyCode, typed: &mut String) -> Option<Order> {
    match key {
        KeyCode::Char(c) if typed.chars().count() < LONGEST => typed.push(c),
        KeyCode::Backspace => drop(typed.pop()),
        KeyCode::Enter => {
            let line = std::mem::take(typed);
            let names = line.split(',').map(str::trim);
            let names = names.filter(|name| !name.is_empty());
            let moves = names.map(str::to_owned).collect();
            return Some(Order::Moves { moves });
        }
        _ => {}
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use host_core::calibration::Phase;

    fn pressed(code: KeyCode, view: &View) -> Option<Order> {
        let key = KeyEvent::new(code, KeyModifiers::NONE);
        order(key, view, &mut String::new())
    }

    #[test]
    fn one_key_ends_it_in_every_state() {
        for step in Step::ALL {
            for phase in [Phase::Ready, Phase::On, Phase::Rest, Phase::Done] {
                for question in [None, Some("?")] {
                    let view = View {
                        step,
                        phase,
                        question,
                        ..View::default()
                    };
                    assert_eq!(pressed(KeyCode::Esc, &view), Some(Order::Abort));
                    let control = KeyEvent::new(KeyCode::Char('c'), KeyModifiers::CONTROL);
                    let ended = order(control, &view, &mut String::new());
                    assert_eq!(ended, Some(Order::Abort));
                    if step != Step::Points || question.is_none() {
                        assert_eq!(pressed(KeyCode::Char(' '), &view), Some(Order::Abort));
                        assert_eq!(pressed(KeyCode::Char('q'), &view), Some(Order::Abort));
                        assert_eq!(pressed(KeyCode::Char('t'), &view), Some(Order::TooMuch));
                        assert_eq!(pressed(KeyCode::Down, &view), Some(Order::Lower));
                    }
                }
            }
        }
    }

    #[test]
    fn a_held_key_lowers_and_does_not_raise() {
        let held = |code| KeyEvent::new_with_kind(code, KeyModifiers::NONE, KeyEventKind::Repeat);
        let view = View::default();
        let ordered = |code| order(held(code), &view, &mut String::new());
        assert_eq!(ordered(KeyCode::Up), None);
        assert_eq!(ordered(KeyCode::Char('a')), None);
        assert_eq!(ordered(KeyCode::Char('y')), None);
        assert_eq!(ordered(KeyCode::Down), Some(Order::Lower));
    }

    #[test]
    fn names_are_typed_where_they_are_asked_for() {
        let view = View {
            step: Step::Points,
            question: Some("?"),
            ..View::default()
        };
        let mut typed = String::new();
        for c in "thumb, q yes,".chars() {
            let key = KeyEvent::new(KeyCode::Char(c), KeyModifiers::NONE);
            assert_eq!(order(key, &view, &mut typed), None);
        }
        let enter = KeyEvent::new(KeyCode::Enter, KeyModifiers::NONE);
        let moves = vec!["thumb".to_owned(), "q yes".to_owned()];
        let ordered = order(enter, &view, &mut typed);
        assert_eq!(ordered, Some(Order::Moves { moves }));
        assert_eq!(typed, "");
    }
}
