//! Which methods there are, in which arithmetics, at which steps.

use super::event_driven::EventDriven;
use super::explicit::{Euler, Explicit, Heun, RungeKutta4};
use super::exponential::{Etd1, EtdMidpoint, GaussExponential};
use super::log_flow::LogFlow;
use super::log_table::LogTable;
use super::scheme::Scheme;
use super::shipped::Shipped;
use super::stepped::{Pulses, Stepped};
use super::{Arithmetic, Fixed, Integrator};
use crate::real::Micro;
use core::fmt;
use firmware::muscle::CalciumForceSpec;
use firmware::range::OutOfRange;

/// An integrator.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Method {
    /// Euler.
    Euler,
    /// Heun.
    Heun,
    /// Classical Runge–Kutta.
    RungeKutta4,
    /// The same as Lee 2020 ran it: not split, pulses at the beginning of
    /// their step.
    RungeKutta4Snapped,
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
    pub const GENERIC: [Self; 12] = [
        Self::Euler,
        Self::Heun,
        Self::RungeKutta4,
        Self::RungeKutta4Snapped,
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

    /// Whether it goes from pulse to pulse in one go, whatever the step.
    pub const fn has_no_step(self) -> bool {
        matches!(self, Self::LogFlow)
    }

    /// Whether its step is but the longest stretch without a pulse that it
    /// takes in one go.
    pub const fn is_event_driven(self) -> bool {
        matches!(
            self,
            Self::EventDriven2 | Self::EventDriven3 | Self::EventDriven4
        )
    }

    /// Whether it calls exponentials or logarithms: if not, micromath is f32.
    pub const fn calls_functions(self) -> bool {
        !matches!(
            self,
            Self::Euler | Self::Heun | Self::RungeKutta4 | Self::RungeKutta4Snapped | Self::Shipped
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
}

impl Setting {
    /// The product's choice: `muscle::CalciumForce` in ticks of 1 ms.
    pub const SHIPPED: Self = Self::new(Method::Shipped, Number::Device, 1000);

    /// Lee 2020's own: Runge–Kutta at 0.2 ms, in f32, pulses on that grid.
    pub const PAPER: Self = Self::new(Method::RungeKutta4Snapped, Number::F32, 200);

    /// The step of an event-driven method that takes any stretch in one go, µs.
    pub const WHOLE_US: u32 = 2_000_000;

    /// This method in this arithmetic at this step.
    pub const fn new(method: Method, number: Number, step_us: u32) -> Self {
        Self {
            method,
            number,
            step_us,
        }
    }

    /// Every setting worth showing at which the force can be read every
    /// `output_us`, of which steps are whole parts.
    pub fn all(output_us: u32) -> impl Iterator<Item = Self> {
        /// Steps, µs.
        const STEPS_US: [u32; 8] = [200, 500, 1000, 2000, 4000, 5000, 10_000, 20_000];
        /// Longest stretches of event-driven methods, µs.
        const STRETCHES_US: [u32; 3] = [10_000, 20_000, Setting::WHOLE_US];
        let steps = move |method: Method| {
            let any = method.is_event_driven();
            let all: &[u32] = match method.has_no_step() {
                true => &[Self::WHOLE_US],
                false if any => &STRETCHES_US,
                false => &STEPS_US,
            };
            let fits =
                move |us: &u32| any || *us == Self::WHOLE_US || output_us.is_multiple_of(*us);
            all.iter().copied().filter(fits)
        };
        let generic = Method::GENERIC.into_iter().flat_map(move |method| {
            Number::GENERIC.into_iter().flat_map(move |number| {
                steps(method).map(move |step_us| Self::new(method, number, step_us))
            })
        });
        generic
            .filter(move |setting| setting.is_of_interest(output_us))
            .chain([Self::SHIPPED])
    }

    /// Not in f64 what costs more than 10^7 cycles a second and gains nothing:
    /// steps below 1 ms, event-driven methods read as often, but for one. The
    /// snapped method nowhere but where it was used.
    fn is_of_interest(self, output_us: u32) -> bool {
        let is_often = self.method.is_event_driven() && self.step_us.min(output_us) < 10_000;
        let is_best = self.method == Method::EventDriven4 && self.step_us == 10_000;
        let is_dear = self.step_us < 1000 || is_often && !is_best;
        let is_snapped = self.method == Method::RungeKutta4Snapped;
        self == Self::PAPER || !(self.number == Number::F64 && is_dear || is_snapped)
    }

    /// Makes the integrator for a muscle and hands it to `then`.
    ///
    /// # Errors
    /// Parameters that the product's own method does not take.
    pub fn with<T>(
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
        Ok(match self.method {
            Method::Euler => self.split::<Explicit<Euler, R>, T>(spec, then),
            Method::Heun => self.split::<Explicit<Heun, R>, T>(spec, then),
            Method::RungeKutta4 => self.split::<Explicit<RungeKutta4, R>, T>(spec, then),
            Method::RungeKutta4Snapped => {
                self.stepped::<Explicit<RungeKutta4, R>, T>(spec, Pulses::Snapped, then)
            }
            Method::Etd1 => self.split::<Etd1<R>, T>(spec, then),
            Method::EtdMidpoint => self.split::<EtdMidpoint<R>, T>(spec, then),
            Method::GaussExponential => self.split::<GaussExponential<R>, T>(spec, then),
            Method::LogTable => self.split::<LogTable<R>, T>(spec, then),
            Method::LogFlow => then(&mut LogFlow::<R>::new(spec)),
            Method::EventDriven2 => then(&mut EventDriven::<R, 2>::new(spec, step_us)),
            Method::EventDriven3 => then(&mut EventDriven::<R, 3>::new(spec, step_us)),
            Method::EventDriven4 => then(&mut EventDriven::<R, 4>::new(spec, step_us)),
            Method::Shipped => then(&mut Shipped::new(spec)?),
        })
    }

    fn split<S: Scheme, T>(
        self,
        spec: &CalciumForceSpec,
        then: impl FnOnce(&mut dyn Integrator) -> T,
    ) -> T {
        self.stepped::<S, T>(spec, Pulses::Split, then)
    }

    #[inline(never)]
    fn stepped<S: Scheme, T>(
        self,
        spec: &CalciumForceSpec,
        pulses: Pulses,
        then: impl FnOnce(&mut dyn Integrator) -> T,
    ) -> T {
        then(&mut Stepped::<S>::new(spec, self.step_us.max(1), pulses))
    }
}

impl fmt::Display for Setting {
    /// `method/arithmetic/step`, for instance `rk4/f32/200us`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (method, number) = (self.method.name(), self.number.name());
        if self.step_us == Self::WHOLE_US {
            write!(f, "{method}/{number}/pulses")
        } else {
            write!(f, "{method}/{number}/{}us", self.step_us)
        }
    }
}
