//! Tests of control laws side by side: the discretizations on the disturbed integrator, and every
//! law with every add-on.

mod integrator;
mod laws;
