//! Replays a session to a board with a simulated wearer, whose angles are measured live, and forks
//! both.

use super::bench::{Bench, DeviceReports};
use super::broken_angle::{BrokenAngle, SOON_US};
use super::case::CaseEnd;
use super::error::{FaultsError, never_runs};
use super::orders::may_restart;
use super::script::{ForkableBoards, KEPT_US, Script, decode_request};
use super::simulated::is_isolated_for_good;
use firmware::link::{Request, ToDevice, encode};
use firmware::units::Micros;
use hal_sim::body::{BrokenSensor, SensorFault};
use hal_sim::wire::faults::Faults;
use hal_sim::wire::stream::Write;
use hal_sim::world::World;
use host_core::run::{SessionFile, attach_electrodes, create_body};
use std::collections::BTreeMap;
use std::io;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// A session with a simulated wearer: its undisturbed measurements, and stored copies from which
/// cases start.
pub(super) struct SensorScenario<B: ForkableBoards> {
    pub script: Script<B>,
    /// Undisturbed measurements of each angle that the host reports, by number of the angle.
    read: BTreeMap<u8, BrokenSensor>,
    /// Undisturbed measurements of the board's converter, if the board measures the angle.
    converted: BrokenSensor,
    /// Stored copies of board and wearer, each with its time, µs, and the index of the next message
    /// of the host.
    kept: Vec<(u64, usize, Mutex<BoardWithWearer<B>>)>,
    /// Whether every case runs from the beginning to its configured end, even if its result is
    /// certain earlier.
    to_the_end: bool,
}

/// A board that stimulates a simulated wearer, and what the board has reported.
struct BoardWithWearer<B: ForkableBoards> {
    device: Arc<Mutex<B::Board>>,
    world: World,
    heard: DeviceReports,
}

/// A case that was simulated.
pub(super) struct PlayedCase<D> {
    pub bench: Bench<D>,
    /// Smallest and largest value that the broken sensor reported, °. Values reported too late for
    /// the device to detect them are left out.
    pub said: Option<[f64; 2]>,
    /// How the run ended, or an error if the simulator does not model what the device did.
    pub done: io::Result<CaseEnd>,
}

impl<B: ForkableBoards> SensorScenario<B> {
    /// Plays the session with its own host, replays the recorded messages, and stores copies of
    /// board and wearer on the way.
    ///
    /// # Errors
    /// Fails as [`Script::record`] and [`Script::accept`] do.
    pub fn record(boards: &B, file: &SessionFile, to_the_end: bool) -> Result<Self, FaultsError> {
        let script = Script::record(boards, file)?;
        let mut worn = BoardWithWearer::boot(boards, &script)?;
        let mut scene = Self {
            script,
            read: BTreeMap::new(),
            converted: BrokenSensor::never_broken(),
            kept: Vec::new(),
            to_the_end,
        };
        worn.world.broken_joint = Some(BrokenSensor::never_broken());
        let mut next_us = 0;
        for (next, write) in scene.script.said.writes().iter().enumerate() {
            worn.run_to(write.t_us).map_err(never_runs)?;
            if write.t_us >= next_us
                && !to_the_end
                && let Some(fork) = worn.fork()
            {
                scene.kept.push((write.t_us, next, Mutex::new(fork)));
                next_us = write.t_us + KEPT_US;
            }
            let late = worn.send_write(&scene.script, write, &mut |t_us, joint, deg| {
                let sensor = scene.read.entry(joint);
                let sensor = sensor.or_insert_with(BrokenSensor::never_broken);
                Some((0, joint, sensor.read(t_us, deg)))
            });
            late.map_err(never_runs)?;
        }
        worn.run_to(scene.script.end_us()).map_err(never_runs)?;
        scene.converted = worn.world.broken_joint.take().unwrap_or(scene.converted);
        scene.script.accept(worn.into_bench()?)?;
        Ok(scene)
    }

    /// Plays the session with one angle broken, until the outputs are permanently isolated or the
    /// session ends.
    ///
    /// # Errors
    /// Fails if no board is available, before anything was broken.
    pub fn play(
        &self,
        boards: &B,
        drawn: &BrokenAngle<'_>,
    ) -> Result<PlayedCase<B::Board>, FaultsError> {
        let (mut worn, next, begin_us) = self.fork(boards, drawn.moment_us)?;
        let read = match drawn.angle.is_converted() {
            true => Some(&self.converted),
            false => self.read.get(&drawn.angle.index),
        };
        let (fault, intact) = (
            drawn.fault.unwrap_or(SensorFault::Stuck),
            BrokenSensor::never_broken(),
        );
        let read = read.unwrap_or(&intact);
        let mut broken = read.broken_from(begin_us, fault, drawn.moment_us);
        worn.world.broken_joint = drawn.angle.is_converted().then(|| broken.clone());
        let (reported_deg, done) = match worn.play(self, next, drawn, &mut broken) {
            Ok((said, ended)) => (said, Ok(ended)),
            Err(lost) => (None, Err(lost)),
        };
        let bench = worn.into_bench()?;
        Ok(PlayedCase {
            bench,
            said: reported_deg,
            done,
        })
    }

    /// Returns a copy of board and wearer from the last stored time up to `to_us`, the index of the
    /// next message, and that time, µs.
    fn fork(
        &self,
        boards: &B,
        to_us: u64,
    ) -> Result<(BoardWithWearer<B>, usize, u64), FaultsError> {
        let after = self.kept.partition_point(|kept| kept.0 <= to_us);
        if let Some((t_us, next, kept)) = self.kept[..after].last()
            && let Some(worn) = locked(kept).fork()
        {
            return Ok((worn, *next, *t_us));
        }
        let worn = BoardWithWearer::boot(boards, &self.script)?;
        Ok((worn, 0, self.script.first_us()))
    }
}

impl<B: ForkableBoards> BoardWithWearer<B> {
    /// Boots a board with its wearer, to which the host has sent nothing yet.
    fn boot(boards: &B, script: &Script<B>) -> Result<Self, FaultsError> {
        let (session, boot_us) = (&script.file.session, script.first_us());
        let Bench {
            device,
            recorder,
            sensors,
            ..
        } = script.board(boards, boot_us)?;
        let device = Arc::new(Mutex::new(device));
        let body =
            create_body(session, 0).map_err(|e| FaultsError::NeverStimulates(e.to_string()))?;
        let boot = Micros::new(boot_us as u32); // far from wrapping
        let shared = Box::new(Arc::clone(&device));
        let mut world = World::new(shared, body, boot, Faults::default(), 0);
        (world.recorder, world.sensors) = (recorder, sensors);
        attach_electrodes(&mut world, session);
        let heard = DeviceReports::default();
        Ok(Self {
            device,
            world,
            heard,
        })
    }

    /// Copies board and wearer; returns `None` if a new run is faster, or if the wearer cannot be
    /// copied.
    fn fork(&self) -> Option<Self> {
        let device = Arc::new(Mutex::new(B::fork(&locked(&self.device))?));
        Some(Self {
            world: self.world.fork(Box::new(Arc::clone(&device)))?,
            device,
            heard: self.heard.clone(),
        })
    }

    /// Returns the board with its recorded output, and discards the wearer.
    fn into_bench(self) -> Result<Bench<B::Board>, FaultsError> {
        let Self {
            device,
            mut world,
            heard,
        } = self;
        let recorder = std::mem::take(&mut world.recorder);
        let (now_us, sensors) = (world.now_us(), world.sensors);
        drop(world);
        let used = || never_runs("the simulation still uses the device");
        let device = Arc::into_inner(device).ok_or_else(used)?;
        let device = device.into_inner().unwrap_or_else(PoisonError::into_inner);
        Ok(Bench::new(device, recorder, now_us, sensors).with_reports(heard))
    }

    fn run_to(&mut self, to_us: u64) -> io::Result<()> {
        let done = self.world.run_until(to_us);
        self.heard.decode_recorded(&mut self.world.recorder);
        done
    }

    /// Sends the messages of `scene` from the one with index `next` on. Returns the smallest and
    /// the largest value that the broken sensor reported, as in [`PlayedCase`], and how the run
    /// ended.
    fn play(
        &mut self,
        scene: &SensorScenario<B>,
        next: usize,
        drawn: &BrokenAngle<'_>,
        broken: &mut BrokenSensor,
    ) -> io::Result<(Option<[f64; 2]>, CaseEnd)> {
        let script = &scene.script;
        let (mut reported_deg, heeded_us) = (None, heeded_us(script));
        let mut late: Vec<(u64, Vec<u8>)> = Vec::new();
        for (next, write) in script.said.writes().iter().enumerate().skip(next) {
            while let Some(first) = late
                .first()
                .map(|pair| pair.0)
                .filter(|at| *at <= write.t_us)
            {
                self.run_to(first)?;
                self.world.send(&late.remove(0).1);
            }
            self.run_to(write.t_us)?;
            let is_known = !scene.to_the_end && self.is_isolated_for_good();
            if is_known && !may_restart(&script.said.writes()[next..]) {
                return Ok((reported_deg, CaseEnd::Isolated));
            }
            if write.t_us + SOON_US < heeded_us {
                reported_deg =
                    (self.world.broken_joint.as_ref().unwrap_or(broken)).reported_range_deg();
            }
            late.extend(self.send_write(script, write, &mut |t_us, joint, deg| {
                drawn.replace_measurement(t_us, joint, deg, broken)
            })?);
        }
        self.run_to(script.end_us())?;
        Ok((reported_deg, CaseEnd::Played))
    }

    /// Sends one message of the host. If it contains an angle, `read` receives its time, µs, the
    /// number of the angle and its current value, °. `read` returns delay, µs, number and value to
    /// send instead, or `None` to drop the message. A delayed message is returned with its time
    /// instead of being sent.
    fn send_write(
        &mut self,
        script: &Script<B>,
        write: &Write,
        read: &mut dyn FnMut(u64, u8, f64) -> Option<(u64, u8, f64)>,
    ) -> io::Result<Option<(u64, Vec<u8>)>> {
        let asked = decode_request(&write.bytes);
        let measured = asked.and_then(|asked| measurement(&self.world, script, asked));
        let Some((asked, joint, deg)) = measured else {
            self.world.send(&write.bytes);
            return Ok(None);
        };
        let Some((late_us, joint, deg)) = read(write.t_us, joint, deg) else {
            return Ok(None);
        };
        let frame = measurement_frame(&asked, joint, deg)?;
        if late_us > 0 {
            return Ok(Some((write.t_us + late_us, frame)));
        }
        self.world.send(&frame);
        Ok(None)
    }

    fn is_isolated_for_good(&self) -> bool {
        let (device, now_us) = (locked(&self.device), self.world.now_us());
        is_isolated_for_good(&self.heard, &*device, &self.world.recorder.trace, now_us)
    }
}

fn locked<T>(shared: &Mutex<T>) -> MutexGuard<'_, T> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Returns the time until which the device checks whether angles are plausible, µs: the end of
/// stimulation or, in a lift, the time at which the object is held.
fn heeded_us<B: ForkableBoards>(script: &Script<B>) -> u64 {
    let is_held = |write: &Write| match decode_request(&write.bytes)?.request {
        Request::ObjectHeld { held } => held.then_some(write.t_us),
        _ => None,
    };
    let held_us = script.said.writes().iter().filter_map(is_held).next_back();
    held_us.unwrap_or(script.stop.1)
}

/// Returns a request that is a measurement, with the number of the angle and the simulated wearer's
/// current angle, °; `None` for any other request.
fn measurement<B: ForkableBoards>(
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
        (None, None) => f64::from(centideg) * 1e-2, // the angles of a lift come from the script
    };
    Some((asked, joint, deg))
}

fn measurement_frame(asked: &ToDevice, joint: u8, deg: f64) -> io::Result<Vec<u8>> {
    let Request::Measurement { at, .. } = asked.request else {
        return Err(io::Error::other("there is no measurement"));
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
    let frame =
        encode(&asked).ok_or_else(|| io::Error::other("a request is too long for a frame"))?;
    Ok(frame.to_vec())
}
