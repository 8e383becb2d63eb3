//! The device code for QEMU's STM32F405, driven in lock-step by a host.
//! Semihosting serves for last words only: it would fault on silicon.
#![no_std]
#![no_main]

use core::fmt::Write;
use core::panic::PanicInfo;
use cortex_m_rt::{ExceptionFrame, entry, exception};
use cortex_m_semihosting::{debug, hio};

#[entry]
fn main() -> ! {
    firmware::board::qemu::run()
}

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    if let Ok(mut stderr) = hio::hstderr() {
        let _ = writeln!(stderr, "{info}"); // nowhere left to complain
    }
    loop {
        debug::exit(debug::EXIT_FAILURE);
    }
}

#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    panic!("{frame:?}")
}
