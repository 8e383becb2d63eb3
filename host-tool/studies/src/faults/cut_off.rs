//! Power fails while the board writes the table of its stages.

use super::bench::Bench;
use super::case::{Case, Fate};
use super::declaration::Declaration;
use super::error::FaultsError;
use super::simulated::Boards;
use super::stem::never_runs;
use firmware::link::Request;
use firmware::lockstep::Sensors;
use firmware::safety::{StageKind, Stages};
use hal_sim::body::CHANNELS;
use hal_sim::chip::board::Board;
use hal_sim::chip::image::Image;
use hal_sim::random::Random;
use host_core::session::Session;

/// Both sectors erased, and written: 2 s each (DS8626), µs.
const WRITING_US: u64 = 4_100_000;
/// Until the writing has begun, µs.
const BEGINS_US: u64 = 1_000;
/// Power is away for this long, µs.
const AWAY_US: u64 = 10_000;
/// What the new table has on each channel.
const NEW: StageKind = StageKind::Current {
    full_scale_ua: 33_000,
};
const FULL_MV: u32 = 3_300;

/// A board that is told new stages, and loses its power meanwhile.
pub(super) struct CutOff {
    image: Image,
    session: Session,
}

impl CutOff {
    pub fn new(declaration: &Declaration, image: &Image) -> Self {
        Self {
            image: image.clone(),
            session: declaration.scene.session.clone(),
        }
    }

    /// # Errors
    /// Nothing was broken yet.
    pub fn case(&self, kind: &str, index: u64, random: &mut Random) -> Result<Case, FaultsError> {
        let (at_us, seed) = (random.below(WRITING_US), random.below(u64::MAX));
        let sensors = Sensors::default();
        let seeded = |board: &mut Board<()>| board.around.soc.flash.seed = seed;
        let mut bench = self.image.board(&self.session, sensors.clone(), &seeded)?;
        let old = bench.heard().stages;
        bench.tell(Request::StoreStages {
            stages: [Some(NEW); CHANNELS],
        })?;
        let begin_us = bench.now_us();
        let mut fate = Fate::default();
        let played = bench
            .run_to(begin_us + BEGINS_US + at_us)
            .map_err(|e| e.to_string())
            .and_then(|()| self.restart(&mut bench, sensors).map_err(|e| e.to_string()));
        match played {
            Ok((told, drives)) => {
                fate.found = matches!(told, Some(Stages::Unknown(_)));
                let is_old = told.is_some() && told == old;
                let is_new = matches!(told, Some(Stages::Stored(table))
                    if table.stages == [Some(NEW); CHANNELS]);
                if !fate.found && !is_old && !is_new {
                    fate.severe.push(format!("a third table: {told:?}"));
                }
                if drives && !is_old {
                    fate.severe.push(format!("driven by {told:?}"));
                }
                // Between the first erasure's begin and the last word there is no whole pair.
                fate.must_find = !is_old && !is_new;
            }
            Err(why) => fate.stopped = Some(why),
        }
        if bench.drives_since(begin_us) {
            fate.severe.push("driven while it was written".to_owned());
        }
        Ok(Case {
            index,
            moment_us: begin_us + BEGINS_US + at_us,
            what: format!("{kind}: {at_us} us after the writing began"),
            fate,
        })
    }

    /// Power goes and comes again; what the board then says of its stages, and whether a
    /// host that arms and starts makes it drive.
    fn restart(
        &self,
        bench: &mut Bench<Board<()>>,
        sensors: Sensors,
    ) -> Result<(Option<Stages>, bool), FaultsError> {
        let board = &mut bench.device;
        board.supply(0).map_err(never_runs)?;
        let until = board.around.cycle_of(board.now_us() + AWAY_US);
        board.run_to(until).map_err(never_runs)?;
        board.supply(FULL_MV).map_err(never_runs)?;
        let mut board = board.clone();
        board.boot(&sensors)?;
        let now_us = board.now_us();
        let mut again = Bench::greeted(board, now_us, sensors)?;
        let told = again.heard().stages;
        // A host that tries all the same.
        again.configure(&self.session)?;
        let wanted = self.session.setpoints.at(0).request(None);
        again.start(0, wanted)?;
        again.run_to(again.now_us() + 50_000).map_err(never_runs)?;
        Ok((told, again.drives_since(0)))
    }
}
