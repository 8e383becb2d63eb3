//! The methods' tests, one program: a room each.

mod control_laws;
mod methods_control;
mod methods_muscle;
