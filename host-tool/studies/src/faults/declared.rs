//! Fault campaign: a setup that contradicts the board, or a board with a damaged table of its
//! stages.

use super::Draws;
use super::case::{Case, CaseResult};
use super::declaration::Declaration;
use super::error::FaultsError;
use super::kinds::Kinds;
use super::simulated::{Boards, judge_case};
use super::truth::declared_truth;
use firmware::link::{Code, Request};
use firmware::lockstep::Sensors;
use firmware::safety::{Origin, StageKind, StageSpec, StageSupply, StageTable, StageWords};
use firmware::units::Amplitude;
use hal_sim::body::{CHANNELS, Load};
use hal_sim::chip::board::{Board, stages};
use hal_sim::random::Random;
use host_core::session::{Channel, Session, Setpoint};

/// Random stream of this fault class; every class has its own, so that their random numbers are
/// independent.
const STREAM: u64 = 0xDEC1;
/// Output stages from which that of the board and that of the setup are chosen at random.
const STAGES: [StageKind; 7] = [
    StageKind::Current {
        full_scale_ua: 20_000,
    },
    StageKind::Current {
        full_scale_ua: 50_000,
    },
    StageKind::Current {
        full_scale_ua: 100_000,
    },
    StageKind::Voltage {
        full_scale_mv: 24_000,
    },
    StageKind::Voltage {
        full_scale_mv: 60_000,
    },
    StageKind::Voltage {
        full_scale_mv: 120_000,
    },
    StageKind::Voltage {
        full_scale_mv: 150_000,
    },
];
/// Resistance between the electrodes of every channel, and the load that the setup states for
/// voltage stages, Ω.
const LOAD_OHM: u32 = 1_000;
/// Limit of the channel in the setup, in thousandths of mA or V.
const LIMIT: u32 = 5_000;
/// Name of the kind in which the setup is correct and the device must accept it.
const TRUE: &str = "true";

/// Campaign in which the setup contradicts the board, or its stage table is damaged: the source of
/// boards, the session, and the kinds of mistake.
pub(super) struct DeclarationFaults<B> {
    boards: B,
    declaration: Declaration,
    kinds: Kinds,
}

/// One randomly generated case: a kind of mistake, and the output stages involved.
struct DeclarationCase<'k> {
    kind: &'k str,
    /// Output stage that the board has, and output stage that the setup states.
    stages: [StageKind; 2],
    /// Random numbers from which the details of the kind are chosen.
    random: Random,
}

impl<B: Boards> DeclarationFaults<B> {
    pub fn new(seed: u64, declaration: &Declaration, boards: B) -> Result<Self, FaultsError> {
        let kinds = Kinds::new(declaration, &boards, seed, STREAM);
        let declaration = declaration.clone();
        Ok(Self {
            boards,
            declaration,
            kinds,
        })
    }

    fn draw(&self, index: u64) -> Result<DeclarationCase<'_>, FaultsError> {
        let (kind, mut random) = self.kinds.draw(index)?;
        let count = STAGES.len() as u64;
        let has = random.below(count);
        let other = (has + 1 + random.below(count - 1)) % count;
        let declared = if kind == "other stage" { other } else { has };
        Ok(DeclarationCase {
            kind,
            stages: [has, declared].map(|value| STAGES[value as usize]),
            random,
        })
    }

    /// Returns the setpoint request of the session for its first channel only.
    fn wanted(&self) -> Request {
        let session = &self.declaration.scene.session;
        let index = session.channels.first().map(Channel::index);
        let mut wanted = session.setpoints.at(0);
        if let Setpoint::Amplitudes(values) = &mut wanted {
            values.retain(|(channel, _)| Some(*channel) == index);
        }
        wanted.to_request(None)
    }

    /// Returns the campaign's session with its first channel only, on the output stage `stage`.
    fn session(&self, stage: StageKind) -> Session {
        let mut session = self.declaration.scene.session.clone();
        session.channels.truncate(1);
        for channel in &mut session.channels {
            channel.spec.limit = Amplitude::new(LIMIT);
            channel.spec.stage = match stage {
                StageKind::Current { full_scale_ua } => StageSpec::Current { full_scale_ua },
                StageKind::Voltage { full_scale_mv } => StageSpec::Voltage {
                    full_scale_mv,
                    load_ohm: LOAD_OHM,
                },
            };
        }
        session
    }
}

impl DeclarationCase<'_> {
    /// Returns the code with which the device must refuse, and the fields that it may name; `None`
    /// if the setup is correct.
    fn refusal(&self) -> Option<(Code, &'static [&'static str])> {
        Some(match self.kind {
            TRUE => return None,
            "other stage" => (
                Code::OtherStage,
                &["stage", "full_scale_ua", "full_scale_mv"],
            ),
            "limit above the stage" => (Code::OutOfRange, &["limit"]),
            "area of zero" => (Code::OutOfRange, &["area_mm2"]),
            "older setup" => (Code::OtherSetup, &["setup"]),
            _ => (Code::StagesUnknown, &["stages"]),
        })
    }

    /// Returns whether the device refused with the right code and drove nothing. A correct setup
    /// counts as found only if the device wrongly refuses it or does not stimulate.
    fn is_found(&self, refused: &[(u16, String)], drives: bool) -> bool {
        let mut refused = refused.iter();
        match self.refusal() {
            Some((code, fields)) => {
                let is = |(number, field): &(u16, String)| {
                    *number == code as u16 && fields.contains(&&**field)
                };
                refused.any(is) && !drives
            }
            None => refused.next().is_some() || !drives,
        }
    }

    /// Writes both copies of the stage table into the board's flash, with the damage that the kind
    /// of case requires.
    fn store(&self, board: &mut Board<()>) {
        let mut random = self.random;
        let uid = board.around.soc.signature.uid;
        let table = StageTable {
            origin: Origin::Owner,
            supply: Some(StageSupply::Separate),
            stages: [Some(self.stages[0]); CHANNELS],
        };
        let (intact, erased) = (table.to_words(uid), StageWords::default().map(|_| u32::MAX));
        let mut copies = [intact; 2];
        let place = random.below(2) as usize;
        match self.kind {
            "table erased" => copies = [erased; 2],
            "table half written" => copies[place] = erased,
            "table damaged" => {
                let bit = random.below(32 * intact.len() as u64);
                copies[place][(bit / 32) as usize] ^= 1 << (bit % 32);
            }
            "table of another board" => {
                let other = uid.map(|value| value ^ random.word() as u32);
                copies = [table.to_words(other); 2];
            }
            _ => {}
        }
        for (copy, words) in stages::COPIES.into_iter().zip(&copies) {
            // cannot fail: both copies lie in flash
            let _ = stages::write(&mut board.around.soc.flash, copy, words);
        }
    }

    /// Changes the correct setup `session` into the wrong one that the kind of case requires.
    fn falsify(&self, session: &mut Session) {
        let mut random = self.random;
        for channel in &mut session.channels {
            let full_scale = channel.spec.stage.full_scale().get();
            match self.kind {
                "limit above the stage" => {
                    let above = 1 + random.below(full_scale.into()) as u32;
                    channel.spec.limit = Amplitude::new(full_scale + above);
                }
                "area of zero" => channel.spec.area_mm2 = 0,
                _ => {}
            }
        }
    }

    fn in_words(&self) -> String {
        let [has, declared] = self.stages.map(|stage| match stage {
            StageKind::Current { full_scale_ua } => format!("{} mA", full_scale_ua / 1_000),
            StageKind::Voltage { full_scale_mv } => format!("{} V", full_scale_mv / 1_000),
        });
        format!("{}: {declared} declared on {has}", self.kind)
    }
}

impl<B: Boards> Draws for DeclarationFaults<B> {
    fn case(&self, index: u64) -> Result<Case, FaultsError> {
        let drawn = self.draw(index)?;
        let [has, declared] = drawn.stages.map(|stage| self.session(stage));
        let mut session = declared;
        drawn.falsify(&mut session);
        let sensors = Sensors {
            load_ohm: [LOAD_OHM; CHANNELS],
            ..Sensors::default()
        };
        let mut bench = self
            .boards
            .board(&has, sensors, &|board| drawn.store(board))?;
        let moment_us = bench.now_us();
        bench.configure(&session)?;
        let mut setup = 0;
        if drawn.kind == "older setup" {
            setup = bench.sum();
            for channel in &mut session.channels {
                channel.spec.limit = Amplitude::new(LIMIT - 1);
            }
            bench.configure(&session)?;
        }
        bench.start(setup, self.wanted())?;
        let played = bench.run_to(bench.now_us() + self.declaration.timing().runs_us);
        let truth = declared_truth(&has, &[Load::Ohms(LOAD_OHM.into()); CHANNELS]);
        let (fate, verdict) = judge_case(&mut bench, moment_us, truth);
        let drives = bench.has_driven_since(moment_us);
        let refused = &bench.reports().refused;
        Ok(Case {
            index,
            moment_us,
            what: format!(
                "{}; {}",
                drawn.in_words(),
                describe_response(refused, drives)
            ),
            fate: CaseResult {
                must_find: drawn.kind != TRUE,
                found: drawn.is_found(refused, drives),
                bare: verdict
                    .bare
                    .findings
                    .iter()
                    .map(ToString::to_string)
                    .collect(),
                stopped: played.err().map(|e| e.to_string()),
                ..fate
            },
        })
    }

    fn notes(&self) -> Vec<String> {
        vec![
            format!("Injected at random: {}.", self.kinds.in_words()),
            "Found: a false declaration is refused with its own number and field, and nothing is \
             driven. A true declaration must drive."
                .to_owned(),
        ]
    }
}

/// Describes the device's first refusal, and whether it drove an output.
fn describe_response(refused: &[(u16, String)], drives: bool) -> String {
    let first = refused.first().map_or_else(
        || "refused nothing".to_owned(),
        |(code, field)| format!("refused {code} {field}"),
    );
    let drives = if drives { "drives" } else { "drives nothing" };
    format!("{first}, {drives}")
}
