//! Fault campaign: a host stimulates again and again until the wearer's time or charge is used up,
//! however each piece ends and whatever resets in between. Judged at the electrode, the total must
//! not exceed the limits by more than one host timeout, plus 250 ms for each reset.

use super::Draws;
use super::bench::Bench;
use super::case::{Case, CaseResult};
use super::declaration::Declaration;
use super::error::{FaultsError, never_runs};
use super::kinds::Kinds;
use super::simulated::{Boards, FaultableDevice};
use super::spent::{Allowed, OutputTotals};
use firmware::device::Identity;
use firmware::link::message::ResetCause;
use firmware::link::{Code, Kind, Request};
use firmware::lockstep::{Lockstep, Sensors};
use firmware::safety::StageSpec;
use firmware::units::{Amplitude, Micros};
use hal_sim::body::CHANNELS;
use hal_sim::chip::board::{Board, BoardError, CYCLES_PER_US};
use hal_sim::native::identity;
use hal_sim::random::Random;
use host_core::session::Session;

/// Random stream of this fault class; every class has its own, so that their random numbers are
/// independent.
const STREAM: u64 = 0xA110;
/// Resistance between the electrodes of every channel, Ω.
const LOAD_OHM: u32 = 1_000;
/// Longest time until the device answers `Arm`, µs: the pause that it keeps between two electrode
/// checks, and one check.
const ARM_US: u64 = 430_000;
/// Longest time from the end of a piece of stimulation until the device is idle, µs: the longest
/// fall of the amplitude, and the last grounding of the train.
const ENDS_US: u64 = 115_000;
/// Time for which the device grounds its outputs after an acknowledged fault, µs.
const GROUNDS_US: u64 = 110_000;
/// Largest number of pieces of stimulation in a case; the device must refuse long before.
const MOST_PIECES: usize = 400;
/// Refusal codes of a device whose wearer has no time or no charge left.
const OVER: [Code; 2] = [Code::TimeOver, Code::DoseReached];
/// How a piece of stimulation can end, by itself or by its host.
const EXITS: [&str; 5] = ["stop", "silence", "hand stop", "fault", "finish"];
/// Causes of a reset during which the power stays on.
const RESETS: [ResetCause; 3] = [ResetCause::Software, ResetCause::Watchdog, ResetCause::Pin];

/// Campaign in which a host tries to exceed the wearer's allowance: the source of boards, the
/// session, and the kinds of attempt.
pub(super) struct AllowanceAttack<B: Boards> {
    boards: B,
    session: Session,
    kept: B::Snapshot,
    kinds: Kinds,
}

/// A board that can be reset.
pub(super) trait Resets: FaultableDevice + Sized {
    /// Resets the board with this cause and boots it again; returns the board's time afterwards,
    /// µs.
    fn reset(&mut self, cause: ResetCause, sensors: &Sensors) -> Result<u64, FaultsError>;

    /// Flips `bit` in copy 0 or 1 of the allowance, in the memory that survives resets.
    fn damage(&mut self, copy: usize, bit: usize);
}

impl Resets for Lockstep {
    fn reset(&mut self, reset: ResetCause, _: &Sensors) -> Result<u64, FaultsError> {
        let identity = Identity {
            reset,
            ..identity(Kind::Native)
        };
        self.boot(identity, Micros::new(0));
        Ok(0)
    }

    fn damage(&mut self, copy: usize, bit: usize) {
        let words = &mut self.allowance_copies_mut()[copy];
        words[bit / 32 % words.len()] ^= 1 << (bit % 32);
    }
}

impl Resets for Board<()> {
    fn reset(&mut self, cause: ResetCause, sensors: &Sensors) -> Result<u64, FaultsError> {
        let failure = |e: BoardError| never_runs(e.to_string());
        self.reset_with_cause(cause).map_err(failure)?;
        // Lets the host notice that the device has gone.
        self.run_to(self.cpu.cycle + 1_000 * CYCLES_PER_US)
            .map_err(failure)?;
        self.boot(sensors).map_err(failure)?;
        Ok(self.now_us())
    }

    fn damage(&mut self, copy: usize, bit: usize) {
        // The copies are 1 KiB apart and 140 bytes long.
        let byte = 1024 * copy + bit / 8 % 140;
        self.around.soc.backup_sram.bytes()[byte] ^= 1 << (bit % 8);
    }
}

/// One case while it is played.
struct Trial<'c, B: Boards> {
    class: &'c AllowanceAttack<B>,
    kind: &'c str,
    session: Session,
    random: Random,
    account: OutputTotals,
    /// Whether both stored copies of the allowance were damaged, so that the device must refuse
    /// because it no longer knows how much is left.
    is_lost: bool,
    refused: Option<u16>,
    pieces: usize,
    resets: usize,
}

impl<B: Boards> AllowanceAttack<B>
where
    B::Board: Resets,
{
    pub fn new(seed: u64, declaration: &Declaration, boards: B) -> Result<Self, FaultsError> {
        let kinds = Kinds::new(declaration, &boards, seed, STREAM);
        let mut session = declaration.scene.session.clone();
        for (n, channel) in (0u16..).zip(&mut session.channels) {
            channel.spec.stage = StageSpec::Current {
                full_scale_ua: 100_000,
            };
            // The first channel emits single pulses at 50 Hz, the second pairs at 25 Hz.
            channel.spec.train.burst_count = 1 + n as u8;
            channel.spec.train.burst_interval_us = 2_000 * n;
            channel.spec.train.period_us = 20_000 * (1 + u32::from(n));
        }
        let kept = boards.prepare(&session)?;
        Ok(Self {
            boards,
            session,
            kept,
            kinds,
        })
    }

    fn sensors() -> Sensors {
        Sensors {
            load_ohm: [LOAD_OHM; CHANNELS],
            ..Sensors::default()
        }
    }

    /// Returns the session with limits of time, charge, timeout, rise and fall that are randomly
    /// generated for this case.
    fn random_session(&self, random: &mut Random) -> Session {
        let mut session = self.session.clone();
        let wearer = &mut session.wearer;
        // One second on the chip simulator, which is slower than the native backend.
        let most_s: &u64 = self.boards.select(&1, &3);
        wearer.max_session_s = 1 + random.below(*most_s) as u32;
        // The charge limits two cases of five: 1 mC is 250 pulses of 4 µC, or 125 pairs.
        let is_by_dose = random.below(5) < 2 && *most_s > 1;
        wearer.max_dose_mc = if is_by_dose { 1 } else { 1_000 };
        if is_by_dose {
            wearer.max_session_s = 60;
        }
        wearer.host_timeout_ms = 20 + random.below(981) as u16;
        wearer.fall_ms = 5 + random.below(96) as u16;
        wearer.rise_ms = 1 + random.below(100) as u16;
        for channel in &mut session.channels {
            channel.spec.limit = Amplitude::new(15_000);
        }
        session
    }
}

impl<B: Boards> Trial<'_, B>
where
    B::Board: Resets,
{
    /// Plays pieces of stimulation until the device refuses, with resets between them; adds their
    /// output to the account.
    fn play(&mut self) -> Result<(), FaultsError> {
        let class = self.class;
        let sensors = AllowanceAttack::<B>::sensors();
        let mut bench = class
            .boards
            .connected_board(&class.kept, &class.session, sensors)?;
        while self.refused.is_none() && self.pieces < MOST_PIECES {
            self.pieces += 1;
            let reset = self.play_piece(&mut bench)?;
            let Some(cause) = reset else {
                continue;
            };
            let mut device = bench.device;
            if self.kind.ends_with("damaged") {
                self.damage(&mut device);
            }
            if cause == ResetCause::PowerOn {
                self.account.power_came_up();
                self.is_lost = false;
            } else {
                self.account.resets += 1;
            }
            self.resets += 1;
            let now_us = device.reset(cause, &sensors)?;
            bench = Bench::connect(device, now_us, sensors)?;
            // The device stores a watchdog reset as a fault.
            acknowledge(&mut bench)?;
        }
        Ok(())
    }

    /// Plays one piece of stimulation. Returns the cause of the reset that must follow, or `None`
    /// without a reset; the reset may also cut the piece short.
    fn play_piece(
        &mut self,
        bench: &mut Bench<B::Board>,
    ) -> Result<Option<ResetCause>, FaultsError> {
        let exit = match self.kind {
            kind if EXITS.contains(&kind) => kind,
            _ => EXITS[self.random.below(EXITS.len() as u64) as usize],
        };
        let mut session = self.session.clone();
        let count = if exit == "finish" {
            4 + self.random.below(20) as u16
        } else {
            0
        };
        for channel in &mut session.channels {
            channel.spec.train.repeats = count;
            if count != 0 {
                // a train with a fixed number of pulses has no rise
                channel.spec.start = channel.spec.limit;
            }
        }
        let refused = bench.reports().refused.len();
        bench.configure(&session)?;
        if let Some((code, field)) = bench.reports().refused.get(refused) {
            return Err(never_runs(format!("the setup was refused: {code} {field}")));
        }
        let speaks = exit != "silence" && self.random.below(2) == 0;
        bench.speaks = speaks;
        let refused = bench.reports().refused.len();
        let wanted = self.wanted();
        bench.start_within(0, wanted.clone(), ARM_US)?;
        if let Some((code, _)) = bench.reports().refused.get(refused) {
            self.refused = Some(*code);
            return Ok(None);
        }
        bench.send(wanted)?;
        let from_us = bench.now_us();
        let length_us = 20_000 + self.random.below(880_000);
        let reset = self.reset();
        let is_cut = reset.is_some() && self.random.below(2) == 0;
        let until_us = match is_cut {
            true => from_us + self.random.below(length_us),
            false => from_us + length_us,
        };
        bench
            .run_to(until_us)
            .map_err(|e| never_runs(e.to_string()))?;
        if !is_cut {
            self.end_piece(bench, exit)?;
        }
        self.account.add(&bench.recorder.trace, from_us);
        Ok(reset)
    }

    /// Returns a request for a random amplitude of 5 to 15 mA, the same on both channels.
    fn wanted(&mut self) -> Request {
        let channels = &self.session.channels;
        let mask = channels
            .iter()
            .fold(0, |mask, channel| mask | 1 << channel.index());
        let ua = 5_000 + self.random.below(10_001) as u32;
        Request::Amplitudes {
            at: None,
            mask,
            values: channels.iter().map(|_| Amplitude::new(ua)).collect(),
            widths: Default::default(),
        }
    }

    /// Ends a piece of stimulation as `exit` says, waits until the device is idle, and acknowledges
    /// a fault.
    fn end_piece(&mut self, bench: &mut Bench<B::Board>, exit: &str) -> Result<(), FaultsError> {
        bench.speaks = false;
        match exit {
            "stop" => bench.send(Request::Stop)?,
            "hand stop" => bench.sensors.hand_stop = false,
            "fault" => bench.sensors.over_current = true,
            // The longest host silence; a train that finished by itself is already idle.
            _ => wait(bench, 1_000_000)?,
        }
        wait(bench, ENDS_US)?;
        (bench.sensors.hand_stop, bench.sensors.over_current) = (true, false);
        wait(bench, 1_000 + self.random.below(30_000))?;
        if bench.reports().fault.is_some() {
            acknowledge(bench)?;
        }
        Ok(())
    }

    /// Chooses by the kind of case whether a reset interrupts or follows this piece; returns its
    /// cause, or `None`.
    fn reset(&mut self) -> Option<ResetCause> {
        let one_in = |random: &mut Random, n| random.below(n) == 0;
        match self.kind {
            "software reset" => Some(ResetCause::Software),
            "watchdog reset" => Some(ResetCause::Watchdog),
            "pin reset" => Some(ResetCause::Pin),
            "power" if one_in(&mut self.random, 6) => Some(ResetCause::PowerOn),
            "mixed" | "power" if one_in(&mut self.random, 2) => {
                Some(RESETS[self.random.below(RESETS.len() as u64) as usize])
            }
            "a copy damaged" => Some(ResetCause::Software),
            "both copies damaged" if self.pieces > 1 => Some(ResetCause::Software),
            _ => None,
        }
    }

    fn damage(&mut self, device: &mut B::Board) {
        let bit = self.random.below(35 * 32) as usize;
        if self.kind == "both copies damaged" {
            device.damage(0, bit);
            device.damage(1, self.random.below(35 * 32) as usize);
            self.is_lost = true;
        } else {
            device.damage(self.random.below(2) as usize, bit);
        }
    }

    fn judge(&self, allowed: &Allowed) -> CaseResult {
        let is_over = |code: u16| OVER.iter().any(|over| *over as u16 == code);
        let found = match self.refused {
            Some(code) if self.is_lost => code == Code::AllowanceLost as u16,
            Some(code) => is_over(code),
            None => false,
        };
        CaseResult {
            must_find: self.kind != "power" || found, // power removal gives the allowance back
            found,
            reset: self.resets > 0,
            severe: self.account.findings(allowed),
            ..CaseResult::default()
        }
    }
}

fn acknowledge<D: FaultableDevice>(bench: &mut Bench<D>) -> Result<(), FaultsError> {
    bench.send(Request::Acknowledge)?;
    wait(bench, GROUNDS_US)
}

fn wait<D: FaultableDevice>(bench: &mut Bench<D>, us: u64) -> Result<(), FaultsError> {
    let to_us = bench.now_us() + us;
    bench.run_to(to_us).map_err(|e| never_runs(e.to_string()))
}

impl<B: Boards> Draws for AllowanceAttack<B>
where
    B::Board: Resets,
{
    fn case(&self, index: u64) -> Result<Case, FaultsError> {
        let (kind, mut random) = self.kinds.draw(index)?;
        let session = self.random_session(&mut random);
        let allowed = Allowed::from_session(&session);
        let mut trial = Trial {
            class: self,
            kind,
            session,
            random,
            account: OutputTotals::default(),
            is_lost: false,
            refused: None,
            pieces: 0,
            resets: 0,
        };
        let mut played = trial.play();
        trial.account.close();
        if played.is_ok() && trial.account.is_empty() {
            played = Err(never_runs("nothing was stimulated"));
        }
        let mut fate = trial.judge(&allowed);
        if let Err(why) = played {
            fate.stopped = Some(why.to_string());
        }
        let refusal = trial
            .refused
            .map_or_else(|| "nothing".to_owned(), |code| code.to_string());
        let drawn = format!(
            "{} pieces, {} resets, {}; refused {refusal}",
            trial.pieces,
            trial.resets,
            trial.account.in_words(&allowed)
        );
        Ok(Case::new(kind, &drawn, (index, 0), fate))
    }

    fn notes(&self) -> Vec<String> {
        vec![
            format!("Injected at random: {}.", self.kinds.in_words()),
            "Severe: stimulation exceeds the wearer's time by more than the host timeout and \
             250 ms for each reset, or a channel's charge by more than is possible in that time. \
             Found: in the end arming is refused, with the right number. The allowance begins \
             again when power returns."
                .to_owned(),
        ]
    }
}
