//! Image for the Feather STM32F405 as a breadboard; `flexor flash --board feather` writes it.
#![no_std]
#![no_main]

use defmt_rtt as _;
use embassy_executor::Spawner;

#[embassy_executor::main]
async fn main(spawner: Spawner) -> ! {
    firmware::board::stm32f405::run(spawner).await
}
