//! Every integrator of the calcium–force model, each in several arithmetics.
//!
//! Lives here: `scheme` (the equations and what a step is), `along` (F along the
//! exact C) by `explicit`, `exponential`, `lobatto`; `log_table`, `event_driven`,
//! `flow`, `log_flow` (the other methods); `stepped` (steps split at pulses and
//! readings), `planned` (steps from each pulse on, read through cubics),
//! `shipped` (the product's own, as it is),
//! `arithmetic` and `fixed` (what they compute in), `settings` (the list of
//! all). Not here: judging them (`host_tool::accuracy`), their cycles
//! (`bench::methods`). In: a muscle's parameters, a step, pulses with their
//! microsecond. Out: force.

pub mod along;
pub mod arithmetic;
pub mod event_driven;
pub mod explicit;
pub mod exponential;
pub mod fixed;
pub mod flow;
pub mod lobatto;
pub mod log_flow;
pub mod log_table;
pub mod planned;
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

/// One muscle, integrated by some method in some arithmetic from rest at
/// [`Micros`] 0, every pulse at full gain.
pub trait Integrator {
    /// Lets time pass until `at`, then adds 1 to C. Times never go back.
    fn pulse(&mut self, at: Micros);
    /// Lets time pass until `to`. Times never go back.
    fn advance(&mut self, to: Micros);
    /// C of Lee 2020, eq. (2), in pulses, at the last time that was passed.
    fn calcium(&self) -> f64;
    /// Force, N, at that time.
    fn force_n(&self) -> f64;
    /// The same in the bits of the method's own arithmetic, folded to 32; all
    /// that is not a number is one word. For comparing machines, and for
    /// reading a force without converting it.
    fn force_bits(&self) -> u32;
}
