//! Panic handler of the images for simulators: prints over semihosting, which would fault on
//! silicon without a debugger. The stimulator does not use it.

use core::fmt::{Debug, Write};
use core::panic::PanicInfo;
use cortex_m_rt::{ExceptionFrame, exception};
use cortex_m_semihosting::{debug, hio};

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    end(info)
}

// SAFETY: nothing that the fault interrupted runs again.
#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    end(frame)
}

fn end(words: &dyn Debug) -> ! {
    if let Ok(mut stderr) = hio::hstderr() {
        let _ = writeln!(stderr, "{words:?}"); // nowhere left to complain
    }
    loop {
        debug::exit(debug::EXIT_FAILURE);
    }
}
