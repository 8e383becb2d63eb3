//! One bit of a register that decides edges turns by itself.

use super::Draws;
use super::assumed;
use super::bench::DeviceClock;
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
        let (mut kind, mut drawn) = (
            block(&register.name),
            format!("{} bit {bit}", register.name),
        );
        let mut fork = self.stem.fork(moment_us)?;
        let cycle = fork.device.cpu.cycle;
        let around = &mut fork.device.around;
        let hz = f64::from(around.soc.hz());
        let fate = match around.upset(register.address, 1 << bit, cycle) {
            Ok(()) => {
                fork.clock = DeviceClock {
                    from_us: moment_us,
                    stood_us: 0,
                    rate: f64::from(around.soc.hz()) / hz,
                };
                self.stem.follow(fork, moment_us)
            }
            Err(Denied::Error) => Fate::stopped("no register answers"),
            Err(Denied::Unmodelled(Unmodelled(what))) => {
                let mut fork = self.stem.fork(moment_us)?; // whatever became of the other
                let end = assumed::strike(&mut fork, (register, 1 << bit), &mut random)?;
                (kind, drawn) = (assumed::KIND, format!("{drawn}, {end} ({what})"));
                Fate {
                    assumed: true,
                    ..self.stem.follow(fork, moment_us)
                }
            }
        };
        Ok(Case::of(kind, &drawn, (index, moment_us), fate))
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
