//! All integrators of the calcium–force model, each in several arithmetics.
//!
//! Submodules: `scheme` (the equations and the interface of a method), `along` (F along the exact
//! C) with `explicit`, `exponential`, `lobatto`; `rosenbrock` (C and F linearized); `log_table`, `event_driven`, `flow`, `log_flow`
//! (the other methods); `stepped` (steps split at pulses and readings), `planned` (steps from each
//! pulse on, read through cubics), `on_demand` (steps from event to event), `device_formats` and
//! `native` (rules in the device's formats), `shipped` (the product's own, unchanged), `arithmetic` and
//! `fixed` (the number types), `settings` (all methods) and `compared` (those of the chart). Their accuracy is evaluated in
//! `host_tool::accuracy`, their cycles in `bench::methods`. Input: the parameters of a muscle, a
//! step, pulses with their times in µs. Output: force.

pub mod along;
pub mod arithmetic;
mod compared;
pub mod device_formats;
pub mod event_driven;
pub mod explicit;
pub mod exponential;
pub mod fixed;
pub mod flow;
pub mod lobatto;
pub mod log_flow;
pub mod log_table;
mod native;
pub mod on_demand;
pub mod planned;
pub mod rosenbrock;
pub mod scheme;
pub mod settings;
pub mod shipped;
pub mod stepped;

use firmware::units::Micros;

pub use arithmetic::Arithmetic;
pub use fixed::Fixed;
pub use planned::PlannedStep;
pub use settings::{Method, Number, Reading, Setting};
pub use stepped::SteppedMuscle;

/// A muscle that one method integrates in one arithmetic. It starts without calcium and force at
/// [`Micros`] 0, and every pulse recruits the whole muscle.
pub trait Integrator {
    /// Advances to the time `at`, at which a pulse occurs, and adds 1 to C. Times must not
    /// decrease.
    fn pulse(&mut self, at: Micros);
    /// Advances to the time `to`. Times must not decrease.
    fn advance(&mut self, to: Micros);
    /// Returns the calcium state C of Lee 2020, eq. (2), at the latest time. A single pulse adds 1
    /// to it.
    fn calcium(&self) -> f64;
    /// Returns the force at the latest time, N.
    fn force_n(&self) -> f64;
    /// Advances to the time `to` and returns [`Self::force_bits`], in one call.
    fn read(&mut self, to: Micros) -> u32 {
        self.advance(to);
        self.force_bits()
    }
    /// Returns the bits of the force in the method's own arithmetic, folded to 32 bits; every NaN
    /// has the same bits. Machines are compared by these bits, and a benchmark reads the force
    /// without conversion.
    fn force_bits(&self) -> u32;
}
