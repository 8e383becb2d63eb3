//! Benchmarks of the control laws that the device could have used, in f32: every law with every
//! combination of add-ons, one period at a time.

use crate::control::derivative::Differentiator;
use crate::control::parameters::parameters;
use crate::control::{AddOns, Controller, DerivativeKind, Form, Input, Law};
use core::fmt;
use firmware::bench::{Bench, Clock, Row, control, measure_empty};
use firmware::control::ResponseSpec;

const RUNS: u32 = 400;

/// Code whose cycles one row of the benchmark gives.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum LawName {
    /// The start and end markers of a measurement with no code between them, to measure their own
    /// cycles.
    Markers,
    /// The default controller of the device, in fixed point.
    Device,
    /// The default controller of the device without predictor and learning.
    DeviceLaw,
    /// The fixed-point differentiator of the firmware alone.
    DeviceDifferentiator,
    /// A differentiator, in f32.
    Differentiator(DerivativeKind),
    /// A control law with its add-ons, in f32.
    Float(Form, AddOns),
}

impl fmt::Display for LawName {
    /// Writes `form/derivative/delay`, followed by `/forward` and `/adaptation` if these add-ons
    /// are used. Spaces become underscores.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (form, add_ons) = match self {
            Self::Markers => return write!(f, "markers"),
            Self::Device => return write!(f, "device"),
            Self::DeviceLaw => return write!(f, "device_law"),
            Self::DeviceDifferentiator => return write!(f, "device_differentiator"),
            Self::Differentiator(kind) => return write!(f, "differentiator/{kind:?}"),
            Self::Float(form, add_ons) => (form, add_ons),
        };
        for (n, word) in form.name().split(' ').enumerate() {
            write!(f, "{}{word}", if n > 0 { "_" } else { "" })?;
        }
        write!(f, "/{:?}/{:?}", add_ons.derivative, add_ons.delay)?;
        let on = |is_on, name| if is_on { name } else { "" };
        write!(
            f,
            "{}{}",
            on(add_ons.feed_forward, "/forward"),
            on(add_ons.adaptation, "/adaptation")
        )
    }
}

/// Measures the cycles of the markers, of the device's default controller and its parts, of each
/// differentiator, and of every law with every combination of add-ons. Passes each row to `row` as
/// soon as the row is complete. The feed-forward is an input of a law, and its computation is not
/// measured.
pub fn run_laws(clock: &impl Clock, mut row: impl FnMut(&Row<LawName>)) {
    let mut bench = Bench::new(clock, &mut row);
    measure_empty(&mut bench, LawName::Markers, RUNS);
    let response = Some(ResponseSpec::RECOMMENDED);
    // The constant is valid; an error would only leave out its row.
    let _ = control::measure_law(&mut bench, LawName::Device, RUNS, response);
    let _ = control::measure_law(&mut bench, LawName::DeviceLaw, RUNS, None);
    let _ = control::measure_differentiator(&mut bench, LawName::DeviceDifferentiator, RUNS);
    for kind in DerivativeKind::ALL {
        differentiator(&mut bench, kind);
    }
    for form in Form::ALL {
        for add_ons in AddOns::all() {
            let _ = law(&mut bench, form, add_ons);
        }
    }
}

/// Measures a differentiator, with random angles as its input.
fn differentiator<C: Clock>(bench: &mut Bench<'_, C, LawName>, kind: DerivativeKind) {
    let h = 0.002;
    bench.measure(
        LawName::Differentiator(kind),
        RUNS,
        match kind {
            DerivativeKind::PseudoOfError | DerivativeKind::Pseudo => {
                Differentiator::pseudo(10.0, h)
            }
            DerivativeKind::RobustExact => Differentiator::robust_exact(1000.0, h),
            DerivativeKind::RobustExactSecondOrder => {
                Differentiator::robust_exact_second_order(5e5, h)
            }
        },
        // Below 2^16, so the conversion is exact.
        |_, random| 1.7 * random.between(0, 1 << 16) as f32 / 65_536.0,
        |differentiator: &mut Differentiator<f32>, x| differentiator.step(*x),
        |_, rate, sum| sum.add_word(rate.to_bits()),
    );
}

/// Measures a law, with each parameter in the middle of its bounds and with random references and
/// angles.
fn law<C: Clock>(bench: &mut Bench<'_, C, LawName>, form: Form, add_ons: AddOns) -> Option<()> {
    let middle = parameters(form, add_ons);
    let values: heapless::Vec<f32, 16> = middle
        .iter()
        .map(|p| ((p.low + p.high) * 0.5) as f32)
        .collect();
    bench.measure(
        LawName::Float(form, add_ons),
        RUNS,
        Controller::from_parameters(form, add_ons, 0.002, &values).ok()?,
        |_, random| {
            // Below 2^16, so the conversion is exact.
            let mut part = || random.between(0, 1 << 16) as f32 / 65_536.0;
            Input {
                target: 1.7 * part(),
                target_rate: 2.0 * part() - 1.0,
                measured: 1.7 * part(),
                feed_forward: 2.0 * part() - 1.0,
            }
        },
        |law: &mut Controller<f32>, input| law.step(input),
        |_, effort, sum| sum.add_word(effort.to_bits()),
    );
    Some(())
}
