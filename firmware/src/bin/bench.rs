//! Benchmark image: prints the results and cycles of each algorithm over semihosting.
#![no_std]
#![no_main]

use cortex_m_rt::entry;

#[entry]
fn main() -> ! {
    firmware::board::bench::run()
}
