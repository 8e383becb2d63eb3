//! Programs: the amplitude of each burst that is ordered as the program specifies, with the rise
//! that docs/protocol.md describes, and on the native device.

use std::fmt::Write;

use firmware::pulse::CHANNELS;
use firmware::safety::Stimulus;
use firmware::units::{Amplitude, Micros};
use hal_sim::trace::{State, Trace};
use host_core::link::{Connection, Port, SimulatedPort};
use host_core::session::{Session, Setpoint};
use proptest::prelude::*;

use crate::link_native::native_world;

/// A channel with its rise and the times of its bursts.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bench {
    pub(super) period_us: u64,
    pub(super) offset_us: u64,
    pub(super) rise_ms: u64,
    pub(super) rise_bursts: u64,
    /// Thousandths of a mA.
    pub(super) limit: u64,
    pub(super) start: u64,
    pub(super) own_us: u64,
}

pub(super) const BENCH: Bench = Bench {
    period_us: 20_000,
    offset_us: 3_000,
    rise_ms: 400,
    rise_bursts: 1,
    limit: 12_000,
    start: 0,
    own_us: 200,
};

impl Bench {
    /// Returns a session with one channel of this kind and these programs.
    fn session(&self, duration_s: u64, programs: &str) -> Session {
        let text = self.text(duration_s, programs);
        Session::parse("program.toml", &text).unwrap_or_else(|e| panic!("{}\n{text}", e.lines()))
    }

    fn text(&self, duration_s: u64, programs: &str) -> String {
        let [limit, start] = [self.limit, self.start].map(|value| value as f64 / 1e3);
        format!(
            "title = \"program\"\nduration_s = {duration_s}\n[wearer]\nmax_charge_uc = 40\n\
             rise_ms = {}\nrise_bursts = {}\n[[channel]]\nnumber = 3\nname = \"it\"\n\
             limit = {limit:?}\nstart = {start:?}\n\
             stage = {{ kind = \"current\", full_scale_ma = 100.0 }}\n\
             train = {{ shape = \"biphasic-cathodic-first\", width_us = {}, max_width_us = 400, \
             period_us = {}, offset_us = {} }}\n[[program]]\n{programs}",
            self.rise_ms, self.rise_bursts, self.own_us, self.period_us, self.offset_us
        )
    }

    fn bursts(&self, until_us: u64) -> impl Iterator<Item = u64> + use<> {
        let (offset_us, period_us) = (self.offset_us, self.period_us);
        let starts = (0..).map(move |nth| offset_us + nth * period_us);
        starts.take_while(move |burst_us| *burst_us < until_us)
    }

    fn first_from(&self, t_us: u64) -> u64 {
        let periods = t_us.saturating_sub(self.offset_us).div_ceil(self.period_us);
        self.offset_us + periods * self.period_us
    }

    /// Returns the largest increase from one burst to the next.
    fn slope(&self) -> u64 {
        let by_time =
            self.limit * self.period_us.min(self.rise_ms * 1_000) / (self.rise_ms * 1_000);
        by_time.min(self.limit / self.rise_bursts).max(1)
    }

    /// Returns the shortest duration of a linear rise to `value`, µs.
    fn shortest_us(&self, value: u64) -> u64 {
        let by_slope = (value * self.period_us).div_ceil(self.slope());
        let least_us = (self.rise_ms * 1_000).max(self.rise_bursts * self.period_us);
        least_us.max(by_slope.saturating_sub(self.period_us))
    }
}

/// The device's rise as docs/protocol.md describes it, implemented independently for these tests.
struct Device {
    bench: Bench,
    first_us: Option<u64>,
    played: u64,
    previous: (u64, u64),
}

impl Device {
    const fn new(bench: Bench) -> Self {
        Self {
            bench,
            first_us: None,
            played: 0,
            previous: (0, 0),
        }
    }

    /// Returns the amplitude of a burst at `at_us` with this order, thousandths.
    fn burst(&mut self, at_us: u64, ordered: Stimulus) -> u64 {
        let (order, width) = (
            u64::from(ordered.amplitude.get()),
            u64::from(ordered.width_us),
        );
        let own = self.bench.own_us;
        // An order below the first step of the DAC ends a rise, as 0 does.
        if order * 65_535 / 100_000 == 0 {
            self.first_us = None;
            return order;
        }
        let (is_first, first_us) = match self.first_us {
            Some(first_us) => (false, first_us),
            None => (true, at_us),
        };
        if is_first {
            (self.first_us, self.played) = (Some(at_us), 0);
        }
        self.played += 1;
        let (period, rise) = (self.bench.period_us, self.bench.rise_ms * 1_000);
        let since = (at_us - first_us).min(rise);
        let bursts = self.bench.rise_bursts;
        let mut most = order * (since + period) / (rise + period);
        most = most.min(order * self.played.min(bursts + 1) / (bursts + 1));
        if !is_first {
            let (amplitude, before_us) = self.previous;
            let by = self.bench.slope();
            let charge = amplitude * before_us / own;
            most = most.min(amplitude + by).min((charge + by) * own / width);
        }
        let at_once = self.bench.start.min(self.bench.start * own / width);
        let amplitude = order.min(most.max(at_once));
        self.previous = (amplitude, width);
        amplitude
    }
}

/// Returns time in µs, amplitude in thousandths and width in µs of each burst of the session's
/// channel on this device.
fn expected_bursts(bench: &Bench, session: &Session) -> Vec<(u64, u64, u64)> {
    let mut device = Device::new(*bench);
    let bursts = bench.bursts(session.duration_us);
    let expected = bursts.map(|at_us| {
        let orders = session.setpoints.programs.at(at_us);
        let [(2, order)] = *orders else {
            panic!("{orders:?}");
        };
        assert!(u64::from(order.amplitude.get()) <= bench.limit);
        (at_us, device.burst(at_us, order), order.width_us.into())
    });
    expected.collect()
}

/// Returns whether the amplitude is within a thousandth, or a step of the DAC of 1.53 thousandths,
/// of the line.
fn is_on(line: f64, amplitude: u64) -> bool {
    (amplitude as f64 - line).abs() <= 2.0
}

fn benches() -> impl Strategy<Value = Bench> {
    let times = (5_000..60_000_u64, 0.0..1.0_f64, 1..1_500_u64, 1..30_u64);
    let amplitudes = (2_000..20_000_u64, prop_oneof![Just(0.0), 0.0..1.0]);
    (times, amplitudes, prop_oneof![Just(200_u64), 100..400_u64]).prop_map(
        |((period_us, offset, rise_ms, rise_bursts), (limit, start), own_us)| Bench {
            period_us,
            offset_us: (period_us as f64 * offset) as u64,
            rise_ms,
            rise_bursts,
            limit,
            start: (limit as f64 * start) as u64,
            own_us,
        },
    )
}

/// Formats µs as seconds with all digits.
fn seconds_text(us: u64) -> String {
    format!("{}.{:06}", us / 1_000_000, us % 1_000_000)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    /// On-off programs with ramps, for any train, rise and `start`: each burst lies on the ramp,
    /// none exceeds the amplitude, and each edge comes within a period of its time.
    #[test]
    fn on_and_off_follow_their_lines(
        bench in benches(),
        part in 0.05..1.0_f64,
        longer in prop_oneof![Just(1.0), 1.0..3.0_f64],
        (hold_us, down_us, off_us, delay_us) in
            (0..900_000_u64, prop_oneof![Just(0), 0..700_000_u64], 1..900_000_u64, 0..300_000_u64),
    ) {
        let value = ((bench.limit as f64 * part) as u64).max(10);
        let up_us = match value <= bench.start {
            true => (1e6 * (longer - 1.0)) as u64,
            false => (bench.shortest_us(value) as f64 * longer) as u64 + 1,
        };
        let on_us = (up_us + down_us + hold_us).max(bench.period_us);
        let off_us = off_us.max(bench.period_us);
        let duration_s = 2 + (delay_us + 2 * (on_us + off_us)) / 1_000_000;
        let session = bench.session(duration_s, &format!(
            "kind = \"on-off\"\nchannels = [3]\nvalue = {:?}\non_s = {}\noff_s = {}\n\
             ramp_up_s = {}\nramp_down_s = {}\ndelay_s = {}\n",
            value as f64 / 1e3, seconds_text(on_us), seconds_text(off_us), seconds_text(up_us), seconds_text(down_us), seconds_text(delay_us)
        ));
        for (at_us, amplitude, _) in expected_bursts(&bench, &session) {
            let Some(since_us) = at_us.checked_sub(delay_us) else {
                prop_assert_eq!(amplitude, 0, "before the delay, at {}", at_us);
                continue;
            };
            let begun_us = delay_us + since_us / (on_us + off_us) * (on_us + off_us);
            let first_us = bench.first_from(begun_us);
            let period = bench.period_us as f64;
            let up = ((at_us - first_us) as f64 + period) / (up_us as f64 + period);
            let left_us = (begun_us + on_us) as f64 - at_us as f64;
            let down = if down_us == 0 { 1.0 } else { left_us / down_us as f64 };
            let is_off = left_us <= 0.0;
            let line = value as f64 * up.min(down).clamp(0.0, 1.0);
            prop_assert_eq!(amplitude == 0, is_off, "at {}: {}", at_us, line);
            prop_assert!(is_off || is_on(line, amplitude), "at {at_us}: {amplitude}, not {line}");
            prop_assert!(amplitude <= value);
        }
    }

    /// Ramps through any points: each burst lies on the line between two points. A rise from 0 lies
    /// on the line that starts one period before its first burst.
    #[test]
    fn ramps_go_straight_from_point_to_point(
        bench in benches(),
        ways in prop::collection::vec((0..=20_u64, 1.0..2.0_f64), 2..7),
    ) {
        let bench = Bench { start: 0, own_us: 200, ..bench };
        let mut points = vec![(0_u64, 0_u64)];
        for (twentieth, longer) in ways {
            let &(at_us, from) = points.last().unwrap();
            let to = bench.limit * twentieth / 20;
            let needed_us = match from {
                0 if to > 0 => bench.shortest_us(to) + bench.period_us,
                _ => (to.saturating_sub(from) * bench.period_us).div_ceil(bench.slope()),
            };
            // A pause before a rise must contain a burst.
            let way_us = (needed_us as f64 * longer) as u64 + 2;
            points.push((at_us + way_us, to));
            if to == 0 {
                points.push((at_us + way_us + bench.period_us, 0));
            }
        }
        let mut rows = String::new();
        for (at_us, value) in &points {
            write!(rows, "{{ at_s = {}, value = {:?} }}, ", seconds_text(*at_us), *value as f64 / 1e3).unwrap();
        }
        let last_us = points.last().unwrap().0;
        let text = format!("kind = \"ramp\"\nchannels = [3]\npoints = [{rows}]\n");
        let session = bench.session(last_us / 1_000_000 + 1, &text);
        for (at_us, amplitude, _) in expected_bursts(&bench, &session) {
            let next = points.partition_point(|(point_us, _)| *point_us <= at_us);
            let (from_us, from) = points[next - 1];
            let line = match points.get(next) {
                None => from as f64,
                Some(&(to_us, to)) if from == 0 => {
                    let first_us = bench.first_from(from_us);
                    let whole_us = to_us - first_us + bench.period_us;
                    to as f64 * (at_us - first_us + bench.period_us) as f64 / whole_us as f64
                }
                Some(&(to_us, to)) => {
                    let part = (at_us - from_us) as f64 / (to_us - from_us) as f64;
                    from as f64 + (to as f64 - from as f64) * part
                }
            };
            prop_assert!(is_on(line, amplitude), "at {at_us}: {amplitude}, not {line}");
        }
    }

    /// Amplitude and width change together, as fast as the check allows: the width is the
    /// configured one, and the amplitude lies on its line.
    #[test]
    fn widths_rise_with_their_amplitudes(
        bench in benches(),
        (from, to, one_us, other_us) in (1..=10_u64, 1..=10_u64, 10..400_u64, 10..400_u64),
        longer in 1.0..1.5_f64,
    ) {
        let bench = Bench { start: 0, limit: bench.limit.min(15_000), ..bench };
        let [from, to] = [from, to].map(|percent| bench.limit * percent / 10);
        let way = |up_us: u64, way_us: u64| {
            let up = up_us + 2 * bench.period_us;
            format!(
                "kind = \"ramp\"\nchannels = [3]\npoints = [\
                 {{ at_s = 0, value = 0, width_us = {one_us} }}, \
                 {{ at_s = {}, value = {:?}, width_us = {one_us} }}, \
                 {{ at_s = {}, value = {:?}, width_us = {other_us} }}]\n",
                seconds_text(up), from as f64 / 1e3, seconds_text(up + way_us), to as f64 / 1e3
            )
        };
        // The parser's error message contains the time that each section needs.
        let needed = |text: &str, place: &str| {
            let told = Session::parse("it.toml", &bench.text(8_000, text)).err()?.lines();
            let line = told.lines().find(|candidate| candidate.contains("E485") && candidate.contains(place))?.to_owned();
            let (_, after) = line.split_once(" needs at least ")?;
            let (number, _) = after.split_once(" s from")?;
            Some((number.parse::<f64>().unwrap() * 1e6 * longer) as u64 + 1)
        };
        let up_us = needed(&way(1, 1), &format!("from 0 mA for {one_us}"));
        let way_us = needed(&way(1, 1), &format!("from {:?} mA", from as f64 / 1e3).replace(".0 ", " "));
        let text = way(up_us.unwrap_or(1), way_us.unwrap_or(1));
        let Ok(session) = Session::parse("it.toml", &bench.text(8_000, &text)) else {
            let told = Session::parse("it.toml", &bench.text(8_000, &text)).unwrap_err().lines();
            prop_assert!(told.contains("E486"), "{told}{text}");
            return Ok(());
        };
        let (up_us, way_us) = (up_us.unwrap_or(1) + 2 * bench.period_us, way_us.unwrap_or(1));
        let session = Session { duration_us: up_us + way_us + 1_000_000, ..session };
        for (at_us, amplitude, width_us) in expected_bursts(&bench, &session) {
            let part = (at_us.saturating_sub(up_us) as f64 / way_us as f64).min(1.0);
            let line = from as f64 + (to as f64 - from as f64) * part;
            let width = one_us as f64 + (other_us as f64 - one_us as f64) * part;
            if at_us >= up_us {
                prop_assert!(is_on(line, amplitude), "at {at_us}: {amplitude}, not {line}");
                prop_assert!((width_us as f64 - width).abs() <= 1.0);
            }
        }
    }
}

/// Channels of a list start one after the other, and end after their number of passes.
#[test]
fn channels_are_staggered_and_counted() {
    let text = BENCH.text(
        20,
        "kind = \"on-off\"\nchannels = [3, 4]\nvalue = 8.0\non_s = 2\noff_s = 2\nstagger_s = 2.5\n\
         repeats = 3\n[[channel]]\nnumber = 4\nname = \"other\"\nlimit = 9.0\n\
         stage = { kind = \"current\", full_scale_ma = 100.0 }\n\
         train = { shape = \"biphasic-cathodic-first\", width_us = 200, period_us = 25_000 }\n",
    );
    let session = Session::parse("it.toml", &text).unwrap();
    let programs = &session.setpoints.programs;
    assert_eq!(programs.channels().collect::<Vec<_>>(), [2, 3]);
    assert_eq!(session.setpoints.rate_hz, 50.0);
    let is_on = |t_us: u64| {
        programs
            .at(t_us)
            .iter()
            .map(|pair| pair.1.amplitude.get() > 0)
            .collect()
    };
    let on: Vec<[bool; 2]> = (0..20)
        .map(|second| is_on(second * 1_000_000 + 250_000))
        .map(|flags: Vec<bool>| [flags[0], flags[1]])
        .collect();
    let expected = |second: u64, begin: f64| {
        let since = second as f64 + 0.25 - begin;
        (0.0..10.0).contains(&since) && since % 4.0 < 2.0
    };
    for (second, on) in (0..20).zip(on) {
        assert_eq!(
            on,
            [expected(second, 0.0), expected(second, 2.5)],
            "{second} s"
        );
    }
}

/// Phases of a revolution, one of them across its end, from any angle of the crank.
#[test]
fn a_cycle_is_on_in_its_phases() {
    for (rpm, start_deg, delay_s) in [(50.0, 0.0, 0.0), (37.5, 123.0, 0.7), (61.7, 350.0, 0.0)] {
        let bench = Bench {
            rise_ms: 50,
            ..BENCH
        };
        let phases = [(3, 300.0, 40.0), (4, 90.0, 200.0)];
        let session = bench.session(
            12,
            &format!(
                "kind = \"cycle\"\ncadence_rpm = {rpm}\nstart_deg = {start_deg}\ndelay_s = {delay_s}\n\
                 phases = [{{ channel = 3, value = 8.0, from_deg = 300, to_deg = 40 }}, \
                 {{ channel = 4, value = 5.0, from_deg = 90, to_deg = 200 }}]\n\
                 [[channel]]\nnumber = 4\nname = \"other\"\nlimit = 9.0\n\
                 stage = {{ kind = \"current\", full_scale_ma = 100.0 }}\n\
                 train = {{ shape = \"biphasic-cathodic-first\", width_us = 200, period_us = 20_000 }}\n"
            ),
        );
        let programs = &session.setpoints.programs;
        for at_us in bench.bursts(session.duration_us) {
            // Each order is that of its channel's burst; channel 4's bursts are 3 ms from channel
            // 3's.
            let bursts_us = [at_us, at_us + 17_000];
            for ((place, (_, from, to)), burst_us) in phases.iter().enumerate().zip(bursts_us) {
                let turns = (burst_us as f64 / 1e6 - delay_s) * rpm / 60.0;
                let deg = (start_deg + 360.0 * turns).rem_euclid(360.0);
                let span = (to - from + 360.0_f64).rem_euclid(360.0);
                let into = (deg - from).rem_euclid(360.0);
                // A phase within which the crank starts begins only in the next revolution.
                let has_begun = turns * 360.0 >= into;
                let is_near = [0.0, span, 360.0]
                    .iter()
                    .any(|edge| (into - edge).abs() < 0.01);
                let is_on = programs.at(burst_us)[place].1.amplitude > Amplitude::ZERO;
                let expected = turns >= 0.0 && has_begun && into < span;
                assert!(is_near || is_on == expected, "{rpm}, {burst_us}: {deg}°");
            }
        }
    }
}

/// Steps apply unchanged from the first burst at or after their time.
#[test]
fn steps_are_held_and_repeated() {
    let session = BENCH.session(
        9,
        "kind = \"steps\"\nchannels = [3]\nevery_s = 4\n\
         points = [{ at_s = 0, value = 2.0 }, { at_s = 1, value = 4.0, width_us = 300 }, \
         { at_s = 3, value = 0 }]\n",
    );
    let order = |t_us: u64| {
        let order = session.setpoints.programs.at(t_us)[0].1;
        (order.amplitude.get(), order.width_us)
    };
    assert_eq!(order(0), (2_000, 200));
    assert_eq!(order(983_000), (2_000, 200));
    assert_eq!(order(983_001), (4_000, 300), "the burst at 1.003 s");
    assert_eq!(order(3_000_000).0, 0);
    assert_eq!(order(4_000_000), (2_000, 200));
    assert_eq!(order(8_990_000), (4_000, 300), "of the third pass");
}

/// Plays programs on the native device, with each burst ordered before its time, and compares the
/// output with the rise implemented above.
fn compare(benches: &[(u8, Bench)], session: &Session) {
    let world = native_world(Micros::new(u32::MAX - 200_000));
    let (mut client, _) = Connection::open(SimulatedPort::new(world)).unwrap();
    for request in session.setup_requests() {
        client.request(request).unwrap();
    }
    client.arm().unwrap();
    let programs = &session.setpoints.programs;
    let setpoint = Setpoint::Amplitudes(programs.at(0));
    client.request(setpoint.to_request(None)).unwrap();
    let epoch_us = client.start().unwrap();
    let mut bursts = Vec::new();
    for &(channel, bench) in benches {
        let own = bench.bursts(session.duration_us);
        bursts.extend(own.map(|at_us| (at_us, channel)));
    }
    bursts.sort_unstable();
    for &(at_us, channel) in &bursts {
        // An order takes effect after 0.54 ms.
        let until_us = (epoch_us + at_us).saturating_sub(1_200);
        let until_us = until_us.max(client.port().now_us());
        while client.next(until_us).unwrap().is_some() {}
        let orders = programs.at(at_us).into_iter();
        let own = orders.filter(|order| order.0 == channel).collect();
        client
            .post(Setpoint::Amplitudes(own).to_request(None))
            .unwrap();
    }
    let end_us = epoch_us + session.duration_us;
    while client.next(end_us).unwrap().is_some() {}
    let trace = &client.port().world.recorder.trace;
    assert_played(benches, session, trace, epoch_us);
}

/// Compares the output of a device from `epoch_us` on with the rise implemented above.
pub(super) fn assert_played(
    benches: &[(u8, Bench)],
    session: &Session,
    trace: &Trace,
    epoch_us: u64,
) {
    let programs = &session.setpoints.programs;
    let mut codes: [Vec<(u64, u16)>; CHANNELS] = Default::default();
    for edge in trace
        .edges_from(epoch_us)
        .filter(|edge| edge.state == State::Cathodic)
    {
        codes[usize::from(edge.channel)].push((edge.t_us - epoch_us, edge.dac_code));
    }
    for &(channel, bench) in benches {
        let mut device = Device::new(bench);
        let mut expected = Vec::new();
        for at_us in bench.bursts(session.duration_us) {
            let orders = programs.at(at_us);
            let order = orders.iter().find(|order| order.0 == channel).unwrap().1;
            let width_us = match order.width_us {
                0 => bench.own_us as u16,
                width_us => width_us,
            };
            let amplitude = device.burst(at_us, Stimulus { width_us, ..order });
            if order.amplitude > Amplitude::ZERO {
                let stage = session
                    .channel(channel)
                    .unwrap()
                    .spec
                    .stage
                    .validate()
                    .unwrap();
                let code = stage.code(Amplitude::new(amplitude as u32)).get().max(1);
                expected.push((at_us, code));
            }
        }
        assert!(expected.len() > 100, "{} bursts", expected.len());
        let found: Vec<_> = codes[usize::from(channel)].clone();
        for (found, expected) in found.iter().zip(&expected) {
            assert_eq!(found, expected, "channel {channel}");
        }
        assert_eq!(found.len(), expected.len());
    }
}

/// The built-in reciprocal session, with on-ramps of 0.5 s and a wearer's rise of 0.4 s.
#[test]
fn the_native_device_plays_the_pair_in_turn() {
    let session = crate::session_files::load("reciprocal.toml");
    let bench = |offset_us| Bench {
        period_us: 25_000,
        offset_us,
        own_us: 250,
        ..BENCH
    };
    compare(&[(0, bench(0)), (1, bench(12_500))], &session);
}

/// Amplitude and width change together, and pass `start` on the way.
#[test]
fn the_native_device_plays_widths_and_starts() {
    let bench = Bench {
        start: 1_500,
        rise_bursts: 12,
        ..BENCH
    };
    let session = bench.session(
        9,
        "kind = \"ramp\"\nchannels = [3]\nevery_s = 4\n\
         points = [{ at_s = 0, value = 0, width_us = 150 }, { at_s = 1, value = 8.0 }, \
         { at_s = 2.5, value = 9.0, width_us = 300 }, { at_s = 3, value = 0 }]\n",
    );
    compare(&[(2, bench)], &session);
}
