//! Panic handler of the images for simulators. Prints over semihosting, which would cause a fault
//! on a chip without a debugger; the stimulator does not use it.

use core::fmt::{Debug, Write};
use core::panic::PanicInfo;
use cortex_m_rt::{ExceptionFrame, exception};
use cortex_m_semihosting::{debug, hio};

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    end(info)
}

// SAFETY: the interrupted code never runs again.
#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    end(frame)
}

fn end(words: &dyn Debug) -> ! {
    if let Ok(mut stderr) = hio::hstderr() {
        let _ = writeln!(stderr, "{words:?}"); // no other output is left for an error
    }
    loop {
        debug::exit(debug::EXIT_FAILURE);
    }
}
