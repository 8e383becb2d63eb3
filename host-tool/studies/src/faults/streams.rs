//! Fault campaign: a DMA stream, a timer or a request of the pulse output fails, and no register
//! shows it.

use super::Draws;
use super::case::{Case, CaseResult};
use super::declaration::Declaration;
use super::error::{FaultsError, never_runs};
use super::kinds::Kinds;
use super::stem::{Chip, ForkSource};
use hal_sim::chip::board::{Board, CYCLES_PER_US, Half, Loss};
use hal_sim::chip::cpu::bus::{AccessError, Unmodelled};
use hal_sim::chip::cpu::{Bus, Size};
use hal_sim::chip::image::Image;
use hal_sim::chip::soc::playback::Slip;
use hal_sim::chip::soc::timer::Clocking;
use hal_sim::random::Random;

/// Random stream of this fault class; every class has its own, so that their random numbers are
/// independent.
const STREAM: u64 = 0x57E4;
/// DMA2 streams that copy the pulse tape to ports B and C.
const PLAY: [usize; 2] = [5, 1];
pub(super) const ERASE: [usize; 2] = [2, 6];
/// Fraction of the time in which faults are injected during which the amplitudes still rise. Faults
/// of DAC writes are injected only then.
const RISES: f64 = 0.1;
/// Number of channels in the campaign's session.
const CHANNELS: u64 = 8;
/// Returns the address of the control register DMA2_SxCR of a stream.
const fn control(stream: usize) -> u32 {
    0x4002_6410 + 0x18 * stream as u32
}
/// Address of TIM2_SR, and the bit of the compare event that requests the refill.
const TIM2_SR: (u32, u32) = (0x4000_0010, 1 << 2);
/// Addresses of the registers NVIC_ISER0, ICER0, ISPR0 and ICPR0.
const NVIC: [u32; 4] = [0xE000_E100, 0xE000_E180, 0xE000_E200, 0xE000_E280];
const TIM2: u32 = 1 << 28;
/// Longest time to wait for the next refill request, core clock cycles: 20 refill windows.
const PATIENCE: u64 = 5_000 * CYCLES_PER_US;

/// Campaign in which DMA streams and timers fail: the undisturbed run from which cases start, and
/// the kinds of fault.
pub(super) struct Streams {
    stem: ForkSource,
    kinds: Kinds,
}

impl Streams {
    pub fn new(seed: u64, declaration: &Declaration, image: &Image) -> Result<Self, FaultsError> {
        Ok(Self {
            stem: ForkSource::record(declaration, image)?,
            kinds: Kinds::new(declaration, image, seed, STREAM),
        })
    }
}

impl Draws for Streams {
    fn case(&self, index: u64) -> Result<Case, FaultsError> {
        let (kind, mut random) = self.kinds.draw(index)?;
        let part = random.unit() * if kind.contains("DAC") { RISES } else { 1.0 };
        let mut fork = self.stem.instant(part, &mut random)?;
        let moment_us = fork.device_us();
        let (detail, fate) = match inject_fault(kind, &mut fork, &mut random) {
            Ok(detail) => (detail, self.stem.play_and_judge(fork, moment_us)),
            Err(why) => (String::new(), CaseResult::stopped(why)),
        };
        Ok(Case::new(kind, &detail, (index, moment_us), fate))
    }

    fn notes(&self) -> Vec<String> {
        let kinds = self.kinds.in_words();
        vec![format!(
            "Injected at random: {kinds}; every register reads as written."
        )]
    }
}

/// Injects a fault of this kind; returns its random details.
fn inject_fault(kind: &str, fork: &mut Chip, random: &mut Random) -> Result<String, FaultsError> {
    match kind {
        "DAC word lost"
        | "DAC write lost"
        | "two DAC writes lost"
        | "a channel's DAC write lost" => Ok(lose_dac_write(kind, &mut fork.device, random)),
        "conversion lost" => {
            fork.device.around.soc.adc.unheard = 1;
            Ok("one trigger".to_owned())
        }
        "request unseen" | "request too many" => slip_request(kind, &mut fork.device, random),
        "play stream off" => switch_off(&mut fork.device, PLAY[random.below(2) as usize]),
        "erase stream off" => switch_off(&mut fork.device, ERASE[random.below(2) as usize]),
        "refill lost" => {
            lose_refill(fork)?;
            Ok("one request".to_owned())
        }
        "refill held back" => {
            let us = random.between(10.0, 3_000.0) as u64;
            write_private_register(&mut fork.device, NVIC[1], TIM2)?;
            let until = fork.device.cpu.cycle + us * CYCLES_PER_US;
            fork.device.run_to(until).map_err(never_runs)?;
            write_private_register(&mut fork.device, NVIC[0], TIM2)?;
            Ok(format!("by {us} us"))
        }
        _ => clock(kind, &mut fork.device, random),
    }
}

fn lose_dac_write(kind: &str, board: &mut Board<()>, random: &mut Random) -> String {
    let half = [Half::First, Half::Second][random.below(2) as usize];
    let channel = random.below(CHANNELS) as u8;
    let (loss, text) = match kind {
        "DAC word lost" => (
            Loss::new(1, Some(half), None),
            format!("the {half:?} of the next write").to_lowercase(),
        ),
        "a channel's DAC write lost" => (
            Loss::new(1, None, Some(channel)),
            format!("the next to channel {}", channel + 1),
        ),
        "DAC write lost" => (Loss::new(1, None, None), "the next".to_owned()),
        _ => (Loss::new(2, None, None), "the next two".to_owned()),
    };
    board.around.loss = loss;
    text
}

fn slip_request(
    kind: &str,
    board: &mut Board<()>,
    random: &mut Random,
) -> Result<String, FaultsError> {
    let (role, streams) = [("play", PLAY), ("erase", ERASE)][random.below(2) as usize];
    let stream = streams[random.below(2) as usize];
    let slip = match kind {
        "request unseen" => Slip::Unseen,
        _ => Slip::Unasked,
    };
    let cycle = board.cpu.cycle;
    let slipped = board.around.soc.slip(stream, slip, cycle);
    slipped.map_err(unmodelled)?;
    Ok(format!("stream {stream}, {role}"))
}

pub(super) fn switch_off(board: &mut Board<()>, stream: usize) -> Result<String, FaultsError> {
    let (cycle, soc) = (board.cpu.cycle, &mut board.around.soc);
    let on = soc.read(control(stream), Size::Word, cycle);
    let on = on.map_err(denied)?.value;
    let off = soc.write(control(stream), Size::Word, on & !1, cycle);
    off.map_err(denied)?;
    board.around.soc.reschedule();
    Ok(format!("stream {stream}"))
}

/// Slows or stops the clock of the timer whose number `kind` contains.
fn clock(kind: &str, board: &mut Board<()>, random: &mut Random) -> Result<String, FaultsError> {
    let number = kind.as_bytes().get(3).map_or(0, |digit| digit - b'0');
    let cycle = board.cpu.cycle;
    if kind.ends_with("stands") {
        stop_timer_clock(board, number)?;
        return Ok("no edge arrives".to_owned());
    }
    if number == 1 && random.below(2) == 0 {
        // The number is even because TIM2, which counts the laps of the tape, has half the clock.
        // The change comes early in a lap, before the counter passes its new end.
        let cycles = 2 * (42 + random.below(127) as u32);
        let lap = board.around.soc.playback.next_lap(cycle);
        board.run_to(lap + 1).map_err(never_runs)?;
        let cycle = board.cpu.cycle;
        let done = board.around.soc.misreload(cycles, cycle);
        done.map_err(unmodelled)?;
        return Ok(format!("{cycles} cycles a lap"));
    }
    let every = 2 + random.below(7) as u32;
    let clocking = Clocking::Every(every);
    let done = board.around.soc.misclock(number, clocking, cycle);
    done.map_err(unmodelled)?;
    Ok(format!("one edge of {every} arrives"))
}

/// Stops timer `number`: no edge of its clock arrives any more.
pub(super) fn stop_timer_clock(board: &mut Board<()>, number: u8) -> Result<(), FaultsError> {
    let cycle = board.cpu.cycle;
    let done = board.around.soc.misclock(number, Clocking::Stands, cycle);
    done.map_err(unmodelled)
}

/// Waits for the next refill request and suppresses it.
fn lose_refill(fork: &mut Chip) -> Result<(), FaultsError> {
    write_private_register(&mut fork.device, NVIC[1], TIM2)?;
    let Board { cpu, around, .. } = &mut fork.device;
    let end = cpu.cycle + PATIENCE;
    loop {
        let pending = cpu.system.read(NVIC[2], Size::Word, cpu.cycle);
        if pending.map_err(unmodelled)? & TIM2 != 0 {
            break;
        }
        cpu.step(around).map_err(never_runs)?;
        if cpu.cycle > end {
            return Err(FaultsError::NeverStimulates(
                "no refill was requested".into(),
            ));
        }
    }
    let (status, refill) = TIM2_SR;
    let done = around.write(status, Size::Word, !refill, cpu.cycle);
    done.map_err(denied)?;
    around.advance(cpu.cycle + 8).map_err(unmodelled)?; // the line is low again
    cpu.cycle += 8;
    write_private_register(&mut fork.device, NVIC[3], TIM2)?;
    write_private_register(&mut fork.device, NVIC[0], TIM2)
}

fn write_private_register(
    board: &mut Board<()>,
    register: u32,
    value: u32,
) -> Result<(), FaultsError> {
    let cpu = &mut board.cpu;
    let done = cpu.system.write(register, Size::Word, value, cpu.cycle);
    done.map_err(unmodelled)
}

fn unmodelled(Unmodelled(what): Unmodelled) -> FaultsError {
    FaultsError::NeverStimulates(what.to_owned())
}

fn denied(denied: AccessError) -> FaultsError {
    match denied {
        AccessError::Unmodelled(what) => unmodelled(what),
        AccessError::Error => FaultsError::NeverStimulates("no register answers".to_owned()),
    }
}
