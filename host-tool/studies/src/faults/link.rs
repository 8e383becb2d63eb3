//! Fault campaign: a host's messages are corrupted in transit. Damaged frames must have no effect,
//! and silence and `Stop` must end stimulation.

use super::Draws;
use super::bench::Bench;
use super::case::{Case, CaseResult};
use super::declaration::Declaration;
use super::error::FaultsError;
use super::kinds::Kinds;
use super::orders::{Orders, broken_frames};
use super::played_on::{EndCondition, is_isolated_for};
use super::script::{ForkableBoards, Script, decode_request, name};
use super::simulated::judge_case;
use super::stem::first_difference;
use super::truth::allow_checks;
use firmware::link::{Code, Request, ToDevice, encode};
use hal_sim::lockstep::Device;
use hal_sim::random::Random;
use hal_sim::wire::stream::{Stream, Write};
use rayon::prelude::*;

/// Random stream of this fault class; every class has its own, so that their random numbers are
/// independent.
const STREAM: u64 = 0x114C;
/// Bytes in a full USB packet, and the number of packets in a full-speed frame of 1 ms.
const PACKET: (usize, u64) = (64, 19);
/// Longest time until bytes that the host wrote before the cable was pulled have arrived, µs.
const ON_THE_WAY_US: u64 = 1_500;

/// Campaign in which messages are corrupted: the source of boards, the recorded sessions, and the
/// kinds of fault.
pub(super) struct Link<B: ForkableBoards> {
    boards: B,
    scripts: Vec<Script<B>>,
    kinds: Kinds,
    /// Whether every case runs to its configured end, even if its result is certain earlier.
    to_the_end: bool,
}

/// One randomly generated case: the corrupted stream of messages, and when the fault begins.
struct LinkCase {
    stream: Stream,
    /// Intact frames that the fault adds to those of the script.
    written: Vec<Vec<u8>>,
    /// Times at which the cable is pulled and plugged in again, µs; `None` if it stays in.
    out: Option<(u64, u64)>,
    moment_us: u64,
    /// Whether every frame of the script still arrives intact and on time, because the fault only
    /// adds bytes.
    is_beside: bool,
    what: String,
}

impl<B: ForkableBoards> Link<B> {
    pub fn new(seed: u64, declaration: &Declaration, boards: B) -> Result<Self, FaultsError> {
        let files = std::iter::once(&declaration.scene).chain(&declaration.scenes);
        let files: Vec<_> = files.collect();
        let scripts = files.into_par_iter().map(|file| {
            let mut script = Script::record(&boards, file)?;
            script.replay(&boards)?;
            Ok(script)
        });
        let scripts = scripts.collect::<Result<_, FaultsError>>()?;
        let kinds = Kinds::new(declaration, &boards, seed, STREAM);
        Ok(Self {
            boards,
            scripts,
            kinds,
            to_the_end: declaration.to_the_end,
        })
    }

    fn draw(&self, index: u64) -> Result<(&Script<B>, LinkCase), FaultsError> {
        let (kind, mut random) = self.kinds.draw(index)?;
        let script = pick(&mut random, &self.scripts)?;
        let at = message(script, &mut random);
        let writes = script.said.writes();
        let Write { t_us, bytes } = &writes[at];
        let mut drawn = LinkCase {
            stream: script.said.clone(),
            written: Vec::new(),
            out: None,
            moment_us: *t_us,
            is_beside: matches!(
                kind,
                "duplicated" | "frames out of place" | "flood of frames"
            ),
            what: String::new(),
        };
        let details = drawn.break_stream(kind, at, script, &mut random);
        let asked = decode_request(bytes)
            .map_or_else(|| "no frame".to_owned(), |to_device| name(&to_device));
        let file = &script.file.name;
        drawn.what = format!("{kind}: {file}, message {at}, {asked}{details}");
        Ok((script, drawn))
    }

    fn play(&self, script: &Script<B>, drawn: &LinkCase) -> Result<CaseResult, FaultsError> {
        let LinkCase {
            stream,
            moment_us,
            out,
            ..
        } = drawn;
        let session = &script.file.session;
        let orders = Orders::from_session(session, script.said.writes(), B::LINE_US);
        let last = stream.writes().last().map_or(0, |write| write.t_us);
        let sent = script.said.writes().iter().map(|write| &*write.bytes);
        let sent: Vec<&[u8]> = sent
            .chain(drawn.written.iter().map(|values| &**values))
            .collect();
        let moments = [*moment_us, drawn.resume_us(script), last];
        let on = EndCondition::new(script, &orders, &sent, moments);
        let is_over = |bench: &Bench<B::Board>, passed: &[Write], left: &[Write]| {
            !self.to_the_end && on.is_over(bench, passed, left)
        };
        let mut bench = script.board(&self.boards, *moment_us)?;
        let (passed, played) = script.send_stream(&mut bench, stream, *out, on.end_us, &is_over);
        let end_us = bench.now_us();
        let (intact, broken) = broken_frames(&passed, &sent);
        let mut truth = script.truth();
        let owed = orders.expected_effects(&intact, *moment_us, end_us);
        allow_checks(&mut truth, owed.checks);
        truth.quiet = owed.quiet;
        let (mut fate, verdict) = judge_case(&mut bench, *moment_us, truth);
        fate.bare = script.unprotected_findings(&verdict);
        match played {
            Ok(ended) => fate.ended = ended,
            Err(lost) => fate.stopped = Some(lost.to_string()),
        }
        let trace = &bench.recorder.trace;
        let changed = first_difference(&script.whole, trace, *moment_us, end_us);
        fate.changed_us = changed.map(|at| at - moment_us);
        let is_applied =
            B::IS_EXACT && broken > 0 && self.changes_output(script, &bench, &intact, end_us)?;
        drawn.judge_detection(&mut fate, &bench, (broken > 0, owed.is_silenced));
        fate.found &= !is_applied;
        Ok(fate)
    }

    /// Returns whether the output differs from that of a board which receives only the intact
    /// frames `intact`, at the same times.
    fn changes_output(
        &self,
        script: &Script<B>,
        bench: &Bench<B::Board>,
        intact: &[Write],
        end_us: u64,
    ) -> Result<bool, FaultsError> {
        let mut other = script.board(&self.boards, 0)?;
        let stream = Stream::new(intact.to_vec());
        let (_, played) = script.send_stream(&mut other, &stream, None, end_us, &|_, _, _| false);
        let differs = || {
            let traces = (&bench.recorder.trace, &other.recorder.trace);
            first_difference(traces.0, traces.1, 0, end_us).is_some()
        };
        Ok(played.is_err() || differs())
    }
}

impl LinkCase {
    /// Judges whether the device had to detect the fault, and whether it did. `broken` is whether
    /// damaged frames arrived, `silenced` whether a host silence must have ended stimulation.
    fn judge_detection<D: Device>(
        &self,
        fate: &mut CaseResult,
        bench: &Bench<D>,
        (broken, silenced): (bool, bool),
    ) {
        // While the cable is out nobody receives its reports, so only the end of its output counts.
        let (is_out, heard) = (self.out.is_some(), bench.reports());
        let tells = broken && !is_out;
        let is_told = !tells || heard.refused.iter().any(|pair| is_frame_error(pair.0));
        let ends = heard.stopping.is_some() || heard.fault.is_some();
        let is_ended = !silenced || ends || is_out && fate.severe.is_empty();
        // Any other report refers to missing or late messages; otherwise it is a false alarm.
        let is_owed = tells || silenced || fate.found && !self.is_beside;
        fate.must_find = is_owed && fate.stopped.is_none();
        if is_owed {
            fate.found = is_told && is_ended;
        }
        if silenced && is_isolated_for(bench, 0) {
            let last = bench.recorder.trace.levels.last();
            fate.isolated_us = last.map(|(at, _)| at.saturating_sub(self.moment_us));
        }
    }

    /// Returns the time from which the device again receives all messages of the script unchanged,
    /// µs.
    fn resume_us<B: ForkableBoards>(&self, script: &Script<B>) -> u64 {
        let (corrupted, whole) = (self.stream.writes(), script.said.writes());
        let pairs = corrupted.iter().rev().zip(whole.iter().rev());
        let same = pairs
            .take_while(|(current, other)| current == other)
            .count();
        let again = corrupted.get(corrupted.len() - same).or(corrupted.last());
        let in_us = self.out.map_or(0, |(_, in_us)| in_us);
        let in_us = match in_us {
            0 | u64::MAX => 0, // the cable was never pulled, or for good
            in_us => in_us + B::CONNECTS_US,
        };
        again
            .map_or(0, |write| write.t_us)
            .max(self.moment_us)
            .max(in_us)
    }

    /// Corrupts the stream at its write with index `at`, as `kind` says; returns the random
    /// details.
    fn break_stream<B: ForkableBoards>(
        &mut self,
        kind: &str,
        at: usize,
        script: &Script<B>,
        random: &mut Random,
    ) -> String {
        let timeout_us = 1000 * u64::from(script.file.session.wearer.host_timeout_ms);
        let (t_us, length) = (self.moment_us, self.stream.writes()[at].bytes.len());
        let for_us = random.log_between(5e3, 5e5) as u64;
        match kind {
            "silence" => self.stream.drop_writes(t_us, u64::MAX),
            "pause" => {
                let for_us = timeout_us - 40_000 + random.below(80_000);
                self.stream.drop_writes(t_us, t_us + for_us);
                return format!(", for {for_us} us");
            }
            "random bytes" | "flood of bytes" | "frames out of place" | "flood of frames" => {
                return self.insert_noise(kind, script, random);
            }
            "corrupted" => {
                let count = 1 + random.below(2) * random.below(8);
                let bits = (0..count).map(|_| random.below(8 * length as u64) as usize);
                let bits: Vec<usize> = bits.collect();
                self.stream.flip_bits(at, &bits);
                return format!(", bits {bits:?}");
            }
            "reordered" => {
                let other = (at + 1 + random.below(5) as usize).min(script.stop.0);
                self.stream.swap_writes(at, other);
                return format!(", with {other}");
            }
            "duplicated" => {
                let count = 1 + random.below(5);
                for _ in 0..count {
                    self.stream.repeat_write(at, random.below(20_000));
                }
                return format!(", {count} times more");
            }
            "cut" => {
                let (kept, late_us) = (random.below(length as u64), random.below(30_000));
                let late_us = (random.below(2) == 1).then_some(late_us);
                self.stream.truncate_write(at, kept as usize, late_us);
                return format!(", after {kept} bytes, the rest {late_us:?} us late");
            }
            _ => {
                let is_half = random.below(2) == 1;
                if is_half {
                    self.stream
                        .truncate_write(at, random.below(length as u64) as usize, None);
                }
                let out_us = t_us + ON_THE_WAY_US;
                let in_us = match kind {
                    "unplugged" => u64::MAX,
                    _ => out_us + for_us,
                };
                self.out = Some((out_us, in_us));
                self.stream.drop_writes(out_us, in_us);
                let after = if is_half { "within it" } else { "after it" };
                return match kind {
                    "unplugged" => format!(", {after}"),
                    _ => format!(", {after}, for {for_us} us"),
                };
            }
        }
        String::new()
    }

    /// Inserts random bytes or additional frames between two writes. Half of the floods end with a
    /// `Stop`.
    fn insert_noise<B: ForkableBoards>(
        &mut self,
        kind: &str,
        script: &Script<B>,
        random: &mut Random,
    ) -> String {
        let begin_us = self.moment_us + 1 + random.below(5_000);
        let ms = random.log_between(5.0, 50.0) as u64;
        let mut t_us = begin_us;
        let (length, packets) = match kind {
            "random bytes" => (1 + random.below(600), 1),
            "frames out of place" => (random.below(400), 1),
            _ => (PACKET.0 as u64, PACKET.1 * ms),
        };
        for _ in 0..packets {
            let packet = match kind.ends_with("bytes") {
                true => (0..length).map(|_| random.word() as u8).collect(),
                false => self.frames(script, length as usize, random),
            };
            self.stream.add(t_us, packet);
            t_us += 1_000 / PACKET.1;
        }
        let stops = kind.starts_with("flood") && random.below(2) == 1;
        if stops {
            let stop = script.said.writes()[script.stop.0].bytes.clone();
            self.stream.add(t_us, [vec![0], stop].concat());
        } else if random.below(2) == 1 {
            self.stream.add(t_us, vec![0]);
        }
        let stops = if stops { ", then a stop" } else { "" };
        format!(
            ", {} bytes in {} us{stops}",
            length * packets,
            t_us - begin_us
        )
    }

    /// Returns intact frames of more than `length` bytes in total, copied from the script. Half of
    /// them get a foreign session number.
    fn frames<B: ForkableBoards>(
        &mut self,
        script: &Script<B>,
        length: usize,
        random: &mut Random,
    ) -> Vec<u8> {
        let mut bytes = Vec::new();
        while bytes.len() <= length {
            let writes = script.said.writes();
            let frame = &writes[random.below(writes.len() as u64) as usize].bytes;
            let mut asked = decode_request(frame);
            if random.below(2) == 1
                && let Some(asked) = &mut asked
                && asked.request != Request::Stop
            {
                asked.session ^= 1 + random.below(0xFFFF) as u16;
            }
            let seq = random.word() as u16;
            let frame = asked.and_then(|asked| encode(&ToDevice { seq, ..asked }));
            let Some(frame) = frame else { continue };
            bytes.extend_from_slice(&frame);
            self.written.push(frame.to_vec());
        }
        bytes
    }
}

/// Chooses one of the script's writes at random. In half of the choices, only writes up to `Start`
/// and from `Stop` on are possible, so that these few are not rare.
fn message<B: ForkableBoards>(script: &Script<B>, random: &mut Random) -> usize {
    let (count, (start, _), (stop, _)) = (script.said.writes().len(), script.start, script.stop);
    let around = start + 1 + (count - stop);
    match random.below(2) {
        0 => random.below(count as u64) as usize,
        _ => match random.below(around as u64) as usize {
            before if before <= start => before,
            after => stop + after - start - 1,
        },
    }
}

fn pick<'a, T>(random: &mut Random, items: &'a [T]) -> Result<&'a T, FaultsError> {
    let drawn = random.below(items.len().max(1) as u64) as usize;
    let none = || FaultsError::Declaration("there are no scenes".into());
    items.get(drawn).ok_or_else(none)
}

/// Returns whether a refusal code complains about the frame itself instead of its request.
fn is_frame_error(code: u16) -> bool {
    (Code::BadCrc as u16..=Code::UnknownMessage as u16).contains(&code)
}

impl<B: ForkableBoards> Draws for Link<B> {
    fn case(&self, index: u64) -> Result<Case, FaultsError> {
        let (script, drawn) = self.draw(index)?;
        let fate = self.play(script, &drawn)?;
        Ok(Case {
            index,
            moment_us: drawn.moment_us,
            what: drawn.what,
            fate,
        })
    }

    fn notes(&self) -> Vec<String> {
        let kinds = self.kinds.in_words();
        let exact = match B::IS_EXACT {
            true => "while the output stays as without that frame",
            false => "(the native campaign also compares the output with that without the frame)",
        };
        vec![
            format!("Injected at random: {kinds}."),
            format!(
                "Must be found: a damaged frame, which the device reports by number {exact}; \
                 and a silence longer than the timeout, which ends stimulation."
            ),
            "Need not be found: undamaged frames that are only late, early or repeated.".to_owned(),
        ]
    }
}
