//! Image for QEMU's STM32F405, driven in lock-step by a host.
#![no_std]
#![no_main]

use cortex_m_rt::entry;

#[entry]
fn main() -> ! {
    firmware::board::qemu::run()
}
