//! The list of methods, with their arithmetics and steps.

use super::along::{Rule, RuleMuscle};
use super::event_driven::EventDriven;
use super::explicit::{Euler, ExplicitMuscle, Heun, RungeKutta4};
use super::exponential::{Etd1, GaussExponential, HeldRate};
use super::lobatto::HermiteSimpson;
use super::log_flow::{FlowSteps, LogFlow};
use super::log_table::LogTable;
use super::planned::PlannedStep;
use super::scheme::{Dense, Scheme};
use super::shipped::Shipped;
use super::stepped::{Pulses, SteppedMuscle};
use super::{Arithmetic, Fixed, Integrator};
use crate::real::Micro;
use core::fmt;
use firmware::muscle::CalciumForceSpec;
use firmware::range::OutOfRange;

/// An integrator of the muscle model.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Method {
    /// Euler's method on both C and F.
    Euler,
    /// Heun's method on both C and F.
    Heun,
    /// Classical Runge–Kutta method on both C and F.
    RungeKutta4,
    /// Classical Runge–Kutta as in Lee 2020: steps are not split, and pulses act at the beginning
    /// of their step.
    RungeKutta4Snapped,
    /// Euler's method on F, along the exact C as in all methods below.
    EulerExactC,
    /// Heun's method on F.
    HeunExactC,
    /// Classical Runge–Kutta method on F.
    RungeKutta4ExactC,
    /// Hermite–Simpson: Lobatto IIIA, three stages.
    HermiteSimpson,
    /// Exponential time differencing, with values held from the beginning of the step.
    Etd1,
    /// Exponential time differencing, with values held from the middle of the step.
    EtdMidpoint,
    /// Variation of constants with two Gauss nodes.
    GaussExponential,
    /// Whole steps from a table over log C.
    LogTable,
    /// Exact solution from pulse to pulse, by a table over log C.
    LogFlow,
    /// Exact solution from pulse to pulse, by Gauss–Legendre quadrature with 2 nodes.
    EventDriven2,
    /// The same with 3 nodes.
    EventDriven3,
    /// The same with 4 nodes.
    EventDriven4,
    /// `muscle::CalciumForce`, as the device calls it.
    Shipped,
}

impl Method {
    /// Every method that runs in any arithmetic with any step.
    pub const ALL: [Self; 16] = [
        Self::Euler,
        Self::Heun,
        Self::RungeKutta4,
        Self::RungeKutta4Snapped,
        Self::EulerExactC,
        Self::HeunExactC,
        Self::RungeKutta4ExactC,
        Self::HermiteSimpson,
        Self::Etd1,
        Self::EtdMidpoint,
        Self::GaussExponential,
        Self::LogTable,
        Self::LogFlow,
        Self::EventDriven2,
        Self::EventDriven3,
        Self::EventDriven4,
    ];

    /// Returns the name in lower case, of letters, digits and underscores.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Euler => "euler",
            Self::Heun => "heun",
            Self::RungeKutta4 => "rk4",
            Self::RungeKutta4Snapped => "rk4_snapped",
            Self::EulerExactC => "euler_exact_c",
            Self::HeunExactC => "heun_exact_c",
            Self::RungeKutta4ExactC => "rk4_exact_c",
            Self::HermiteSimpson => "hermite_simpson",
            Self::Etd1 => "etd1",
            Self::EtdMidpoint => "etd_midpoint",
            Self::GaussExponential => "gauss_exponential",
            Self::LogTable => "log_table",
            Self::LogFlow => "log_flow",
            Self::EventDriven2 => "event_driven_2",
            Self::EventDriven3 => "event_driven_3",
            Self::EventDriven4 => "event_driven_4",
            Self::Shipped => "shipped",
        }
    }

    /// Returns whether a part of the method besides the step was chosen on the chart's own trains:
    /// the density of a table, formats, approximations. All others are *generic*.
    pub const fn is_tuned(self) -> bool {
        matches!(self, Self::LogTable | Self::LogFlow | Self::Shipped)
    }

    /// Returns whether the method integrates C by the same rule as F. The chart contains one such
    /// method, to show the benefit of the exact C.
    const fn is_alike(self) -> bool {
        matches!(self, Self::Euler | Self::Heun | Self::RungeKutta4)
    }

    /// Returns whether the step of the method is only the longest time without a pulse that it
    /// covers at once.
    pub const fn is_event_driven(self) -> bool {
        matches!(
            self,
            Self::EventDriven2 | Self::EventDriven3 | Self::EventDriven4
        )
    }

    /// Returns whether the steps of the method call exponentials or logarithms. Every method with
    /// the exact C calls them at pulses and at parts of steps.
    pub const fn calls_functions(self) -> bool {
        self.is_event_driven()
            || matches!(
                self,
                Self::Etd1 | Self::EtdMidpoint | Self::GaussExponential | Self::LogFlow
            )
    }
}

/// Arithmetic in which a method computes.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Number {
    /// 64-bit floating point, in software on this core.
    F64,
    /// 32-bit floating point, functions of the crate libm.
    F32,
    /// 32-bit floating point, functions of the crate micromath.
    Micromath,
    /// Fixed point, 16 fraction bits, rounded down.
    Q15_16,
    /// Fixed point, 24 fraction bits, rounded down.
    Q7_24,
    /// The product's own formats.
    Device,
}

impl Number {
    /// Every arithmetic in which the generic methods run.
    pub const GENERIC: [Self; 5] = [
        Self::F64,
        Self::F32,
        Self::Micromath,
        Self::Q15_16,
        Self::Q7_24,
    ];

    /// Returns the name in lower case, of letters, digits and underscores.
    pub const fn name(self) -> &'static str {
        match self {
            Self::F64 => "f64",
            Self::F32 => "f32",
            Self::Micromath => "f32_micromath",
            Self::Q15_16 => "q15_16",
            Self::Q7_24 => "q7_24",
            Self::Device => "device",
        }
    }
}

/// Way in which a force between two ends of steps is read.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Reading {
    /// A step ends at the reading.
    Steps,
    /// The cubic of the step is evaluated ([`PlannedStep`]).
    Cubic,
}

/// A method in an arithmetic with a step.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub struct Setting {
    /// Integration method.
    pub method: Method,
    /// Arithmetic; [`Number::Device`] for the product's own method and no other.
    pub number: Number,
    /// Step, µs, 1…2,000,000. For an event-driven method it is the longest time without a pulse
    /// that is covered at once; [`Setting::WHOLE_US`] means no limit.
    pub step_us: u32,
    /// Way in which the force is read between steps.
    pub reading: Reading,
}

impl Setting {
    /// The product's choice: `muscle::CalciumForce` with steps of 1 ms.
    pub const SHIPPED: Self = Self::new(Method::Shipped, Number::Device, 1000);

    /// The setting of Lee 2020: Runge–Kutta with 0.2 ms, in f32, pulses on that grid.
    pub const PAPER: Self = Self::new(Method::RungeKutta4Snapped, Number::F32, 200);

    /// Step of a method that covers any time at once, µs.
    pub const WHOLE_US: u32 = 2_000_000;

    /// Creates a setting that ends a step at every reading.
    pub const fn new(method: Method, number: Number, step_us: u32) -> Self {
        Self {
            method,
            number,
            step_us,
            reading: Reading::Steps,
        }
    }

    /// Creates a setting whose steps are planned from each pulse on and read through cubics, for
    /// methods with the exact C that take steps.
    pub const fn planned(method: Method, number: Number, step_us: u32) -> Self {
        Self {
            reading: Reading::Cubic,
            ..Self::new(method, number, step_us)
        }
    }

    /// Returns every setting that is compared if the force is read every `output_us`.
    pub fn all(output_us: u32) -> impl Iterator<Item = Self> {
        let generic = Method::ALL.into_iter().flat_map(move |method| {
            Number::GENERIC.into_iter().flat_map(move |number| {
                let ended = steps_ending_at_readings(method).iter();
                let ended = ended.map(move |us| Self::new(method, number, *us));
                let planned = steps_read_by_cubics(method).iter();
                ended.chain(planned.map(move |us| Self::planned(method, number, *us)))
            })
        });
        generic
            .filter(move |setting| setting.is_of_interest(output_us))
            .chain([Self::SHIPPED])
    }

    /// Returns whether a setting is compared: its steps must end at the readings, and steps below 1
    /// ms occur only for readings every 1 ms. f64 and micromath appear with three steps each, to
    /// show their position; the snapped method only as in its source.
    fn is_of_interest(self, output_us: u32) -> bool {
        let Self {
            method,
            number,
            step_us,
            reading,
        } = self;
        let is_free = method.is_event_driven() || step_us == Self::WHOLE_US;
        let has_ends = reading == Reading::Cubic
            || is_free
            || output_us.is_multiple_of(step_us) && (step_us >= 1000 || output_us == 1000);
        let is_shown = match number {
            Number::F64 => !(method.is_event_driven() && output_us == 1000),
            Number::Micromath => method.calls_functions(),
            _ => true,
        };
        let is_fine = matches!(step_us, 1000 | 4000 | 10_000 | Self::WHOLE_US);
        let is_usual = !matches!(number, Number::F64 | Number::Micromath);
        let is_rare = matches!(method, Method::Euler | Method::Heun)
            || method == Method::RungeKutta4Snapped
            || method.is_alike() && number != Number::F32;
        self == Self::PAPER || has_ends && is_shown && (is_usual || is_fine) && !is_rare
    }

    /// Creates the integrator for a muscle and calls `then` with it.
    ///
    /// # Errors
    /// Fails if the product's own method does not accept the parameters.
    pub fn with_integrator<T>(
        self,
        spec: &CalciumForceSpec,
        then: impl FnOnce(&mut dyn Integrator) -> T,
    ) -> Result<T, OutOfRange> {
        match self.number {
            Number::F64 => self.compute_in::<f64, T>(spec, then),
            Number::F32 => self.compute_in::<f32, T>(spec, then),
            Number::Micromath => self.compute_in::<Micro, T>(spec, then),
            Number::Q15_16 => self.compute_in::<Fixed<16>, T>(spec, then),
            Number::Q7_24 => self.compute_in::<Fixed<24>, T>(spec, then),
            Number::Device => Ok(then(&mut Shipped::new(spec)?)),
        }
    }

    fn compute_in<R: Arithmetic, T>(
        self,
        spec: &CalciumForceSpec,
        then: impl FnOnce(&mut dyn Integrator) -> T,
    ) -> Result<T, OutOfRange> {
        let step_us = self.step_us.max(1);
        let is_planned = self.reading == Reading::Cubic;
        Ok(match self.method {
            Method::Euler => self.with_split_pulses::<ExplicitMuscle<Euler, R>, T>(spec, then),
            Method::Heun => self.with_split_pulses::<ExplicitMuscle<Heun, R>, T>(spec, then),
            Method::RungeKutta4 => {
                self.with_split_pulses::<ExplicitMuscle<RungeKutta4, R>, T>(spec, then)
            }
            Method::RungeKutta4Snapped => {
                self.with_stepped::<ExplicitMuscle<RungeKutta4, R>, T>(spec, Pulses::Snapped, then)
            }
            Method::EulerExactC => self.with_rule::<Euler, R, T>(spec, then),
            Method::HeunExactC => self.with_rule::<Heun, R, T>(spec, then),
            Method::RungeKutta4ExactC => self.with_rule::<RungeKutta4, R, T>(spec, then),
            Method::HermiteSimpson => self.with_rule::<HermiteSimpson, R, T>(spec, then),
            Method::Etd1 => self.with_rule::<Etd1, R, T>(spec, then),
            Method::EtdMidpoint => self.with_rule::<HeldRate<true>, R, T>(spec, then),
            Method::GaussExponential => self.with_rule::<GaussExponential, R, T>(spec, then),
            Method::LogTable if is_planned => self.with_planned::<LogTable<R, true>, T>(spec, then),
            Method::LogTable => self.with_split_pulses::<LogTable<R, false>, T>(spec, then),
            Method::LogFlow if is_planned => self.with_planned::<FlowSteps<R>, T>(spec, then),
            Method::LogFlow => then(&mut LogFlow::<R>::new(spec)),
            Method::EventDriven2 => then(&mut EventDriven::<R, 2>::new(spec, step_us)),
            Method::EventDriven3 => then(&mut EventDriven::<R, 3>::new(spec, step_us)),
            Method::EventDriven4 => then(&mut EventDriven::<R, 4>::new(spec, step_us)),
            Method::Shipped => then(&mut Shipped::new(spec)?),
        })
    }

    fn with_rule<M: Rule, R: Arithmetic, T>(
        self,
        spec: &CalciumForceSpec,
        then: impl FnOnce(&mut dyn Integrator) -> T,
    ) -> T {
        match self.reading {
            Reading::Steps => self.with_split_pulses::<RuleMuscle<M, R>, T>(spec, then),
            Reading::Cubic => self.with_planned::<RuleMuscle<M, R>, T>(spec, then),
        }
    }

    #[inline(never)]
    fn with_planned<S: Dense, T>(
        self,
        spec: &CalciumForceSpec,
        then: impl FnOnce(&mut dyn Integrator) -> T,
    ) -> T {
        then(&mut PlannedStep::<S>::new(spec, self.step_us.max(1)))
    }

    fn with_split_pulses<S: Scheme, T>(
        self,
        spec: &CalciumForceSpec,
        then: impl FnOnce(&mut dyn Integrator) -> T,
    ) -> T {
        self.with_stepped::<S, T>(spec, Pulses::Split, then)
    }

    #[inline(never)]
    fn with_stepped<S: Scheme, T>(
        self,
        spec: &CalciumForceSpec,
        pulses: Pulses,
        then: impl FnOnce(&mut dyn Integrator) -> T,
    ) -> T {
        then(&mut SteppedMuscle::<S>::new(
            spec,
            self.step_us.max(1),
            pulses,
        ))
    }
}

/// Returns the steps that end at readings, µs; for event-driven methods the longest intervals.
const fn steps_ending_at_readings(method: Method) -> &'static [u32] {
    match method {
        Method::LogFlow => &[Setting::WHOLE_US],
        _ if method.is_event_driven() => &[10_000, 20_000, Setting::WHOLE_US],
        _ => &[200, 500, 1000, 2000, 4000, 5000, 10_000, 20_000],
    }
}

/// Returns the steps that are read through their cubics, µs, for methods with steps and the exact
/// C. An event-driven method is evaluated anew at every reading, whatever its interval.
const fn steps_read_by_cubics(method: Method) -> &'static [u32] {
    if method.is_event_driven() || method.is_alike() {
        return &[];
    }
    &[2000, 4000, 6000, 8000, 10_000, 14_000, 20_000]
}

impl fmt::Display for Setting {
    /// Writes `method/arithmetic/step`, for instance `rk4/f32/200us`, followed by `planned` if the
    /// setting is read through cubics.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (method, number) = (self.method.name(), self.number.name());
        if self.step_us == Self::WHOLE_US {
            return write!(f, "{method}/{number}/pulses");
        }
        write!(f, "{method}/{number}/{}us", self.step_us)?;
        match self.reading {
            Reading::Steps => Ok(()),
            Reading::Cubic => f.write_str("/planned"),
        }
    }
}
