//! The list of methods, with their arithmetics and steps.

use super::along::RuleMuscle;
use super::device_formats::{NativeEtdMidpoint, NativeGauss, NativeHermiteSimpson, NativeRule};
use super::event_driven::EventDriven;
use super::explicit::{Euler, ExplicitMuscle, Heun, RungeKutta4};
use super::exponential::{Etd1, GaussExponential, HeldRate};
use super::lobatto::HermiteSimpson;
use super::log_flow::{FlowSteps, LogFlow};
use super::log_table::LogTable;
use super::native;
use super::on_demand::OnDemand;
use super::planned::PlannedStep;
use super::rosenbrock::Rosenbrock;
use super::scheme::{Dense, Scheme};
use super::shipped::{Integrated, Tabulated};
use super::stepped::{Pulses, SteppedMuscle};
use super::{Arithmetic, Fixed, Integrator};
use crate::real::Micro;
use core::fmt;
use firmware::muscle::CalciumForceSpec;
use firmware::range::OutOfRange;

/// Method that integrates the calcium–force model of a muscle.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Method {
    /// Euler's method on both C and F.
    Euler,
    /// Heun's method on both C and F.
    Heun,
    /// Classical Runge–Kutta method on both C and F.
    RungeKutta4,
    /// Classical Runge–Kutta method on both C and F, as in Lee 2020: pulses do not split steps, but
    /// act at the beginning of the step in which they occur.
    RungeKutta4Snapped,
    /// Euler's method on F only. Here and in all methods below, C follows its exact solution.
    EulerExactC,
    /// Heun's method on F only.
    HeunExactC,
    /// Classical Runge–Kutta method on F only.
    RungeKutta4ExactC,
    /// Hermite–Simpson method (Lobatto IIIA with three stages).
    HermiteSimpson,
    /// Exponential time differencing, with the coefficients at the beginning of the step.
    Etd1,
    /// Exponential time differencing, with the coefficients in the middle of the step.
    EtdMidpoint,
    /// Variation of constants with two Gauss nodes per step.
    GaussExponential,
    /// Exponential Rosenbrock–Euler method on C and F, of order 2.
    RosenbrockEuler,
    /// Exponential Rosenbrock method `exprb32` on C and F, of order 3.
    Rosenbrock3,
    /// Whole steps by a table over log C.
    LogTable,
    /// Exact solution from pulse to pulse, by a table over log C.
    LogFlow,
    /// Exact solution from pulse to pulse, by Gauss–Legendre quadrature with 2 nodes.
    EventDriven2,
    /// Exact solution from pulse to pulse, by Gauss–Legendre quadrature with 3 nodes.
    EventDriven3,
    /// Exact solution from pulse to pulse, by Gauss–Legendre quadrature with 4 nodes.
    EventDriven4,
    /// The device's integrator of muscles without a table, `muscle::CalciumForce`, for every muscle.
    Segments,
    /// The device's own method, called as the device calls it: `muscle::TabulatedForce` where a
    /// muscle has a table, else [`Self::Segments`].
    Shipped,
}

impl Method {
    /// Every method that can be combined with any arithmetic and any step; all except the device's
    /// own two.
    pub const ALL: [Self; 18] = [
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
        Self::RosenbrockEuler,
        Self::Rosenbrock3,
        Self::LogTable,
        Self::LogFlow,
        Self::EventDriven2,
        Self::EventDriven3,
        Self::EventDriven4,
    ];

    /// Returns the name of the method, which consists of lower-case letters, digits and
    /// underscores.
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
            Self::RosenbrockEuler => "rosenbrock_euler",
            Self::Rosenbrock3 => "rosenbrock_3",
            Self::LogTable => "log_table",
            Self::LogFlow => "log_flow",
            Self::EventDriven2 => "event_driven_2",
            Self::EventDriven3 => "event_driven_3",
            Self::EventDriven4 => "event_driven_4",
            Self::Segments => "segments",
            Self::Shipped => "shipped",
        }
    }

    /// Returns whether the method has a part that was chosen with the trains on which the chart
    /// evaluates it, such as the density of a table, a number format or an approximation; the step
    /// does not count. All other methods are *generic*.
    pub const fn is_tuned(self) -> bool {
        matches!(
            self,
            Self::LogTable | Self::LogFlow | Self::Segments | Self::Shipped
        )
    }

    /// Returns whether the method integrates C by the same rule as F, instead of exactly. The chart
    /// contains one such method, to show the benefit of the exact C.
    pub(super) const fn is_alike(self) -> bool {
        matches!(self, Self::Euler | Self::Heun | Self::RungeKutta4)
    }

    /// Returns whether the method computes forces from the latest pulse without fixed steps. Its
    /// step is then only the longest time that it covers in one computation.
    pub const fn is_event_driven(self) -> bool {
        matches!(
            self,
            Self::EventDriven2 | Self::EventDriven3 | Self::EventDriven4
        )
    }

    /// Returns whether each step of the method calls an exponential or a logarithm. Other methods
    /// with the exact C call them only at pulses and for parts of steps.
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
    /// 64-bit floating point, which the chip's core computes in software.
    F64,
    /// 32-bit floating point with the functions of the crate libm.
    F32,
    /// 32-bit floating point with the functions of the crate micromath.
    Micromath,
    /// Fixed point with 16 fraction bits; products are rounded down.
    Q15_16,
    /// Fixed point with 24 fraction bits; products are rounded down.
    Q7_24,
    /// Fixed-point formats of the device: those of its own methods, or those of `device_formats`.
    Device,
}

impl Number {
    /// Every arithmetic in which a method other than the device's own can run.
    pub const GENERIC: [Self; 5] = [
        Self::F64,
        Self::F32,
        Self::Micromath,
        Self::Q15_16,
        Self::Q7_24,
    ];

    /// Returns the name of the arithmetic, which consists of lower-case letters, digits and
    /// underscores.
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

/// How a force is read at a time that is not the end of a step.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Reading {
    /// A step is ended at the time of the reading.
    Steps,
    /// The step is not ended, and its cubic is evaluated ([`PlannedStep`]).
    Cubic,
    /// Steps go from event to event, where events are pulses and readings ([`OnDemand`]).
    Demand,
}

impl Reading {
    /// Returns the name of the kind of reading, which consists of lower-case letters.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Steps => "steps",
            Self::Cubic => "cubic",
            Self::Demand => "demand",
        }
    }
}

/// Combination of a method, an arithmetic, a step and a kind of reading, as a chart or benchmark
/// compares it.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub struct Setting {
    /// Integration method.
    pub method: Method,
    /// Arithmetic. The device's own methods have [`Number::Device`]; of the others, only
    /// [`Setting::IN_DEVICE_FORMATS`] can have it.
    pub number: Number,
    /// Length of a step, µs, 1…2,000,000. For an event-driven method, the longest time without a
    /// pulse that is covered in one computation; [`Setting::WHOLE_US`] then means no limit.
    pub step_us: u32,
    /// How the force is read between the ends of steps.
    pub reading: Reading,
}

impl Setting {
    /// The device's choice.
    pub const SHIPPED: Self = Self::new(Method::Shipped, Number::Device, 1000);

    /// The device's integrator of muscles without a table.
    pub const SEGMENTS: Self = Self::new(Method::Segments, Number::Device, 1000);

    /// The choice of Lee 2020: Runge–Kutta with steps of 0.2 ms in f32, and pulses that act at the
    /// beginning of a step.
    pub const PAPER: Self = Self::new(Method::RungeKutta4Snapped, Number::F32, 200);

    /// Step of a method that covers any time in one computation, µs.
    pub const WHOLE_US: u32 = 2_000_000;

    /// Creates a setting in which a step ends at every reading.
    pub const fn new(method: Method, number: Number, step_us: u32) -> Self {
        Self {
            method,
            number,
            step_us,
            reading: Reading::Steps,
        }
    }

    /// Methods that can also run in the formats of `device_formats`, through cubics or on demand.
    pub const IN_DEVICE_FORMATS: [Method; 3] = [
        Method::HermiteSimpson,
        Method::EtdMidpoint,
        Method::GaussExponential,
    ];

    /// Creates a setting whose steps go from event to event and last at most `step_us`. `method`
    /// must integrate C exactly and take steps.
    pub const fn on_demand(method: Method, number: Number, step_us: u32) -> Self {
        Self {
            reading: Reading::Demand,
            ..Self::new(method, number, step_us)
        }
    }

    /// Returns whether the setting has a part that was chosen with the trains on which the chart
    /// evaluates it ([`Method::is_tuned`]). The formats of the device were chosen with them.
    pub fn is_tuned(self) -> bool {
        self.method.is_tuned() || self.number == Number::Device
    }

    /// Creates a setting whose steps are planned from each pulse on and read through their cubics.
    /// `method` must integrate C exactly and take steps.
    pub const fn planned(method: Method, number: Number, step_us: u32) -> Self {
        Self {
            reading: Reading::Cubic,
            ..Self::new(method, number, step_us)
        }
    }

    /// Creates the integrator of this setting for a muscle, and calls `then` with it.
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
            Number::Device => self.compute_on_device(spec, then),
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
            Method::EulerExactC => self.with_dense::<RuleMuscle<Euler, R>, T>(spec, then),
            Method::HeunExactC => self.with_dense::<RuleMuscle<Heun, R>, T>(spec, then),
            Method::RungeKutta4ExactC => {
                self.with_dense::<RuleMuscle<RungeKutta4, R>, T>(spec, then)
            }
            Method::HermiteSimpson => {
                self.with_dense::<RuleMuscle<HermiteSimpson, R>, T>(spec, then)
            }
            Method::Etd1 => self.with_dense::<RuleMuscle<Etd1, R>, T>(spec, then),
            Method::EtdMidpoint => self.with_dense::<RuleMuscle<HeldRate<true>, R>, T>(spec, then),
            Method::GaussExponential => {
                self.with_dense::<RuleMuscle<GaussExponential, R>, T>(spec, then)
            }
            Method::RosenbrockEuler => self.with_dense::<Rosenbrock<R, 2>, T>(spec, then),
            Method::Rosenbrock3 => self.with_dense::<Rosenbrock<R, 3>, T>(spec, then),
            Method::LogTable if is_planned => self.with_planned::<LogTable<R, true>, T>(spec, then),
            Method::LogTable => self.with_split_pulses::<LogTable<R, false>, T>(spec, then),
            Method::LogFlow if is_planned => self.with_planned::<FlowSteps<R>, T>(spec, then),
            Method::LogFlow => then(&mut LogFlow::<R>::new(spec)),
            Method::EventDriven2 => then(&mut EventDriven::<R, 2>::new(spec, step_us)),
            Method::EventDriven3 => then(&mut EventDriven::<R, 3>::new(spec, step_us)),
            Method::EventDriven4 => then(&mut EventDriven::<R, 4>::new(spec, step_us)),
            Method::Segments | Method::Shipped => return self.compute_on_device(spec, then),
        })
    }

    fn compute_on_device<T>(
        self,
        spec: &CalciumForceSpec,
        then: impl FnOnce(&mut dyn Integrator) -> T,
    ) -> Result<T, OutOfRange> {
        Ok(match self.method {
            Method::HermiteSimpson => self.with_native::<NativeHermiteSimpson, T>(spec, then),
            Method::EtdMidpoint => self.with_native::<NativeEtdMidpoint, T>(spec, then),
            Method::GaussExponential => self.with_native::<NativeGauss, T>(spec, then),
            Method::Shipped => match Tabulated::new(spec) {
                Some(mut tabulated) => then(&mut tabulated),
                None => then(&mut Integrated::new(spec)?),
            },
            _ => then(&mut Integrated::new(spec)?),
        })
    }

    fn with_native<M: NativeRule, T>(
        self,
        spec: &CalciumForceSpec,
        then: impl FnOnce(&mut dyn Integrator) -> T,
    ) -> T {
        match self.reading {
            Reading::Cubic => native::with_planned::<M, T>(spec, self.step_us, then),
            _ => native::with_events::<M, T>(spec, self.step_us, then),
        }
    }

    fn with_dense<S: Dense, T>(
        self,
        spec: &CalciumForceSpec,
        then: impl FnOnce(&mut dyn Integrator) -> T,
    ) -> T {
        match self.reading {
            Reading::Steps => self.with_split_pulses::<S, T>(spec, then),
            Reading::Cubic => self.with_planned::<S, T>(spec, then),
            Reading::Demand => self.with_events::<S, T>(spec, then),
        }
    }

    #[inline(never)]
    fn with_events<S: Scheme, T>(
        self,
        spec: &CalciumForceSpec,
        then: impl FnOnce(&mut dyn Integrator) -> T,
    ) -> T {
        then(&mut OnDemand::<S>::new(spec, self.step_us.max(1)))
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

impl fmt::Display for Setting {
    /// Writes `method/arithmetic/step`, for instance `rk4/f32/200us`, and `/planned` behind it if
    /// the setting is read through cubics, or `/demand` if its steps go from event to event. For [`Setting::WHOLE_US`], writes `pulses` instead of
    /// the step.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (method, number) = (self.method.name(), self.number.name());
        if self.step_us == Self::WHOLE_US {
            return write!(f, "{method}/{number}/pulses");
        }
        write!(f, "{method}/{number}/{}us", self.step_us)?;
        match self.reading {
            Reading::Steps => Ok(()),
            Reading::Cubic => f.write_str("/planned"),
            Reading::Demand => f.write_str("/demand"),
        }
    }
}
