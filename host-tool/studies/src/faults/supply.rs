//! Fault campaign: the chip's environment fails: clocks, supply, a debugger, power during a flash
//! write.

use super::Draws;
use super::bench::DeviceClock;
use super::case::{Case, CaseResult};
use super::cut_off::CutOff;
use super::declaration::Declaration;
use super::error::{FaultsError, never_runs};
use super::freeze::{Owner, freeze};
use super::kinds::Kinds;
use super::stem::{Chip, ForkSource};
use hal_sim::chip::board::wiring::CORE_HZ;
use hal_sim::chip::board::{Board, BoardError, CYCLES_PER_US};
use hal_sim::chip::cpu::{Bus, Size};
use hal_sim::chip::image::Image;
use hal_sim::random::Random;

/// Random stream of this fault class; every class has its own, so that their random numbers are
/// independent.
const STREAM: u64 = 0x50_44;
/// Nominal output frequency of the PLL, Hz.
const PLL_HZ: f64 = CORE_HZ as f64;
/// Relative clock error above which USB fails. A full-speed receiver samples four times per bit and
/// sees an edge at least every seven bits (bit stuffing, USB 2.0 section 7.1.9).
const USB_HOLDS: f64 = 0.25 / 7.0;
/// Time from the loss of lock until the PLL runs at its free-running frequency, µs, and the number
/// of steps in which the simulation lowers the frequency.
const UNLOCKS: (u64, u32) = (100, 10);
/// Nominal supply voltage, mV.
const FULL_MV: f64 = 3_300.0;
/// Step in which the simulation lowers a falling supply voltage, mV.
const STEP_MV: f64 = 20.0;
/// Addresses of DBGMCU_APB1_FZ and APB2_FZ, each with all of its bits, which stop timers while the
/// core is halted.
const FREEZE: [(u32, u32); 2] = [(0xE004_2008, 0x06E0_1DFF), (0xE004_200C, 0x0007_0003)];
/// Upper bound of the random number of instructions that an interrupt handler executes before it
/// hangs.
const INSTRUCTIONS: u64 = 300;

/// Campaign in which clocks or supply fail or a debugger halts the core: the undisturbed run from
/// which cases start, and the kinds of fault.
pub(super) struct Supply {
    stem: ForkSource,
    kinds: Kinds,
    cut_off: CutOff,
}

impl Supply {
    pub fn new(seed: u64, declaration: &Declaration, image: &Image) -> Result<Self, FaultsError> {
        Ok(Self {
            stem: ForkSource::record(declaration, image)?,
            kinds: Kinds::new(declaration, image, seed, STREAM),
            cut_off: CutOff::new(declaration, image),
        })
    }
}

impl Draws for Supply {
    fn case(&self, index: u64) -> Result<Case, FaultsError> {
        let (kind, mut random) = self.kinds.draw(index)?;
        if kind == "flash cut off" {
            return self.cut_off.case(kind, index, &mut random);
        }
        let mut fork = self.stem.instant(random.unit(), &mut random)?;
        let mut moment_us = fork.device_us();
        let struck = if kind == "LSI, frozen" {
            let struck = slow_and_frozen(&mut fork, &mut random);
            moment_us = fork.device_us();
            struck
        } else {
            let struck = inject_fault(kind, &mut fork.device, &mut random).map_err(never_runs);
            struck.map(|(detail, stood_us, rate)| {
                let from_us = moment_us;
                fork.clock = DeviceClock {
                    from_us,
                    stood_us,
                    rate,
                };
                detail
            })
        };
        let (detail, fate) = match struck {
            Ok(detail) => (detail, self.stem.play_and_judge(fork, moment_us)),
            Err(why) => (String::new(), CaseResult::stopped(why)),
        };
        Ok(Case::new(kind, &detail, (index, moment_us), fate))
    }

    fn notes(&self) -> Vec<String> {
        let kinds = self.kinds.in_words();
        vec![
            format!("Injected at random: {kinds}."),
            "A clock that is wrong by more than 3.6 % ends USB. Times are real time, not the \
             chip's time."
                .to_owned(),
        ]
    }
}

/// Random details of a fault, time for which it stops the device's clock, µs, and speed of that
/// clock afterwards relative to the true speed.
type SupplyCase = (String, u64, f64);

/// Disturbs the board's clock or supply as `kind` says, with random details.
fn inject_fault(
    kind: &str,
    board: &mut Board<()>,
    random: &mut Random,
) -> Result<SupplyCase, BoardError> {
    match kind {
        "crystal dead" => {
            board.stop_crystal()?;
            Ok(("no oscillation".to_owned(), 0, 1.0))
        }
        "PLL wrong" => {
            let factor = random.log_between(0.5, 1.25);
            set_pll(board, factor)?;
            Ok((format!("{factor:.4} of 168 MHz"), 0, factor))
        }
        "PLL unlocked" => {
            let rate = unlock_pll(board)?;
            Ok(("168 to 28 MHz".to_owned(), 0, rate))
        }
        "supply falls" => Ok((drop_supply(board, random)?, 0, 1.0)),
        "supply dips" => {
            let mv = random.between(1_000.0, 3_200.0) as u32;
            let us = random.log_between(1.0, 10_000.0) as u64;
            board.supply(mv)?;
            let now_us = board.around.us_of(board.cpu.cycle);
            wait_us(board, now_us + us)?;
            board.supply(FULL_MV as u32)?;
            Ok((format!("{mv} mV for {us} us"), 0, 1.0))
        }
        _ => halt_core(kind, board, random),
    }
}

/// Lets the PLL fall to its free-running frequency; returns that frequency as a fraction of the
/// nominal one.
pub(super) fn unlock_pll(board: &mut Board<()>) -> Result<f64, BoardError> {
    let (us, steps) = UNLOCKS;
    for step in 1..=steps {
        set_pll(
            board,
            libm::pow(6.0_f64, -f64::from(step) / f64::from(steps)),
        )?;
        let now_us = board.around.us_of(board.cpu.cycle);
        wait_us(board, now_us + us / u64::from(steps))?;
    }
    Ok(1.0 / 6.0)
}

/// Runs the board until the simulated time `us`, µs.
fn wait_us(board: &mut Board<()>, us: u64) -> Result<(), BoardError> {
    while board.around.cycle_of(us) > board.cpu.cycle {
        board.run_to(board.around.cycle_of(us))?;
    }
    Ok(())
}

fn set_pll(board: &mut Board<()>, factor: f64) -> Result<(), BoardError> {
    board.set_pll_hz((PLL_HZ * factor) as u32)?;
    if (factor - 1.0).abs() > USB_HOLDS {
        let around = &mut board.around;
        around.host.unplug(board.cpu.cycle, &mut around.soc.otg);
        around.soc.reschedule();
    }
    Ok(())
}

fn drop_supply(board: &mut Board<()>, random: &mut Random) -> Result<String, BoardError> {
    let mv_per_us = random.log_between(0.1, 100.0);
    let away_us = random.log_between(1_000.0, 100_000.0) as u64;
    let begin_us = board.around.us_of(board.cpu.cycle);
    let mut fallen = 0.0;
    while fallen < FULL_MV {
        fallen += STEP_MV.max(mv_per_us);
        wait_us(board, begin_us + (fallen / mv_per_us) as u64)?;
        board.supply((FULL_MV - fallen).max(0.0) as u32)?;
    }
    let now_us = board.around.us_of(board.cpu.cycle);
    wait_us(board, now_us + away_us)?;
    board.supply(FULL_MV as u32)?;
    Ok(format!("{mv_per_us:.2} mV/us, back {away_us} us later"))
}

fn halt_core(
    kind: &str,
    board: &mut Board<()>,
    random: &mut Random,
) -> Result<SupplyCase, BoardError> {
    let us = random.log_between(100.0, 500_000.0) as u64;
    let stand = kind == "debugger, timers stand";
    if stand {
        for (register, bits) in FREEZE {
            let Board { cpu, around, .. } = board;
            let _ = around.write(register, Size::Word, bits, cpu.cycle); // the register exists
        }
    }
    board.debug_halt(true)?;
    let now_us = board.around.us_of(board.cpu.cycle);
    wait_us(board, now_us + us)?;
    board.debug_halt(false)?;
    Ok((format!("for {us} us"), if stand { us } else { 0 }, 1.0))
}

fn slow_and_frozen(fork: &mut Chip, random: &mut Random) -> Result<String, FaultsError> {
    let hz = random.between(17_000.0, 47_000.0) as u32;
    let (name, owner) = [
        ("controller", Owner::Controller),
        ("session", Owner::Session),
    ][random.below(2) as usize];
    let instructions = random.below(INSTRUCTIONS);
    let cycle = fork.device.cpu.cycle;
    fork.device.around.soc.set_lsi_hz(hz, cycle);
    // the watchdog is fed at the new rate before the freeze
    let settled = cycle + 20_000 * CYCLES_PER_US;
    fork.device.run_to(settled).map_err(never_runs)?;
    if !freeze(fork, owner, instructions)? {
        return Err(never_runs("the code to freeze does not run"));
    }
    Ok(format!("{hz} Hz, {name} after {instructions} instructions"))
}
