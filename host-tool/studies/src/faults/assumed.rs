//! Fault campaign: register codes that the simulator does not model, most of which the manuals
//! reserve or forbid, so that their effect on a chip is unknown. One of two effects is assumed at
//! random: the block ignores the bit, or it stops. The register shows the bit in both cases.

use super::bench::DeviceClock;
use super::declaration::Register;
use super::error::FaultsError;
use super::stem::Chip;
use super::streams::{stop_timer_clock, switch_off};
use super::supply::unlock_pll;
use hal_sim::chip::board::Loss;
use hal_sim::random::Random;

/// Kind that the cases with an assumed effect have in tables.
pub(super) const KIND: &str = "assumed";

/// Flips `bits` of `register` with one of two assumed effects, chosen at random; returns a
/// description of the effect.
pub(super) fn flip_register_bits(
    fork: &mut Chip,
    (register, bits): (&Register, u32),
    random: &mut Random,
) -> Result<&'static str, FaultsError> {
    let stands = random.below(2) == 1 && freeze_block(fork, &register.name)?;
    fork.device
        .around
        .soc
        .flip_shown_bits(register.address, bits);
    Ok(if stands {
        "its block stands"
    } else {
        "not heeded"
    })
}

/// Stops the peripheral block of `register`; returns `false` if the simulator has no means to stop
/// it.
fn freeze_block(fork: &mut Chip, register: &str) -> Result<bool, FaultsError> {
    let from_us = fork.device_us();
    let board = &mut fork.device;
    match register.split_once('_').map_or(register, |pair| pair.0) {
        "TIM1" => stop_timer_clock(board, 1)?,
        "TIM2" => stop_timer_clock(board, 2)?,
        "DMA2" => {
            let number = register.as_bytes().get("DMA2_S".len()).copied();
            let stream = number
                .filter(u8::is_ascii_digit)
                .map(|number| number - b'0');
            let Some(stream) = stream else {
                return Ok(false);
            };
            switch_off(board, stream.into())?;
        }
        "RCC" => {
            let rate = unlock_pll(board)?;
            fork.clock = DeviceClock {
                from_us,
                stood_us: 0,
                rate,
            };
        }
        "SPI3" => board.around.loss = Loss::new(u32::MAX, None, None),
        "ADC1" => board.around.soc.adc.unheard = u8::MAX,
        _ => return Ok(false),
    }
    Ok(true)
}
