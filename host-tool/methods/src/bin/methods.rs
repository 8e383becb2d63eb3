//! Prints results and cycles of each muscle integrator that the device could have used, over
//! semihosting.
#![no_std]
#![no_main]

use cortex_m_rt::entry;

#[entry]
fn main() -> ! {
    firmware::board::bench::print(|clock, row| methods::bench::run_methods(clock, |r| row(r)))
}
