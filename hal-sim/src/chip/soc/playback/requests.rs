//! Schedule of TIM1's requests to DMA2: each event once per lap of the counter.

use crate::chip::Cycle;
use crate::chip::soc::dma::{EVENTS, NEVER};

/// Schedule of the TIM1 events that request DMA2. It repeats with each lap, the period of TIM1.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Requests {
    /// Next cycle of each event, in the order of one lap. Only the first `asking` entries are used.
    due: [Cycle; EVENTS],
    /// Number of the event (0 is the update, then channels 1–4) for each entry of `due`.
    events: [usize; EVENTS],
    /// Number of events that request DMA.
    asking: usize,
    /// Index in `due` and `events` of the next event.
    cursor: usize,
    lap: u64,
}

impl Requests {
    pub(super) const NONE: Self = Self {
        due: [NEVER; EVENTS],
        events: [0; EVENTS],
        asking: 0,
        cursor: 0,
        lap: 0,
    };

    /// Creates a schedule in which the cycles `due` (NEVER for an event without requests) repeat
    /// every `lap` cycles; all of them must lie within one lap.
    pub(super) fn new(due: [Cycle; EVENTS], lap: u64) -> Self {
        let mut requests = Self { lap, ..Self::NONE };
        let mut order: [usize; EVENTS] = std::array::from_fn(|event| event);
        order.sort_by_key(|&event| due[event]);
        for event in order.into_iter().filter(|&event| due[event] != NEVER) {
            requests.due[requests.asking] = due[event];
            requests.events[requests.asking] = event;
            requests.asking += 1;
        }
        requests
    }

    /// Returns the next cycle and event; NEVER if there are no requests.
    #[inline]
    pub(super) fn next(&self) -> (Cycle, usize) {
        (self.due[self.cursor], self.events[self.cursor])
    }

    /// Returns the cycle of the event after the next.
    #[inline]
    pub(super) fn following(&self) -> Cycle {
        let after = self.cursor + 1;
        if after < self.asking {
            self.due[after]
        } else {
            self.due[0].saturating_add(if self.asking == 1 { self.lap } else { 0 })
        }
    }

    /// Returns the number of events with requests, and the cycles of a lap.
    #[inline]
    pub(super) const fn lap(&self) -> (usize, u64) {
        (self.asking, self.lap)
    }

    /// Advances all events by `laps` laps.
    pub(super) fn skip(&mut self, laps: u64) {
        for due in &mut self.due[..self.asking] {
            *due += laps * self.lap;
        }
    }

    /// Marks the next event as past: it recurs one lap later.
    #[inline]
    pub(super) fn pass(&mut self) {
        self.due[self.cursor] += self.lap;
        self.cursor += 1;
        if self.cursor >= self.asking {
            self.cursor = 0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn events_come_in_order_and_again_a_lap_later() {
        let mut requests = Requests::new([168, 8, NEVER, 32, 8], 168);
        let mut seen = Vec::new();
        for _ in 0..6 {
            let following = requests.following();
            seen.push(requests.next());
            requests.pass();
            assert_eq!(requests.next().0, following);
        }
        let expected = [(8, 1), (8, 4), (32, 3), (168, 0), (176, 1), (176, 4)];
        assert_eq!(seen, expected);
        requests.skip(10);
        assert_eq!(requests.next(), (200 + 1680, 3));
        let mut single_request = Requests::new([NEVER, 5, NEVER, NEVER, NEVER], 10);
        assert_eq!(
            (single_request.next(), single_request.following()),
            ((5, 1), 15)
        );
        single_request.pass();
        assert_eq!(
            (single_request.next(), single_request.following()),
            ((15, 1), 25)
        );
        assert_eq!(Requests::NONE.next().0, NEVER);
    }
}
