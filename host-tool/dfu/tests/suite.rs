//! Tests of the procedure on a simulated boot loader: order, cuts, faults, files.

mod choice;
mod cuts;
mod files;
mod fixture;
mod hostile;
mod procedure;
