//! Integrators of the calcium–force model, each in every arithmetic worth
//! showing, all split at pulses.
