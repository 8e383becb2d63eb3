//! Rendering and painting of windows, ten channels at 100 Hz.

use super::{Algorithm, Checksum, Random};
use crate::pulse::tape::{ISOLATED_B, ISOLATED_C, SLOTS, Window, paint};
use crate::pulse::{CHANNELS, Scheduler, Shape, Supply, Train, TrainSpec, WINDOW_US, WindowPlan};
use crate::units::{DacCode, Micros};

/// 100 Hz.
const PERIOD_US: u32 = 10_000;

/// 200 µs biphasic at 100 Hz.
pub(super) const TRAIN: TrainSpec = TrainSpec {
    shape: Shape::BiphasicCathodicFirst,
    width_us: 200,
    gap_us: 100,
    ground_us: 0,
    period_us: PERIOD_US,
    offset_us: 0,
    burst_count: 1,
    burst_interval_us: 0,
    repeats: 0,
    triggered: false,
};

/// Lets every pulse pass.
struct Always;

impl Supply for Always {
    fn burst(&mut self, channel: u8, _: Micros) -> Option<DacCode> {
        Some(DacCode(1000 + u16::from(channel)))
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
    /// Channel n starts `offset(n)` µs after the epoch.
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
        scheduler.start(&trains, &[], Some(0), Micros(0));
        Self {
            scheduler,
            plan: WindowPlan::new(),
            start: Micros(0),
            ok: true,
        }
    }

    fn render(&mut self) {
        let result = self
            .scheduler
            .render(self.start, &mut Always, &mut self.plan);
        self.ok &= result.is_ok();
        self.start = self.start.plus(WINDOW_US);
    }

    /// Renders windows until one is about to begin in which something happens.
    fn skip_quiet(&mut self, quiet: impl Fn(u32) -> bool) {
        while quiet(self.start.0 % PERIOD_US) {
            self.render();
        }
    }

    fn digest(&self, sum: &mut Checksum) {
        sum.word(u32::from(self.ok));
        for change in &self.plan.changes {
            sum.word(u32::from(change.slot));
            sum.word(change.levels.0);
        }
        for pulse in &self.plan.pulses {
            sum.word(u32::from(pulse.channel));
            sum.word(pulse.at.0);
        }
    }
}

/// A window in which nothing happens: all pulses of the period are over.
pub(super) struct RenderIdle(Trains);

impl RenderIdle {
    pub(super) fn new() -> Self {
        Self(Trains::new(|n| n))
    }
}

impl Algorithm for RenderIdle {
    fn prepare(&mut self, _: &mut Random) {
        self.0.skip_quiet(|phase| phase < 750);
    }
    fn run(&mut self) {
        self.0.render();
    }
    fn digest(&self, sum: &mut Checksum) {
        self.0.digest(sum);
    }
}

/// Windows in turn, channels spread over the period.
pub(super) struct Render(Trains);

impl Render {
    pub(super) fn new() -> Self {
        Self(Trains::new(|n| n * 997))
    }
}

impl Algorithm for Render {
    fn prepare(&mut self, _: &mut Random) {}
    fn run(&mut self) {
        self.0.render();
    }
    fn digest(&self, sum: &mut Checksum) {
        self.0.digest(sum);
    }
}

/// Windows in which all ten channels start, or end a phase, a few µs apart.
pub(super) struct RenderTogether(Trains);

impl RenderTogether {
    pub(super) fn new() -> Self {
        Self(Trains::new(|n| n * 3))
    }
}

impl Algorithm for RenderTogether {
    fn prepare(&mut self, _: &mut Random) {
        self.0.skip_quiet(|phase| phase >= 750);
    }
    fn run(&mut self) {
        self.0.render();
    }
    fn digest(&self, sum: &mut Checksum) {
        self.0.digest(sum);
    }
}

/// Painting such a window on an erased tape.
pub(super) struct Paint {
    trains: Trains,
    b: [u32; SLOTS],
    c: [u32; SLOTS],
}

impl Paint {
    pub(super) fn new() -> Self {
        Self {
            trains: Trains::new(|n| n * 3),
            b: [0; SLOTS],
            c: [0; SLOTS],
        }
    }
}

impl Algorithm for Paint {
    fn prepare(&mut self, _: &mut Random) {
        self.trains.skip_quiet(|phase| phase >= 750);
        self.trains.render();
        self.trains.plan.pump = true;
        (self.b, self.c) = ([ISOLATED_B; SLOTS], [ISOLATED_C; SLOTS]);
    }
    fn run(&mut self) {
        let mut window = Window {
            b: &mut self.b,
            c: &mut self.c,
        };
        paint(&self.trains.plan, &mut window);
    }
    fn digest(&self, sum: &mut Checksum) {
        for &word in self.b.iter().chain(&self.c) {
            sum.word(word);
        }
    }
}
