//! A measured angle that is wrong, late or missing, in a loop that is closed through a
//! simulated wearer.

use super::Draws;
use super::bench::Bench;
use super::case::{Case, Fate};
use super::declaration::Declaration;
use super::error::FaultsError;
use super::kinds::Kinds;
use super::measured::{Measured, angles};
use super::orders::Orders;
use super::script::{Replays, Script, request};
use super::simulated::judged;
use super::stem::first_difference;
use firmware::link::{Request, ToDevice, encode};
use firmware::units::Micros;
use hal_sim::body::{BrokenSensor, SensorFault};
use hal_sim::random::Random;
use hal_sim::wire::faults::Faults;
use hal_sim::wire::stream::Write;
use hal_sim::world::World;
use host_core::run::{body_of, fit};
use rayon::prelude::*;
use std::io;
use std::sync::{Arc, Mutex, PoisonError};

/// Of the streams that this class draws from.
const STREAM: u64 = 0x5E15;
/// Not drawn so soon after `Start`, µs.
const BEGIN_US: u64 = 150_000;
/// A measurement is asked for again this long after it was found wrong, or missing, at
/// least: two ticks of the control, and the next reading of 50 a second, µs.
const SOON_US: u64 = 22_000;
/// The board reads its converter this often, µs.
const TICK_US: u64 = 1_000;

/// What breaks.
pub(super) struct Sensor<B: Replays> {
    boards: B,
    scenes: Vec<Script<B>>,
    kinds: Kinds,
    runs_us: u64,
}

/// One of them, drawn.
struct Drawn<'k> {
    kind: &'k str,
    angle: Measured,
    /// The other one, where two are swapped.
    other: Option<u8>,
    fault: Option<SensorFault>,
    /// How old what comes is, as it says, µs; nothing where nothing comes.
    late_us: Option<u64>,
    moment_us: u64,
}

impl<B: Replays> Sensor<B> {
    pub fn new(seed: u64, declaration: &Declaration, boards: B) -> Result<Self, FaultsError> {
        let files = std::iter::once(&declaration.scene).chain(&declaration.scenes);
        let files: Vec<_> = files.collect();
        let scenes = files.into_par_iter().map(|file| {
            let mut script = Script::record(&boards, file)?;
            let (bench, _, played) = played(&boards, &script, None)?;
            played.map_err(|lost| FaultsError::NeverStimulates(lost.to_string()))?;
            script.accept(bench)?;
            Ok(script)
        });
        Ok(Self {
            scenes: scenes.collect::<Result<_, FaultsError>>()?,
            kinds: Kinds::of(declaration, &boards, seed, STREAM),
            runs_us: declaration.timing().runs_us,
            boards,
        })
    }

    fn draw(&self, index: u64) -> Result<(&Script<B>, Drawn<'_>), FaultsError> {
        let (kind, mut random) = self.kinds.draw(index)?;
        let scene = random.below(self.scenes.len().max(1) as u64) as usize;
        let none = || FaultsError::Declaration("no scene with a measured angle".into());
        let script = self.scenes.get(scene).ok_or_else(none)?;
        let angles = angles(&script.file.session);
        let drawn = random.below(angles.len().max(1) as u64) as usize;
        let angle = *angles.get(drawn).ok_or_else(none)?;
        let (begin_us, end_us) = (script.start.1 + BEGIN_US, script.stop.1);
        let span_us = end_us.saturating_sub(self.runs_us + begin_us).max(1);
        let moment_us = begin_us + random.below(span_us);
        let mut drawn = Drawn {
            kind,
            angle,
            other: None,
            fault: None,
            late_us: Some(0),
            moment_us,
        };
        drawn.break_it(&angles, &mut random);
        Ok((script, drawn))
    }
}

impl Drawn<'_> {
    fn break_it(&mut self, angles: &[Measured], random: &mut Random) {
        let off = random.log_between(5.0, 200.0) * [-1.0, 1.0][random.below(2) as usize];
        let age_us = random.log_between(5e3, 4e5) as u64;
        let far = 1e6_f64.copysign(off);
        let fault = match self.kind {
            "stuck" => SensorFault::Stuck,
            // One reading: of a host the first, of a converter those of a tick.
            "outlier" if self.angle.is_converted() => SensorFault::Outlier(off, TICK_US),
            "outlier" => SensorFault::Outlier(off, 0),
            "step" => SensorFault::Step(off),
            "drift" => SensorFault::Drift(off),
            "code" => SensorFault::Says(far),
            "delayed" => SensorFault::Delayed(age_us),
            // A converter's reading has no time, and a wire that is off reads the least.
            "late" if self.angle.is_converted() => SensorFault::Delayed(age_us),
            "stopped" if self.angle.is_converted() => SensorFault::Says(-1e6),
            "late" => {
                self.late_us = Some(age_us);
                return;
            }
            "stopped" => {
                self.late_us = None;
                return;
            }
            _ => {
                let others = angles.iter().filter(|it| it.index != self.angle.index);
                let others: Vec<u8> = others.map(|it| it.index).collect();
                if others.is_empty() {
                    SensorFault::Reversed(self.angle.middle_deg())
                } else {
                    self.other = Some(others[random.below(others.len() as u64) as usize]);
                    return;
                }
            }
        };
        self.fault = Some(fault);
    }

    /// The measurement that comes in place of this one, and how late; nothing where none
    /// does.
    fn remade(
        &self,
        t_us: u64,
        joint: u8,
        deg: f64,
        broken: &mut BrokenSensor,
    ) -> Option<(u64, u8, f64)> {
        let is_broken = t_us >= self.moment_us;
        if let Some(other) = self.other.filter(|_| is_broken) {
            let swapped = match joint {
                own if own == self.angle.index => other,
                own if own == other => self.angle.index,
                own => own,
            };
            return Some((0, swapped, deg));
        }
        if joint != self.angle.index {
            return Some((0, joint, deg));
        }
        match self.fault {
            Some(_) => Some((0, joint, broken.read(t_us, deg))),
            None if is_broken => Some((self.late_us?, joint, deg)),
            None => Some((0, joint, deg)),
        }
    }

    /// Whether the device owes to find it: by what was said from the moment on, °.
    fn is_owed(&self, said: Option<[f64; 2]>) -> bool {
        let late_us = self.late_us.unwrap_or(u64::MAX);
        let is_late = late_us > self.angle.stale_us + SOON_US;
        is_late || said.is_some_and(|said| self.angle.is_beyond(said))
    }

    fn in_words(&self, file: &str) -> String {
        let Self { kind, angle, .. } = self;
        let mut text = format!("{kind}: {file}, angle {}", angle.index);
        if let Some(fault) = self.fault {
            text += &format!(", {fault:.2?}");
        }
        if let Some(other) = self.other {
            text += &format!(" with {other}");
        }
        match self.late_us {
            Some(0) | None => text,
            Some(us) => format!("{text}, {us} us"),
        }
    }
}

/// A scene with its wearer, one angle broken; what was said of it from then on, °.
type Played<D> = (Bench<D>, Option<[f64; 2]>, io::Result<()>);

fn played<B: Replays>(
    boards: &B,
    script: &Script<B>,
    drawn: Option<&Drawn<'_>>,
) -> Result<Played<B::Board>, FaultsError> {
    let session = &script.file.session;
    let Bench {
        device,
        recorder,
        sensors,
        ..
    } = script.board(boards, script.first_us())?;
    let boot_us = script.first_us();
    let shared = Arc::new(Mutex::new(device));
    let body = body_of(session, 0).map_err(|e| FaultsError::NeverStimulates(e.to_string()))?;
    let device = Box::new(Arc::clone(&shared));
    let boot = Micros::new(boot_us as u32); // far from wrapping
    let mut world = World::new(device, body, boot, Faults::default(), 0);
    (world.recorder, world.sensors) = (recorder, sensors);
    fit(&mut world, session);
    let moment_us = drawn.map_or(u64::MAX, |drawn| drawn.moment_us);
    let fault = drawn.and_then(|drawn| drawn.fault);
    let mut broken = BrokenSensor::new(fault.unwrap_or(SensorFault::Stuck), moment_us);
    if drawn.is_some_and(|drawn| drawn.angle.is_converted()) {
        world.broken_joint = Some(broken.clone());
    }
    let (said, done) = match say(&mut world, script, drawn, &mut broken) {
        Ok(said) => (said, Ok(())),
        Err(lost) => (None, Err(lost)),
    };
    let recorder = std::mem::take(&mut world.recorder);
    let (now_us, sensors) = (world.now_us(), world.sensors);
    drop(world);
    let device = Arc::into_inner(shared).map(Mutex::into_inner);
    let Some(device) = device else {
        return Err(FaultsError::NeverStimulates("its world keeps it".into()));
    };
    let device = device.unwrap_or_else(PoisonError::into_inner);
    let mut bench = Bench::of(device, recorder, now_us, sensors);
    let listened = bench.run_to(now_us);
    Ok((bench, said, done.and(listened)))
}

/// Says the script, its angles measured anew. Back comes what was said of the broken one,
/// early enough to be found while it is heeded, °.
fn say<B: Replays>(
    world: &mut World,
    script: &Script<B>,
    drawn: Option<&Drawn<'_>>,
    broken: &mut BrokenSensor,
) -> io::Result<Option<[f64; 2]>> {
    let (mut said, heeded_us) = (None, heeded_us(script));
    let mut late: Vec<(u64, Vec<u8>)> = Vec::new();
    for write in script.said.writes() {
        while let Some(first) = late.first().map(|it| it.0).filter(|at| *at <= write.t_us) {
            world.run_until(first)?;
            world.send(&late.remove(0).1);
        }
        world.run_until(write.t_us)?;
        if write.t_us + SOON_US < heeded_us {
            said = world.broken_joint.as_ref().unwrap_or(broken).said_deg();
        }
        let asked = request(&write.bytes);
        let measured = asked.and_then(|asked| measurement(world, script, asked));
        let Some((asked, joint, deg)) = measured else {
            world.send(&write.bytes);
            continue;
        };
        let remade = match drawn {
            Some(drawn) => drawn.remade(write.t_us, joint, deg, broken),
            None => Some((0, joint, deg)),
        };
        let Some((late_us, joint, deg)) = remade else {
            continue;
        };
        let frame = measurement_frame(&asked, joint, deg)?;
        match late_us {
            0 => world.send(&frame),
            _ => late.push((write.t_us + late_us, frame)),
        }
    }
    world.run_until(script.end_us())?;
    Ok(said)
}

/// Until when the device heeds an angle that is beyond belief: while it stimulates, of a
/// lift while an object is held.
fn heeded_us<B: Replays>(script: &Script<B>) -> u64 {
    let is_held = |write: &Write| match request(&write.bytes)?.request {
        Request::Held { held } => held.then_some(write.t_us),
        _ => None,
    };
    let held_us = script.said.writes().iter().filter_map(is_held).next_back();
    held_us.unwrap_or(script.stop.1)
}

/// A measurement among what is said, with the angle as the wearer has it now.
fn measurement<B: Replays>(
    world: &World,
    script: &Script<B>,
    asked: ToDevice,
) -> Option<(ToDevice, u8, f64)> {
    let Request::Measurement {
        joint, centideg, ..
    } = asked.request
    else {
        return None;
    };
    let body = &world.body;
    let deg = match (body.posture_deg(), &script.file.session.joint) {
        (Some(angles), _) => *angles.get(usize::from(joint))?,
        (None, Some(_)) => body.sensed_deg(),
        (None, None) => f64::from(centideg) * 1e-2, // a lift's angles are the script's
    };
    Some((asked, joint, deg))
}

fn measurement_frame(asked: &ToDevice, joint: u8, deg: f64) -> io::Result<Vec<u8>> {
    let Request::Measurement { at, .. } = asked.request else {
        return Err(io::Error::other("no measurement"));
    };
    let centideg = (deg * 100.0).round() as i16; // saturates
    let request = Request::Measurement {
        joint,
        centideg,
        at,
    };
    let asked = ToDevice {
        request,
        session: asked.session,
        seq: asked.seq,
    };
    let frame = encode(&asked).ok_or_else(|| io::Error::other("a request that fits no frame"))?;
    Ok(frame.to_vec())
}

impl<B: Replays> Draws for Sensor<B> {
    fn case(&self, index: u64) -> Result<Case, FaultsError> {
        let (script, drawn) = self.draw(index)?;
        let (moment_us, end_us) = (drawn.moment_us, script.end_us());
        let (mut bench, said, played) = played(&self.boards, script, Some(&drawn))?;
        let session = &script.file.session;
        let orders = Orders::of(session, script.said.writes(), B::LINE_US);
        let mut truth = script.truth();
        truth.quiet = orders.owed(script.said.writes(), moment_us, end_us).quiet;
        let (mut fate, verdict) = judged(&mut bench, moment_us, truth);
        fate.bare = script.bare(&verdict);
        let changed = first_difference(&script.whole, &bench.recorder.trace, moment_us, end_us);
        fate.changed_us = changed.map(|at| at - moment_us);
        let stopped = played.err().map(|e| e.to_string());
        // A force that cannot be made with such an angle is refused, and its host silent.
        let ended = bench.heard().stopping.map(|(at, _)| u64::from(at.get()));
        fate.found |= ended.is_some_and(|at| (moment_us..script.stop.1).contains(&at));
        // What it finds of what it need not is no false alarm: the angle is wrong.
        fate.must_find = stopped.is_none() && (drawn.is_owed(said) || fate.found);
        Ok(Case {
            index,
            moment_us,
            what: drawn.in_words(&script.file.name),
            fate: Fate { stopped, ..fate },
        })
    }

    fn notes(&self) -> Vec<String> {
        let kinds = self.kinds.in_words();
        vec![
            format!("Drawn: {kinds}; the loop is closed through the scene's wearer."),
            "To find: an angle more than 20 degrees beyond its joint's range, and one older \
             than its joint allows; found by a fault, or ended because the force at the hand \
             cannot be made. Not to find, but counted where it is: an angle that may be \
             believed, however wrong; the limits bound what comes of it."
                .to_owned(),
        ]
    }
}
