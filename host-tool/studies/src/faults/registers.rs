//! One bit of a register that decides edges turns by itself.

use super::Draws;
use super::case::{Case, Fate};
use super::declaration::{Declaration, Register};
use super::error::FaultsError;
use super::stem::Stem;
use hal_sim::chip::cpu::bus::{Denied, Unmodelled};
use hal_sim::chip::image::Image;
use hal_sim::random::{Random, word};

/// Of the streams that this class draws from.
const STREAM: u64 = 0x4E61;

/// What is upset.
pub(super) struct Registers {
    stem: Stem,
    seed: u64,
    registers: Vec<Register>,
}

impl Registers {
    pub fn new(seed: u64, declaration: &Declaration, image: &Image) -> Result<Self, FaultsError> {
        Ok(Self {
            stem: Stem::grow(declaration, image)?,
            seed,
            registers: declaration.of.registers.clone(),
        })
    }

    /// Bits that may be turned.
    fn bits(&self) -> u64 {
        let each = self.registers.iter().map(|it| it.bits.count_ones());
        each.sum::<u32>().into()
    }
}

/// Bit `number` of all of `registers` that may be turned.
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

/// The block that a register is of: all before its name's last part.
fn block(name: &str) -> &str {
    name.rsplit_once('_').map_or(name, |(block, _)| block)
}

impl Draws for Registers {
    fn case(&self, index: u64) -> Result<Case, FaultsError> {
        let mut random = Random::new(word(word(self.seed, STREAM), index));
        let moment_us = self.stem.moment(random.unit());
        let drawn = random.below(self.bits().max(1));
        let Some((register, bit)) = bit_of(&self.registers, drawn) else {
            return Err(FaultsError::Declaration("no register's bits".into()));
        };
        let mut fork = self.stem.fork(moment_us)?;
        let cycle = fork.device.cpu.cycle;
        let soc = &mut fork.device.around.soc;
        let fate = match soc.upset(register.address, 1 << bit, cycle) {
            Ok(()) => self.stem.follow(fork, moment_us),
            Err(denied) => Fate {
                stopped: Some(match denied {
                    Denied::Unmodelled(Unmodelled(what)) => format!("not modelled: {what}"),
                    Denied::Error => "no register answers".to_owned(),
                }),
                ..Fate::default()
            },
        };
        Ok(Case {
            index,
            moment_us,
            what: format!("{}: {} bit {bit}", block(&register.name), register.name),
            fate,
        })
    }

    fn notes(&self) -> Vec<String> {
        let names: Vec<_> = self.registers.iter().map(|it| &*it.name).collect();
        let bits = self.bits();
        vec![format!(
            "Turned: one of {bits} bits of {}.",
            names.join(", ")
        )]
    }
}
