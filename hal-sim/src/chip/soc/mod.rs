//! Models the STM32F405 around the core at register level, as far as the images use it: memories,
//! bus matrix, peripherals.
//!
//! In: the core's accesses, pins, USB packets. Out: pin edges, interrupt lines, the contents of the
//! DACs. The reference manual is RM0090.

pub mod adc;
pub mod backup;
pub mod backup_sram;
mod bus;
pub mod clock;
pub mod crc;
pub mod dbgmcu;
pub mod dma;
pub mod exti;
pub mod flash;
pub mod gpio;
pub mod iwdg;
mod map;
pub mod matrix;
pub mod otg;
mod peripheral;
pub mod playback;
pub mod pwr;
mod ram;
pub mod rcc;
mod registers;
pub mod spi;
pub mod syscfg;
#[cfg(test)]
mod tests;
mod tim11;
pub mod timer;
pub mod uid;
mod unheeded;
pub mod usart;
pub mod watch;
mod width;
mod wires;
mod word;

pub use exti::Exti;
pub use gpio::Gpio;
pub use peripheral::Peripheral;
pub use playback::{Pace, Playback};
pub use ram::Ram;
pub use syscfg::Syscfg;
pub use word::Lanes;

use super::board::wiring::REFERENCE;
use crate::chip::Cycle;
use crate::chip::cpu::bus::Modelled;
use adc::Adc;
use backup::Backup;
use backup_sram::BackupSram;
use crc::Crc;
use dbgmcu::Dbgmcu;
use flash::Flash;
use iwdg::Iwdg;
use otg::Otg;
use pwr::Pwr;
use rcc::{Cause, Crystal, HSI_HZ, Rcc};
use spi::Spi;
use tim11::Tim11;
use uid::Signature;
use unheeded::IgnoredBits;
use usart::Usart;

/// Frequency of the LSI oscillator, Hz, typical (DS8626: 17–47 kHz).
const LSI_HZ: u32 = 32_000;

/// Everything on the chip except the core: memories, bus matrix, clocks and peripherals.
#[derive(Clone, Debug)]
pub struct Soc {
    /// Main flash, 1 MiB, with its caches and prefetch.
    pub flash: Flash,
    /// SRAM1 and SRAM2, 128 KiB.
    pub ram: Ram,
    /// Core-coupled memory, 64 KiB.
    pub ccm: Ram,
    /// TIM1–5, DMA1 and DMA2, GPIO ports and bus matrix, which together play the pulse tape.
    pub playback: Playback,
    /// Reset and clock control: clock tree, clock enables, causes of resets.
    pub rcc: Rcc,
    /// ADC1, of which only the injected group is modelled.
    pub adc: Adc,
    /// SPI3, which controls the DACs.
    pub spi3: Spi,
    /// USB OTG_FS in device mode.
    pub otg: Otg,
    /// USART2, an asynchronous serial port.
    pub usart2: Usart,
    /// Backup registers of the RTC, which keep their contents over resets.
    pub backup: Backup,
    /// Backup SRAM, 4 KiB.
    pub backup_sram: BackupSram,
    /// EXTI, which turns edges of pins into interrupts.
    pub exti: Exti,
    pwr: Pwr,
    iwdg: Iwdg,
    lsi_hz: u32,
    /// Whether TIM5 was informed that the LSI oscillates.
    lsi_is_on: bool,
    tim11: Tim11,
    crc: Crc,
    syscfg: Syscfg,
    dbgmcu: Dbgmcu,
    unheeded: IgnoredBits,
    /// Number of accesses to blocks whose clock is off. On silicon they would go unnoticed.
    pub unclocked: u64,
    /// Unique number and flash size of the chip.
    pub signature: Signature,
    /// Record of the first access to each watched byte of SRAM; `None` if nothing is watched.
    pub watch: Option<Box<watch::Watch>>,
    /// Whether an enabled stream of DMA2 uses SRAM1 (index 0) and SRAM2 (index 1). If so, the core
    /// may have to wait there.
    shares: [bool; 2],
    /// Cause of a reset that was requested and not carried out yet.
    pub(in crate::chip) reset: Option<Cause>,
    pvd: bool,
    now: Cycle,
    /// Cycle of the next internal event; an access can make it earlier.
    event: Cycle,
    /// Earliest cycle at which `advance` must be called: at an event, or because an access may have
    /// changed an interrupt line.
    due: Cycle,
}

impl Soc {
    /// Creates a chip with erased flash and the crystal of the reference board, at power-on. `pace`
    /// selects the events at which the core must advance timers and DMA.
    pub fn new(pace: Pace) -> Self {
        Self::with_crystal(pace, Crystal::new(REFERENCE.crystal_hz))
    }

    /// Creates a chip like [`Self::new`], with another crystal.
    pub fn with_crystal(pace: Pace, crystal: Crystal) -> Self {
        Self {
            flash: Flash::default(),
            ram: Ram::new(0x2000_0000, 0x2_0000),
            ccm: Ram::new(0x1000_0000, 0x1_0000),
            playback: Playback::new(pace),
            rcc: Rcc::new(crystal),
            adc: Adc::default(),
            spi3: Spi::default(),
            otg: Otg::new(HSI_HZ.into()),
            usart2: Usart::default(),
            backup: Backup::default(),
            backup_sram: BackupSram::default(),
            exti: Exti::default(),
            pwr: Pwr::default(),
            iwdg: Iwdg::new(LSI_HZ),
            lsi_hz: LSI_HZ,
            lsi_is_on: false,
            tim11: Tim11::default(),
            crc: Crc::default(),
            syscfg: Syscfg::default(),
            dbgmcu: Dbgmcu::default(),
            unheeded: IgnoredBits::default(),
            signature: Signature::default(),
            unclocked: 0,
            watch: None,
            shares: [false; 2],
            reset: None,
            pvd: false,
            now: 0,
            event: 0,
            due: 0,
        }
    }

    /// Resets the system at `at`. Flash, RAM and backup registers keep their contents; backup SRAM
    /// and the debug registers too, except after power-on (RM0090 section 38.16.3).
    pub fn reset(&mut self, cause: Cause, at: Cycle) -> Modelled {
        self.reset = None;
        if cause == Cause::PowerOn {
            self.dbgmcu = Dbgmcu::default();
        }
        self.rcc.reset(cause);
        self.follow_clocks(at)?;
        self.follow_oscillators(at);
        self.flash.reset(at);
        self.playback.reset_all(at, &mut self.ram)?;
        self.adc.reset();
        self.tim11.reset();
        self.spi3.reset();
        self.otg.reset_registers(at);
        self.usart2.reset();
        self.exti = Exti::default();
        self.pwr.reset();
        if cause == Cause::PowerOn {
            self.backup_sram.lose_contents();
        }
        self.backup.set_writable(false);
        self.backup_sram.set_writable(false);
        self.iwdg.reset();
        self.crc = Crc::default();
        self.syscfg = Syscfg::default();
        self.unheeded = IgnoredBits::default();
        self.shares = [false; 2];
        self.reschedule_at(at);
        Ok(())
    }

    /// Interrupts the supply for a moment, which requests a reset. A battery at VBAT keeps the
    /// backup registers. RAM keeps its contents, but backup SRAM does not.
    pub fn lose_power(&mut self) {
        self.request_reset_for(Cause::PowerOn);
    }

    /// Requests a chip reset for this cause, and reschedules the next event to carry it out.
    pub fn request_reset_for(&mut self, cause: Cause) {
        self.reset = Some(cause);
        self.reschedule();
    }

    /// Returns the name of the first part whose state differs from that in `other` at `at`; `None`
    /// if both behave identically from then on. Statistics and predicted times do not count as
    /// state.
    pub fn first_difference(&self, other: &Self, at: Cycle) -> Option<&'static str> {
        let parts = [
            ("SRAM", self.ram == other.ram),
            ("CCM", self.ccm == other.ccm),
            (
                "playback",
                self.playback.is_equivalent_to(&other.playback, at),
            ),
            ("RCC", self.rcc == other.rcc),
            ("ADC", self.adc == other.adc),
            ("TIM11", self.tim11 == other.tim11),
            ("SPI3", self.spi3 == other.spi3),
            ("OTG", self.otg.is_equivalent_to(&other.otg)),
            ("USART2", self.usart2 == other.usart2),
            ("backup", self.backup == other.backup),
            ("backup SRAM", self.backup_sram == other.backup_sram),
            ("EXTI", self.exti == other.exti),
            ("PWR", self.pwr == other.pwr),
            ("IWDG", self.iwdg == other.iwdg),
            ("CRC", self.crc == other.crc),
            ("SYSCFG", self.syscfg == other.syscfg),
            ("DBGMCU", self.dbgmcu == other.dbgmcu),
            ("registers", self.unheeded == other.unheeded),
            ("reset", (self.reset, self.pvd) == (other.reset, other.pvd)),
            ("shares", self.shares == other.shares),
            ("flash", self.flash == other.flash),
        ];
        parts.into_iter().find(|part| !part.1).map(|part| part.0)
    }

    /// Returns the frequency of the core clock, Hz.
    pub fn hz(&self) -> u32 {
        self.rcc.clocks.hclk_hz
    }
}
