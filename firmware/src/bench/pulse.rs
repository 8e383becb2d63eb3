//! Benchmarks of rendering and painting windows, with ten channels at 100 Hz.

use super::{Bench, Checksum, Clock};
use crate::board::wiring::BoardPins;
use crate::pulse::tape::{SLOTS, Window, isolated_words, paint};
use crate::pulse::{
    Burst, BurstTime, CHANNELS, Scheduler, Supply, Train, TrainSpec, WINDOW_US, WindowPlan,
};
use crate::units::{DacCode, Micros, us};

/// Period of the trains, µs: 100 Hz.
const PERIOD_US: u32 = 10_000;

/// Biphasic train of 200 µs per phase at 100 Hz.
pub(super) const TRAIN: TrainSpec = TrainSpec::biphasic(200, 100, PERIOD_US);

/// Supply that allows every pulse.
struct AlwaysAllow;

impl Supply for AlwaysAllow {
    fn burst(&mut self, channel: u8, _: BurstTime) -> Burst {
        Burst::with_own_width(DacCode::new(1000 + u16::from(channel)))
    }
    fn may_pulse(&mut self, _: u8, _: Micros) -> bool {
        true
    }
}

/// Ten trains and the next window.
struct Trains {
    scheduler: Scheduler,
    plan: WindowPlan,
    start: Micros,
    ok: bool,
}

impl Trains {
    /// Creates trains of which channel n starts `offset(n)` µs after the epoch.
    fn new(offset: impl Fn(u32) -> u32) -> Self {
        let mut trains: [Option<Train>; CHANNELS] = [None; CHANNELS];
        for (n, train) in (0u32..).zip(&mut trains) {
            let spec = TrainSpec {
                offset_us: offset(n),
                ..TRAIN
            };
            *train = spec.validate().ok();
        }
        let mut scheduler = Scheduler::new();
        scheduler.start(&trains, &[], Some(0), Micros::new(0));
        Self {
            scheduler,
            plan: WindowPlan::new(),
            start: Micros::new(0),
            ok: true,
        }
    }

    fn render(&mut self) {
        let result = self
            .scheduler
            .render(self.start, &mut AlwaysAllow, &mut self.plan);
        self.ok &= result.is_ok();
        self.start += us(WINDOW_US);
    }

    /// Renders windows until the next window is not quiet.
    fn skip_quiet(&mut self, quiet: impl Fn(u32) -> bool) {
        while quiet(self.start.get() % PERIOD_US) {
            self.render();
        }
    }

    fn digest(&self, sum: &mut Checksum) {
        sum.add_word(u32::from(self.ok));
        for change in &self.plan.changes {
            sum.add_word(u32::from(change.slot));
            sum.add_word(change.levels.0);
        }
        for pulse in &self.plan.pulses {
            sum.add_word(u32::from(pulse.channel));
            sum.add_word(pulse.at.get());
        }
    }
}

pub(super) fn run_benchmarks<C: Clock>(bench: &mut Bench<'_, C>) -> Option<()> {
    let digest = |trains: &Trains, (): &(), sum: &mut Checksum| trains.digest(sum);
    // A window without events: all pulses of the period are over.
    bench.measure(
        "render_idle_window",
        400,
        Trains::new(|n| n),
        |trains, _| trains.skip_quiet(|phase| phase < 750),
        |trains, ()| trains.render(),
        digest,
    );
    // Consecutive windows, with channels spread over the period.
    bench.measure(
        "render_window",
        800,
        Trains::new(|n| n * 997),
        |_, _| (),
        |trains, ()| trains.render(),
        digest,
    );
    // Windows in which all ten channels start, or end a phase, a few µs apart.
    bench.measure(
        "render_window_all_at_once",
        300,
        Trains::new(|n| n * 3),
        |trains, _| trains.skip_quiet(|phase| phase >= 750),
        |trains, ()| trains.render(),
        digest,
    );
    // Painting such a window on an erased tape.
    bench.measure(
        "paint_window",
        300,
        (Trains::new(|n| n * 3), [0; SLOTS], [0; SLOTS]),
        |(trains, first, second), _| {
            trains.skip_quiet(|phase| phase >= 750);
            trains.render();
            trains.plan.pump = true;
            let [on_first, on_second] = isolated_words::<BoardPins>();
            (*first, *second) = ([on_first; SLOTS], [on_second; SLOTS]);
        },
        |(trains, first, second), ()| {
            paint::<BoardPins>(&trains.plan, &mut Window { first, second });
        },
        |(_, first, second), (), sum| {
            first
                .iter()
                .chain(second)
                .for_each(|&word| sum.add_word(word));
        },
    );
    Some(())
}
