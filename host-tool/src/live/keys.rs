//! Keys of the dashboard and their orders.

use crossterm::event::{KeyCode, KeyEvent, KeyEventKind, KeyModifiers};

/// Command that a person gives by a key.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Order {
    /// Stop stimulating and quit.
    Quit,
    /// Stop stimulating now.
    Stop,
    /// Acknowledge a fault.
    Acknowledge,
}

/// Returns the command of `key`; `None` if the key has no command. A raw terminal sends Ctrl-C as a
/// key.
pub fn order_for_key(key: KeyEvent) -> Option<Order> {
    if key.kind == KeyEventKind::Release {
        return None;
    }
    match key.code {
        KeyCode::Char('c' | 'd') if key.modifiers.contains(KeyModifiers::CONTROL) => {
            Some(Order::Quit)
        }
        KeyCode::Char('q' | 'Q') | KeyCode::Esc => Some(Order::Quit),
        KeyCode::Char(' ') => Some(Order::Stop),
        KeyCode::Char('a' | 'A') if key.kind == KeyEventKind::Press => Some(Order::Acknowledge),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pressed(code: KeyCode) -> Option<Order> {
        order_for_key(KeyEvent::new(code, KeyModifiers::NONE))
    }

    #[test]
    fn keys_order_what_the_footer_says() {
        assert_eq!(pressed(KeyCode::Char('q')), Some(Order::Quit));
        assert_eq!(pressed(KeyCode::Esc), Some(Order::Quit));
        assert_eq!(pressed(KeyCode::Char(' ')), Some(Order::Stop));
        assert_eq!(pressed(KeyCode::Char('a')), Some(Order::Acknowledge));
        for other in [
            KeyCode::Enter,
            KeyCode::Char('c'),
            KeyCode::Char('x'),
            KeyCode::Up,
        ] {
            assert_eq!(pressed(other), None);
        }
        let interrupt = KeyEvent::new(KeyCode::Char('c'), KeyModifiers::CONTROL);
        assert_eq!(order_for_key(interrupt), Some(Order::Quit));
    }

    #[test]
    fn a_held_key_stops_but_does_not_acknowledge_and_a_release_does_nothing() {
        let with = |code, kind| KeyEvent::new_with_kind(code, KeyModifiers::NONE, kind);
        assert_eq!(
            order_for_key(with(KeyCode::Char(' '), KeyEventKind::Repeat)),
            Some(Order::Stop)
        );
        assert_eq!(
            order_for_key(with(KeyCode::Char('a'), KeyEventKind::Repeat)),
            None
        );
        assert_eq!(
            order_for_key(with(KeyCode::Char(' '), KeyEventKind::Release)),
            None
        );
    }
}
