//! Fault campaign: one bit of a register that determines edges flips.

use super::Draws;
use super::assumed;
use super::bench::DeviceClock;
use super::case::{Case, CaseResult};
use super::declaration::{Declaration, Register};
use super::error::FaultsError;
use super::stem::{Chip, ForkSource};
use hal_sim::chip::cpu::bus::{AccessError, Unmodelled};
use hal_sim::chip::image::Image;
use hal_sim::random::{Random, word};

/// Random stream of this fault class; every class has its own, so that their random numbers are
/// independent.
const STREAM: u64 = 0x4E61;

/// Campaign in which one bit of a register flips: the undisturbed run from which cases start, and
/// the registers.
pub(super) struct Registers {
    stem: ForkSource,
    seed: u64,
    registers: Vec<Register>,
}

impl Registers {
    pub fn new(seed: u64, declaration: &Declaration, image: &Image) -> Result<Self, FaultsError> {
        Ok(Self {
            stem: ForkSource::record(declaration, image)?,
            seed,
            registers: declaration.of.registers.clone(),
        })
    }

    /// Returns the number of bits in all registers that may be flipped.
    fn bits(&self) -> u64 {
        let counts = self
            .registers
            .iter()
            .map(|register| register.bits.count_ones());
        counts.sum::<u32>().into()
    }
}

/// Returns the register and the position in it of the flippable bit with this number, counted from
/// 0 over all registers; `None` if there are fewer bits.
pub(super) fn bit_of(registers: &[Register], mut number: u64) -> Option<(&Register, u32)> {
    for register in registers {
        let own = u64::from(register.bits.count_ones());
        if number < own {
            let set = (0..32).filter(|bit| register.bits >> bit & 1 == 1);
            return set.map(|bit| (register, bit)).nth(number as usize);
        }
        number -= own;
    }
    None
}

/// Returns the name of the peripheral block to which a register belongs: the register's name
/// without its last part.
fn block(name: &str) -> &str {
    name.rsplit_once('_').map_or(name, |(block, _)| block)
}

/// Flips `bits` of the register at `address`. If this changes the core's clock, the [`DeviceClock`]
/// of `fork` gets the new rate.
fn upset(fork: &mut Chip, address: u32, bits: u32) -> Result<(), AccessError> {
    let from_us = fork.device_us();
    let (cycle, around) = (fork.device.cpu.cycle, &mut fork.device.around);
    let hz = f64::from(around.soc.hz());
    around.upset(address, bits, cycle)?;
    fork.clock = DeviceClock {
        from_us,
        stood_us: 0,
        rate: f64::from(around.soc.hz()) / hz,
    };
    Ok(())
}

impl Draws for Registers {
    fn case(&self, index: u64) -> Result<Case, FaultsError> {
        let mut random = Random::new(word(word(self.seed, STREAM), index));
        let moment_us = self.stem.moment(random.unit());
        let drawn = random.below(self.bits().max(1));
        let Some((register, bit)) = bit_of(&self.registers, drawn) else {
            return Err(FaultsError::Declaration(
                "the registers have no bits".into(),
            ));
        };
        let bits = 1 << bit;
        let mut fork = self.stem.fork(moment_us)?;
        let (kind, end, fate) = match upset(&mut fork, register.address, bits) {
            Ok(()) => (
                block(&register.name),
                String::new(),
                self.stem.play_and_judge(fork, moment_us),
            ),
            Err(AccessError::Error) => {
                let why = format!("the chip has no register {}", register.name);
                return Err(FaultsError::Declaration(why));
            }
            Err(AccessError::Unmodelled(Unmodelled(what))) => {
                // independent of the result of the other fork
                let mut fork = self.stem.fork(moment_us)?;
                let struck = assumed::flip_register_bits(&mut fork, (register, bits), &mut random);
                let (end, fate) = match struck {
                    Ok(end) => (end, self.stem.play_and_judge(fork, moment_us)),
                    Err(why) => ("", CaseResult::stopped(why)),
                };
                let assumed = CaseResult {
                    assumed: true,
                    ..fate
                };
                (assumed::KIND, format!(", {end} ({what})"), assumed)
            }
        };
        let drawn = format!("{} bit {bit}{end}", register.name);
        Ok(Case::new(kind, &drawn, (index, moment_us), fate))
    }

    fn notes(&self) -> Vec<String> {
        let names: Vec<_> = self
            .registers
            .iter()
            .map(|register| &*register.name)
            .collect();
        let bits = self.bits();
        vec![format!(
            "Flipped: one of {bits} bits of {}.",
            names.join(", ")
        )]
    }
}
