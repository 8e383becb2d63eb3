//! One bit of the memory that decides the outputs turns by itself.

use super::Draws;
use super::case::Case;
use super::declaration::Declaration;
use super::error::FaultsError;
use super::stem::{Chip, Stem};
use hal_sim::chip::board::Board;
use hal_sim::chip::cpu::Size;
use hal_sim::chip::image::Image;
use hal_sim::random::{Random, word};

/// Exceptions in whose handlers that memory is at work, not at rest: 16 and the
/// interrupt's number (RM0090 table 62) of PVD, EXTI9_5 and TIM2.
const AT_WORK: [u16; 3] = [17, 39, 44];
/// Of the streams that this class draws from.
const STREAM: u64 = 0xF11B;

/// What is flipped.
pub(super) struct Flips {
    stem: Stem,
    seed: u64,
    symbol: String,
    address: u32,
    bytes: u32,
}

impl Flips {
    pub fn new(seed: u64, declaration: &Declaration, image: &Image) -> Result<Self, FaultsError> {
        let symbol = &declaration.of.symbol;
        let variable = image.symbols.variable(symbol).filter(|it| it.size > 0);
        let Some(variable) = variable else {
            return Err(FaultsError::NoSymbol {
                image: image.path().display().to_string(),
                symbol: symbol.clone(),
            });
        };
        Ok(Self {
            stem: Stem::grow(declaration, image)?,
            seed,
            symbol: symbol.clone(),
            address: variable.address,
            bytes: variable.size,
        })
    }
}

impl Draws for Flips {
    fn case(&self, index: u64) -> Result<Case, FaultsError> {
        let mut random = Random::new(word(word(self.seed, STREAM), index));
        let moment_us = self.stem.moment(random.unit());
        let offset = random.below(self.bytes.into()) as u32;
        let bit = random.below(8) as u32;
        let mut fork = self.stem.fork(moment_us)?;
        come_to_rest(&mut fork)?;
        let address = self.address + offset;
        flip(&mut fork.device, address, bit);
        let fate = self.stem.follow(fork, moment_us);
        let what = format!(
            "{address:#010x} ({}+{offset:#x}) bit {bit}",
            short(&self.symbol)
        );
        Ok(Case {
            index,
            moment_us,
            what,
            fate,
        })
    }

    fn notes(&self) -> Vec<String> {
        let (begin, end) = (self.address, self.address + self.bytes - 1);
        let (symbol, bytes) = (&self.symbol, self.bytes);
        vec![
            format!("Flipped: one bit of {begin:#010x} to {end:#010x}, {bytes} bytes, {symbol}."),
            "A moment within the refill or a stop is put off to its end: memory at rest.".into(),
        ]
    }
}

/// The last two parts of a path.
fn short(symbol: &str) -> &str {
    let mut parts = symbol.rmatch_indices("::");
    let second = parts.nth(1).map_or(0, |(at, _)| at + 2);
    &symbol[second..]
}

/// Lets the handlers that use the memory come to their end.
fn come_to_rest(fork: &mut Chip) -> Result<(), FaultsError> {
    let Board { cpu, around, .. } = &mut fork.device;
    while AT_WORK.contains(&cpu.registers.exception) {
        let done = cpu.step(around);
        done.map_err(|stop| FaultsError::NeverStimulates(stop.to_string()))?;
    }
    Ok(())
}

fn flip(board: &mut Board<()>, address: u32, bit: u32) {
    let ram = &mut board.around.soc.ram;
    if let Some(byte) = ram.read(address, Size::Byte) {
        let _ = ram.write(address, Size::Byte, byte ^ 1 << bit); // it was read there
    }
}
