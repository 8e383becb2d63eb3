//! All tests of the methods in one program, one module each.

mod control_laws;
mod methods_control;
mod methods_muscle;
