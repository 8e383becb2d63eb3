//! Alignment: finds the session time and the clock error of a capture by the pattern of its edges.
//!
//! Seeds pair one measured edge with every expected edge of its line and direction. The edges
//! around it select the plausible seeds. Each of these grows from the seed outwards, so that a
//! clock error of 1000 ppm never leads to a wrong pair. All lines of the capture score the result.

use super::FitError;
use super::agreement::{FIT_NS, FITTING, GUARD_NS, Span, WRONG, agreement, edges_after};
use super::clock::{Clock, fit_clock, median, weighted_median};
use super::track::{Track, Tracks};

/// Largest clock error that the alignment searches: 1000 ppm, and 10 % for the estimate's error.
const MAX_DRIFT: f64 = 1.1e-3;

/// Distance within which an edge fits while a seed grows, without the clock's error, nanoseconds.
const GROW_NS: f64 = 2_000.0;

/// Number of edges on either side that judge a seed.
const WINDOW: usize = 30;

/// Largest number of anchors, the measured edges that seeds start from.
const ANCHORS: usize = 4;

/// Edges of a missing or an additional pulse.
const EDGES_OF_A_PULSE: usize = 2;

/// Cost of an alignment in which the capture ends after the prediction: more than that of a missing
/// pulse at the end of the capture.
const BEYOND: i64 = WRONG * (EDGES_OF_A_PULSE as i64 + 1);

/// Number of alignments with one faulty pulse per alignment without, above which the latter is not
/// credible. One whole session has two of them: one period earlier and one later.
const CREDIBLE_RATIO: usize = 4;

/// Largest number of alignments that are tried; of equally plausible ones, the earliest.
const MAX_HYPOTHESES: usize = 4_096;

/// Smallest number of alignments that are tried.
const MIN_HYPOTHESES: usize = 64;

/// Number of edges, summed over all alignments, up to which more than [`MIN_HYPOTHESES`] are
/// tried: some seconds.
const MAX_WORK: usize = 100_000_000;

/// Alignment of a capture.
pub(super) struct Aligned {
    pub clock: Clock,
    /// True if the capture fits only with all levels inverted.
    pub inverted: bool,
    /// Time between this alignment and the nearest one that explains the capture as well,
    /// nanoseconds, and the number of these alignments. `None` if the alignment is unique.
    pub repetition: Option<(f64, usize)>,
    /// True if most alignments differ from this one by one pulse that is missing or additional.
    pub ambiguous: bool,
}

#[derive(Clone, Copy)]
struct Hypothesis {
    clock: Clock,
    score: i64,
    matched: usize,
    measured: usize,
    /// Missing edges, extra edges and wrong levels of the lines that have a vote.
    wrong: usize,
    /// Cost of the part of the capture after the prediction.
    outside: i64,
}

impl Hypothesis {
    /// Returns whether the alignment explains the part of the capture that is not after the
    /// prediction, and at least 30 % of all edges.
    fn is_usable(&self) -> bool {
        self.score + self.outside > 0 && self.matched * 10 >= self.measured * 3
    }

    fn rank(&self) -> (bool, i64) {
        (self.is_usable(), self.score)
    }
}

/// Aligns a capture with the expected edges.
pub(super) fn align(tracks: &Tracks) -> Result<Aligned, FitError> {
    if tracks.measured.iter().all(|track| track.times.is_empty()) {
        return Err(FitError::NothingMeasured);
    }
    if tracks
        .pairs()
        .all(|(_, expected)| expected.times.is_empty())
    {
        return Err(FitError::NothingExpected);
    }
    let mut hypotheses = search(tracks);
    let mut best = choose(&hypotheses);
    let mut inverted = false;
    // Isolators that invert make a whole capture inverted: worth a second search if most edges
    // do not fit.
    if best.is_none_or(|best| best.matched * 10 < best.measured * 6) {
        let others = search(&tracks.inverted());
        let other = choose(&others);
        let rank = |hypothesis: Option<Hypothesis>| hypothesis.map_or((false, 0), |h| h.rank());
        if rank(other) > rank(best) {
            (hypotheses, best, inverted) = (others, other, true);
        }
    }
    let measured = tracks.measured.iter().map(|track| track.times.len()).sum();
    let matched = best.map_or(0, |best| best.matched);
    let usable = best.filter(Hypothesis::is_usable);
    let best = usable.ok_or(FitError::NotAligned { matched, measured })?;
    Ok(Aligned {
        clock: best.clock,
        inverted,
        repetition: repetition(&hypotheses, best, tracks.measured.len()),
        ambiguous: ambiguous(&hypotheses, best),
    })
}

/// Returns the usable hypothesis with the highest score; of equal ones that with the earliest time.
fn choose(hypotheses: &[Hypothesis]) -> Option<Hypothesis> {
    let start = |h: &Hypothesis| h.clock.to_expected(0.0);
    let mut best: Option<Hypothesis> = None;
    for hypothesis in hypotheses {
        let better = best.is_none_or(|best| {
            let (rank, highest) = (hypothesis.rank(), best.rank());
            rank > highest || rank == highest && start(hypothesis) < start(&best)
        });
        if better {
            best = Some(*hypothesis);
        }
    }
    best
}

/// Finds the other alignments that explain the capture as well as the best one. An edge at either
/// end may or may not lie in the span, so scores that differ by two edges per line count as equal.
fn repetition(hypotheses: &[Hypothesis], best: Hypothesis, lines: usize) -> Option<(f64, usize)> {
    let tolerance = 2 * FITTING * lines as i64;
    let shifts = hypotheses
        .iter()
        .filter(|h| h.score >= best.score - tolerance)
        .map(|h| shift(h, best))
        .filter(|shift| *shift > FIT_NS);
    let count = shifts.clone().count();
    Some((shifts.min_by(f64::total_cmp)?, count))
}

/// Returns whether the best alignment is not credible: a pulse that is missing in the middle of a
/// session may look like the start or the end of the session. This is assumed if most alignments
/// differ from the best one by one pulse.
fn ambiguous(hypotheses: &[Hypothesis], best: Hypothesis) -> bool {
    let one_pulse = best.wrong + 1..=best.wrong + EDGES_OF_A_PULSE;
    let tolerance = (FITTING + WRONG) * EDGES_OF_A_PULSE as i64;
    let count = |faulty: bool| {
        let near = hypotheses.iter().filter(|h| {
            let similar = h.score >= best.score - tolerance && shift(h, best) > FIT_NS;
            similar && one_pulse.contains(&h.wrong) == faulty
        });
        near.count()
    };
    count(true) > CREDIBLE_RATIO * (count(false) + 1)
}

/// Returns the distance of two alignments, session nanoseconds.
fn shift(a: &Hypothesis, b: Hypothesis) -> f64 {
    (a.clock.to_expected(0.0) - b.clock.to_expected(0.0)).abs()
}

/// Measurement edge of any line.
#[derive(Clone, Copy)]
struct Event {
    time: f64,
    line: usize,
    index: usize,
}

/// Pair of a measured and an expected edge that an alignment may start from.
#[derive(Clone, Copy)]
struct Seed {
    measured: f64,
    expected: f64,
    score: usize,
    /// Largest distance of an edge in the window, nanoseconds.
    radius: f64,
}

fn search(tracks: &Tracks) -> Vec<Hypothesis> {
    let events = events(tracks);
    let mut anchors: Vec<Vec<Seed>> = Vec::new();
    for (line, (measured, expected)) in tracks.voters() {
        let count = measured.times.len();
        let mut indices = vec![count / 4, count / 2, count * 3 / 4];
        indices.dedup();
        for index in indices.into_iter().filter(|index| *index < count) {
            let seeds = seeds(tracks, &events, (measured, expected), index, line);
            if !seeds.is_empty() {
                anchors.push(seeds);
            }
        }
    }
    let best = |seeds: &Vec<Seed>| seeds.iter().map(|seed| seed.score).max();
    anchors.sort_by_key(|seeds| std::cmp::Reverse(best(seeds)));
    anchors.truncate(ANCHORS);
    let threshold = anchors.first().and_then(best).unwrap_or(0) * 7 / 10;
    let mut seeds: Vec<Seed> = anchors.into_iter().flatten().collect();
    seeds.retain(|seed| seed.score >= threshold);
    seeds.sort_by_key(|seed| std::cmp::Reverse(seed.score));
    let mut hypotheses: Vec<Hypothesis> = Vec::new();
    let mut best_so_far: Option<Hypothesis> = None;
    let edges: usize = tracks.voters().map(|(_, (m, _))| m.times.len()).sum();
    let mut tries = (MAX_WORK / edges.max(1)).clamp(MIN_HYPOTHESES, MAX_HYPOTHESES);
    for seed in seeds {
        let agrees =
            |h: &Hypothesis| (h.clock.to_expected(seed.measured) - seed.expected).abs() < GROW_NS;
        if hypotheses.iter().any(agrees) {
            continue;
        }
        if tries == 0 {
            break;
        }
        tries -= 1;
        // All alignments have the clock of the one analyser, so a good drift is tried first.
        let known = best_so_far
            .and_then(|best| shifted(tracks, &events, seed, best.clock.drift))
            .map(|clock| score(tracks, clock));
        let good = |h: &Hypothesis| best_so_far.is_some_and(|best| h.score * 10 > best.score * 9);
        let grown = || grow(tracks, &events, seed).map(|clock| score(tracks, clock));
        let Some(hypothesis) = known.filter(good).or_else(grown) else {
            continue;
        };
        hypotheses.push(hypothesis);
        if best_so_far.is_none_or(|best| hypothesis.score > best.score) {
            best_so_far = Some(hypothesis);
        }
    }
    hypotheses
}

/// Returns the measured edges of the lines that may decide, in order of time.
fn events(tracks: &Tracks) -> Vec<Event> {
    let mut events = Vec::new();
    for (line, (measured, _)) in tracks.voters() {
        let times = measured.times.iter().enumerate();
        events.extend(times.map(|(index, &time)| Event { time, line, index }));
    }
    events.sort_by(|a, b| a.time.total_cmp(&b.time).then(a.line.cmp(&b.line)));
    events
}

/// Returns the session time and the partner's time of a measured edge under a clock.
fn partner(tracks: &Tracks, event: Event, clock: Clock, tolerance: f64) -> Option<(f64, f64)> {
    let measured = tracks.measured.get(event.line)?;
    let expected = tracks.expected.get(event.line)?;
    let time = clock.to_expected(event.time);
    let (_, partner) = expected.nearest(time, measured.edge(event.index), tolerance)?;
    Some((time, partner))
}

fn seeds(
    tracks: &Tracks,
    events: &[Event],
    (measured, expected): (&Track, &Track),
    index: usize,
    line: usize,
) -> Vec<Seed> {
    let Some(&anchor) = measured.times.get(index) else {
        return Vec::new();
    };
    let place = events.partition_point(|e| (e.time, e.line) < (anchor, line));
    let end = events.len().min(place + WINDOW + 1);
    let window = events
        .get(place.saturating_sub(WINDOW)..end)
        .unwrap_or_default();
    let distances = window.iter().map(|event| (event.time - anchor).abs());
    let radius = distances.fold(0.0, f64::max);
    let direction = measured.edge(index);
    let candidates = expected.times.iter().enumerate();
    candidates
        .filter(|(candidate, _)| expected.edge(*candidate) == direction)
        .map(|(_, &time)| {
            let clock = Clock {
                expected_0: time,
                measured_0: anchor,
                drift: 0.0,
            };
            let fits = |event: &&Event| {
                let tolerance = GROW_NS + MAX_DRIFT * (event.time - anchor).abs();
                partner(tracks, **event, clock, tolerance).is_some()
            };
            Seed {
                measured: anchor,
                expected: time,
                score: window.iter().filter(fits).count(),
                radius,
            }
        })
        .collect()
}

/// Returns the edges within a distance of a seed.
fn around(events: &[Event], seed: Seed, radius: f64) -> &[Event] {
    let start = events.partition_point(|e| e.time < seed.measured - radius);
    let end = events.partition_point(|e| e.time <= seed.measured + radius);
    events.get(start..end.max(start)).unwrap_or_default()
}

/// Returns the clock with a known drift that fits the edges around a seed. The seed itself may be
/// an edge that moved.
fn shifted(tracks: &Tracks, events: &[Event], seed: Seed, drift: f64) -> Option<Clock> {
    let clock = Clock {
        expected_0: seed.expected,
        measured_0: seed.measured,
        drift,
    };
    let fits = |event: &Event| partner(tracks, *event, clock, FIT_NS);
    let window = around(events, seed, seed.radius).iter();
    let mut late: Vec<f64> = window.filter_map(fits).map(|(t, p)| t - p).collect();
    Some(Clock {
        expected_0: seed.expected - median(&mut late)?,
        ..clock
    })
}

/// Extends an alignment from a seed to the whole capture. The clock error is at first the median
/// of the errors that single edges imply, then fitted to more and more edges.
fn grow(tracks: &Tracks, events: &[Event], seed: Seed) -> Option<Clock> {
    let mut clock = Clock {
        expected_0: seed.expected,
        measured_0: seed.measured,
        drift: 0.0,
    };
    let mut radius = seed.radius;
    let mut drifts: Vec<(f64, f64)> = Vec::new();
    for event in around(events, seed, radius) {
        let distance = event.time - seed.measured;
        let tolerance = GROW_NS + MAX_DRIFT * distance.abs();
        if distance.abs() * 8.0 < radius {
            continue;
        }
        if let Some((time, partner)) = partner(tracks, *event, clock, tolerance) {
            drifts.push(((time - partner) / distance, distance.abs()));
        }
    }
    clock.drift = weighted_median(&mut drifts)?.clamp(-MAX_DRIFT, MAX_DRIFT);
    let whole = tracks.end.max(radius);
    let mut uncertainty = (3.0 * GROW_NS / radius.max(1.0)).min(MAX_DRIFT);
    loop {
        let pairs: Vec<(f64, f64)> = around(events, seed, radius)
            .iter()
            .filter_map(|event| {
                let distance = (event.time - seed.measured).abs();
                let tolerance = GROW_NS + uncertainty * distance;
                let (_, partner) = partner(tracks, *event, clock, tolerance)?;
                Some((partner, event.time))
            })
            .collect();
        clock = fit_clock(&pairs, clock)?.clock;
        if clock.drift.abs() > MAX_DRIFT {
            return None;
        }
        if radius >= whole {
            return Some(clock);
        }
        uncertainty = (GROW_NS / 2.0 / radius.max(1.0)).min(MAX_DRIFT);
        radius = (radius * 4.0).min(whole);
    }
}

/// Scores an alignment. A line that carries another pattern has no vote. Edges after the prediction
/// count as wrong, so that an alignment is not better because it moves a fault there.
fn score(tracks: &Tracks, clock: Clock) -> Hypothesis {
    let span = Span::new(tracks, clock).inner();
    let mut hypothesis = Hypothesis {
        clock,
        score: 0,
        matched: 0,
        measured: 0,
        wrong: 0,
        outside: 0,
    };
    if clock.to_expected(tracks.end) > tracks.until + GUARD_NS {
        hypothesis.outside = BEYOND;
    }
    for (_, (measured, expected)) in tracks.voters() {
        let fit = agreement(measured, expected, clock, span);
        let after = edges_after(tracks, measured, clock);
        if fit.votes() {
            hypothesis.score += fit.score();
            hypothesis.wrong += fit.errors();
            hypothesis.outside += WRONG * after as i64;
        }
        hypothesis.matched += fit.matched;
        hypothesis.measured += fit.measured + after;
    }
    hypothesis.score -= hypothesis.outside;
    hypothesis
}
