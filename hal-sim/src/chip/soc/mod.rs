//! The STM32F405 around the core: memories, bus matrix, peripherals, at
//! register level, as far as the images touch them.
//!
//! In: the core's accesses, pins, USB packets. Out: pin edges, interrupt
//! lines, what the DACs hold. RM0090 is the reference manual.

pub mod adc;
pub mod backup;
pub mod clock;
pub mod dbgmcu;
pub mod dma;
pub mod exti;
pub mod flash;
pub mod gpio;
pub mod iwdg;
pub mod matrix;
pub mod otg;
mod peripheral;
pub mod playback;
pub mod pwr;
mod ram;
pub mod rcc;
pub mod spi;
pub mod syscfg;
pub mod timer;
pub mod uid;
pub mod usart;
mod word;

pub use exti::Exti;
pub use gpio::Gpio;
pub use peripheral::Peripheral;
pub use playback::Playback;
pub use ram::Ram;
pub use syscfg::Syscfg;
