//! Fault campaign: power fails while the board writes the table of its output stages.

use super::bench::Bench;
use super::case::{Case, CaseResult};
use super::declaration::Declaration;
use super::error::{FaultsError, never_runs};
use super::simulated::Boards;
use firmware::link::Request;
use firmware::lockstep::Sensors;
use firmware::safety::{StageKind, StageSupply, Stages};
use hal_sim::body::CHANNELS;
use hal_sim::chip::board::Board;
use hal_sim::chip::image::Image;
use hal_sim::random::Random;
use host_core::session::Session;
use std::sync::OnceLock;

/// Number of words in a copy of the table. Writing a copy means erasing its sector and then writing
/// its words.
const WORDS: u64 = 16;
/// Longest time in which the flash erases a sector, µs (data sheet).
const ERASE_US: u64 = 2_000_000;
/// Longest time in which the flash writes a word, µs (data sheet).
const WORD_US: u64 = 100;
/// Longest time from the request until writing starts, µs.
const BEGINS_US: u64 = 1_000;
/// Longest time from the request until both copies of the table are written, µs.
const WRITING_US: u64 = 2 * (ERASE_US + WORDS * WORD_US) + BEGINS_US;
/// Interval between stored copies of the simulated board, µs.
const KEPT_US: u64 = 100_000;
/// Duration of the power failure, µs.
const AWAY_US: u64 = 10_000;
/// Output stage of each channel in the new table.
const NEW: StageKind = StageKind::Current {
    full_scale_ua: 33_000,
};
const FULL_MV: u32 = 3_300;

/// Cases in which a board loses power while it writes a new table of its output stages.
pub(super) struct CutOff {
    image: Image,
    session: Session,
    /// Copies of the board at successive times while it writes the table; they are recorded when
    /// the first case needs them.
    kept: OnceLock<Result<Vec<Writer>, String>>,
}

type Writer = Bench<Board<()>>;

impl CutOff {
    pub fn new(declaration: &Declaration, image: &Image) -> Self {
        Self {
            image: image.clone(),
            session: declaration.scene.session.clone(),
            kept: OnceLock::new(),
        }
    }

    fn record_writing(&self) -> Result<Vec<Writer>, FaultsError> {
        let sensors = Sensors::default();
        let mut bench = self.image.board(&self.session, sensors, &|_| ())?;
        bench.send(Request::StoreStages {
            stages: [Some(NEW); CHANNELS],
            supply: StageSupply::Separate,
        })?;
        let end_us = bench.now_us() + WRITING_US;
        let mut kept = vec![bench.clone()];
        while bench.now_us() < end_us {
            bench.run_to(bench.now_us() + KEPT_US).map_err(never_runs)?;
            kept.push(bench.clone());
        }
        Ok(kept)
    }

    /// Plays case `index`: power fails at a random moment while a random copy of the table is
    /// written.
    ///
    /// # Errors
    /// Fails only before power was removed.
    pub fn case(&self, kind: &str, index: u64, random: &mut Random) -> Result<Case, FaultsError> {
        let kept = self
            .kept
            .get_or_init(|| self.record_writing().map_err(|e| e.to_string()));
        let kept = kept.as_ref().map_err(never_runs)?;
        let Some(first) = kept.first() else {
            return Err(never_runs("no fork point was recorded"));
        };
        let (copy, step, part) = (random.below(2), random.below(1 + WORDS), random.unit());
        let within_us = match step {
            0 => part * ERASE_US as f64,
            word => ERASE_US as f64 + ((word - 1) as f64 + part) * WORD_US as f64,
        };
        let begin_us = first.now_us();
        let copy_us = copy * (ERASE_US + WORDS * WORD_US);
        let at_us = begin_us + BEGINS_US + copy_us + within_us as u64;
        let after = kept.partition_point(|bench| bench.now_us() <= at_us);
        let mut bench = kept.get(after.saturating_sub(1)).unwrap_or(first).clone();
        bench.device.around.soc.flash.seed = random.below(u64::MAX);
        let played = bench
            .run_to(at_us)
            .map_err(|e| e.to_string())
            .and_then(|()| self.restart(&mut bench).map_err(|e| e.to_string()));
        let mut fate = match played {
            Ok((told, drives)) => fate(told, first.reports().stages, drives),
            Err(why) => CaseResult::stopped(why),
        };
        if bench.has_driven_since(begin_us) {
            fate.severe.push("driven while it was written".to_owned());
        }
        let step = match step {
            0 => "erasing".to_owned(),
            word => format!("word {word}"),
        };
        Ok(Case {
            index,
            moment_us: at_us,
            what: format!("{kind}: copy {}, {step}", copy + 1),
            fate,
        })
    }

    /// Removes and restores power. Returns the output stages that the board then reports, and
    /// whether its outputs become active when a host arms and starts it nevertheless.
    fn restart(&self, bench: &mut Writer) -> Result<(Option<Stages>, bool), FaultsError> {
        let sensors = Sensors::default();
        let board = &mut bench.device;
        board.supply(0).map_err(never_runs)?;
        let until = board.around.cycle_of(board.now_us() + AWAY_US);
        board.run_to(until).map_err(never_runs)?;
        board.supply(FULL_MV).map_err(never_runs)?;
        let mut board = board.clone();
        board.boot(&sensors)?;
        let now_us = board.now_us();
        let mut again = Bench::connect(board, now_us, sensors)?;
        let stages = again.reports().stages;
        // A host that tries in spite of the report.
        again.configure(&self.session)?;
        let wanted = self.session.setpoints.at(0).to_request(None);
        again.start(0, wanted)?;
        again.run_to(again.now_us() + 50_000).map_err(never_runs)?;
        Ok((stages, again.has_driven_since(0)))
    }
}

/// Judges a case by the stages `reported` that the board reports after the power failure: these must be
/// the table `old` or the new one, or be reported as unknown. `drives` is whether outputs became
/// active.
fn fate(reported: Option<Stages>, old: Option<Stages>, drives: bool) -> CaseResult {
    let is_old = reported.is_some() && reported == old;
    let is_new = matches!(reported, Some(Stages::Stored(table))
        if table.stages == [Some(NEW); CHANNELS]);
    let found = matches!(reported, Some(Stages::Unknown(_)));
    let mut severe = Vec::new();
    if !found && !is_old && !is_new {
        severe.push(format!("a third table: {reported:?}"));
    }
    if drives && !is_old {
        severe.push(format!("driven by {reported:?}"));
    }
    CaseResult {
        must_find: !is_old && !is_new,
        found,
        severe,
        ..CaseResult::default()
    }
}
