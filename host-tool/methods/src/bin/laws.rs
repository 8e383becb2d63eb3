//! Prints results and cycles of each control law that the device could have used, over semihosting.
#![no_std]
#![no_main]

use cortex_m_rt::entry;

#[entry]
fn main() -> ! {
    firmware::board::bench::print(|clock, row| methods::bench::run_laws(clock, |r| row(r)))
}
