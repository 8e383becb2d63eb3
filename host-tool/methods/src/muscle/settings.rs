//! Which methods there are, in which arithmetics, at which steps.

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

/// An integrator.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Method {
    /// Euler on C and F alike.
    Euler,
    /// Heun on both.
    Heun,
    /// Classical Runge–Kutta on both.
    RungeKutta4,
    /// The same as Lee 2020 ran it: not split, pulses at the beginning of
    /// their step.
    RungeKutta4Snapped,
    /// Euler on F, along the exact C as all that follow.
    EulerExactC,
    /// Heun on F.
    HeunExactC,
    /// Classical Runge–Kutta on F.
    RungeKutta4ExactC,
    /// Hermite–Simpson: Lobatto IIIA, three stages.
    HermiteSimpson,
    /// Exponential time differencing, held at the beginning of the step.
    Etd1,
    /// Held at its middle.
    EtdMidpoint,
    /// Exponential, two Gauss nodes.
    GaussExponential,
    /// Whole steps from a table over log C.
    LogTable,
    /// From pulse to pulse exactly, by a table over log C.
    LogFlow,
    /// From pulse to pulse by Gauss–Legendre; 2 nodes.
    EventDriven2,
    /// 3 nodes.
    EventDriven3,
    /// 4 nodes.
    EventDriven4,
    /// `muscle::CalciumForce`, as the device calls it.
    Shipped,
}

impl Method {
    /// All that run in any arithmetic at any step.
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

    /// Lower-case, of letters, digits and underscores.
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

    /// Whether something of it besides the step was chosen on the chart's own trains:
    /// the density of a table, formats, approximations. All else is *generic*.
    pub const fn is_tuned(self) -> bool {
        matches!(self, Self::LogTable | Self::LogFlow | Self::Shipped)
    }

    /// Whether C goes by the same rule as F, of which one is in the chart, to show what
    /// the exact C is worth.
    const fn is_alike(self) -> bool {
        matches!(self, Self::Euler | Self::Heun | Self::RungeKutta4)
    }

    /// Whether its step is but the longest stretch without a pulse that it
    /// takes in one go.
    pub const fn is_event_driven(self) -> bool {
        matches!(
            self,
            Self::EventDriven2 | Self::EventDriven3 | Self::EventDriven4
        )
    }

    /// Whether its steps call exponentials or logarithms; at a pulse and at parts of
    /// steps all do that have the exact C.
    pub const fn calls_functions(self) -> bool {
        self.is_event_driven()
            || matches!(
                self,
                Self::Etd1 | Self::EtdMidpoint | Self::GaussExponential | Self::LogFlow
            )
    }
}

/// What a method computes in.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Number {
    /// 64-bit floating point: software on this core.
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
    /// All that every generic method runs in.
    pub const GENERIC: [Self; 5] = [
        Self::F64,
        Self::F32,
        Self::Micromath,
        Self::Q15_16,
        Self::Q7_24,
    ];

    /// Lower-case, of letters, digits and underscores.
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

/// How a force between two ends of steps is had.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Reading {
    /// By ending a step there.
    Steps,
    /// Through the step's cubic ([`PlannedStep`]).
    Cubic,
}

/// A method in an arithmetic at a step.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub struct Setting {
    /// The method.
    pub method: Method,
    /// The arithmetic; [`Number::Device`] for the product's own methods and no
    /// other.
    pub number: Number,
    /// Its step, µs, 1…2,000,000; the longest stretch without a pulse of an
    /// event-driven method; [`Setting::WHOLE_US`] where there is none.
    pub step_us: u32,
    /// How it is read.
    pub reading: Reading,
}

impl Setting {
    /// The product's choice: `muscle::CalciumForce` in ticks of 1 ms.
    pub const SHIPPED: Self = Self::new(Method::Shipped, Number::Device, 1000);

    /// Lee 2020's own: Runge–Kutta at 0.2 ms, in f32, pulses on that grid.
    pub const PAPER: Self = Self::new(Method::RungeKutta4Snapped, Number::F32, 200);

    /// The step of a method that takes any stretch in one go, µs.
    pub const WHOLE_US: u32 = 2_000_000;

    /// This method in this arithmetic at this step, a step's end at every reading.
    pub const fn new(method: Method, number: Number, step_us: u32) -> Self {
        Self {
            method,
            number,
            step_us,
            reading: Reading::Steps,
        }
    }

    /// The same planned from each pulse on, and read through cubics; for methods with
    /// the exact C that take steps.
    pub const fn planned(method: Method, number: Number, step_us: u32) -> Self {
        Self {
            reading: Reading::Cubic,
            ..Self::new(method, number, step_us)
        }
    }

    /// Every setting worth showing at which the force can be read every
    /// `output_us`: the whole of what is compared.
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

    /// Steps that end where the force is read, those below 1 ms only for the panel of
    /// 1 ms. Of f64 and micromath three steps, to show where they lie. The snapped
    /// method nowhere but where it was used.
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

    /// Makes the integrator for a muscle and hands it to `then`.
    ///
    /// # Errors
    /// Parameters that the product's own method does not take.
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

/// Steps that end at readings, µs; of event-driven methods the longest stretches.
const fn steps_ending_at_readings(method: Method) -> &'static [u32] {
    match method {
        Method::LogFlow => &[Setting::WHOLE_US],
        _ if method.is_event_driven() => &[10_000, 20_000, Setting::WHOLE_US],
        _ => &[200, 500, 1000, 2000, 4000, 5000, 10_000, 20_000],
    }
}

/// Steps that are read through their cubics, µs: of methods that take steps and have
/// the exact C. An event-driven one is new at every reading, whatever the stretch.
const fn steps_read_by_cubics(method: Method) -> &'static [u32] {
    if method.is_event_driven() || method.is_alike() {
        return &[];
    }
    &[2000, 4000, 6000, 8000, 10_000, 14_000, 20_000]
}

impl fmt::Display for Setting {
    /// `method/arithmetic/step`, for instance `rk4/f32/200us`; `planned` behind it where
    /// it is read through cubics.
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
